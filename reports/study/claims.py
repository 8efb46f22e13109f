"""Reads the study's claims from claims.toml: what each says, what it is about, and what of which run decides it."""

import tomllib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

FILE = Path(__file__).with_name("claims.toml")
Text = Annotated[str, Field(min_length=1)]
Verdict = Literal["true", "false", "not decided", "not testable here", "unavailable"]
RULES = "ratio", "growth", "value", "cores", "apart", "failing", "agree", "differ"
NUMBERS = "ratio", "growth", "value", "cores", "apart"  # rules that make a number, which has bounds


@dataclass(frozen=True)
class Quantity:
    """What a claim is about: the rules that may decide it, and the columns that these may read.

    columns: pairs, of `above` and of `below`; of a value the same column twice. exponent: is it one of growth?
    per_core: is it a share of the cores? own: do both sides belong to one cell?
    """

    rules: tuple[str, ...]
    columns: tuple[tuple[str, str], ...] = ()
    exponent: bool = False
    per_core: bool = False
    own: bool = False


def _same(*names: str) -> tuple[tuple[str, str], ...]:
    return tuple((name, name) for name in names)


QUANTITIES = {
    "time of a frame": Quantity(("ratio",), _same("steady_s")),
    "growth of the time of a frame": Quantity(("growth",)),
    "speed-up for each core": Quantity(("ratio",), _same("steady_s"), per_core=True),
    "time of the kernel": Quantity(("ratio",), _same("kernel_s")),
    "time of a GPU's thread": Quantity(("ratio",), (("kernel_s", "steady_s"),)),
    "the kernel's share of a frame": Quantity(("ratio",), (("kernel_s", "steady_s"),), own=True),
    "time to compile": Quantity(("value",), _same("compile_s")),
    "time to the first picture": Quantity(("ratio",), _same("wall_s")),
    "compiling beside a frame": Quantity(("ratio",), (("compile_s", "steady_s"),)),
    "error": Quantity(("ratio",), _same("error_rmse")),
    "growth of the error": Quantity(("ratio",), _same("error_rmse"), exponent=True),
    "memory": Quantity(("ratio",), _same("peak_bytes")),
    "kinds of memory": Quantity(("ratio",), (("peak_virtual_bytes", "render_peak_bytes"),), own=True),
    "cores in a phase": Quantity(("cores",)),
    "rows of the table of rays": Quantity(("value",), _same("walk_rows")),
    "growth of the number of rays": Quantity(("ratio",), _same("reflected"), exponent=True),
    "energy": Quantity(("value",), _same("mean_light")),
    "picture": Quantity(("agree", "differ", "apart")),
    "failures": Quantity(("failing",)),
}


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Sides(_Table):
    """Two cells, each by its variant and by values of what was swept or of parameters (verdict.cells)."""

    above: dict[str, Any]
    below: dict[str, Any]


class Ratio(Sides):
    """A column of one cell over that of another, in the same rounds where they share enough.

    column, over: of `above` and of `below`, columns of repetitions (verdict.COLUMNS). gain: a second ratio of `column`,
    which divides the first. lowest: of several cells of a side the one with the lowest median counts. times: a factor.
    per_core: divided by the usable cores of the run. power: the logarithm of the ratio to this base in place of the
    ratio, which is the exponent of growth. unit: of the value.
    """

    column: str = "steady_s"
    over: str = ""
    gain: Sides | None = None
    lowest: bool = False
    times: float = 1.0
    per_core: bool = False
    power: float | None = None
    unit: str = "×"

    @property
    def sides(self) -> list[dict[str, Any]]:
        return [self.above, self.below, *([self.gain.above, self.gain.below] if self.gain else [])]


class Growth(_Table):
    """The exponent by which the time of a frame grows along cells that differ in `along` alone.

    By pixels, order of rays, or objects and lights together, as equation 4.1 of the study has it.
    """

    cells: dict[str, Any]
    along: Literal["side", "depth", "objects", "lights"]


class Value(_Table):
    """A column of one cell."""

    cell: dict[str, Any]
    column: str
    unit: Text


class Cores(_Table):
    """The cores that a cell keeps busy in a phase of its processes, from the measurer's series."""

    cell: dict[str, Any]
    phase: Text


class Apart(_Table):
    """Two cells, of whose stored pictures pixels are compared."""

    first: dict[str, Any]
    other: dict[str, Any]


class Failing(_Table):
    """A row of the catalogue of failures in a variant, with a value of its method and other values of its cells."""

    row: Text
    cells: dict[str, Any]


class Claim(_Table):
    """A claim, what it is about, and the one rule that decides it, or why nothing can.

    place: its section, table or figure in the study. says: the claim in our words. quantity: what it is about
    (QUANTITIES), which the rule must measure. run: an experiment by name. ratio, growth, value, cores, apart: a number,
    and the claim is true if it lies within `least` to `most`; apart: the share of pixels that two pictures show in
    other colours. failing: the claim is true if no level of a row of the catalogue of failures fails. agree: cells,
    whose pictures all agree with the reference; differ: the same, and the claim is true if they do not. untestable: the
    reason. why: what explains the verdict, true whatever the run says.
    """

    place: Text
    says: Text
    quantity: str = ""
    run: str = ""
    ratio: Ratio | None = None
    growth: Growth | None = None
    value: Value | None = None
    cores: Cores | None = None
    apart: Apart | None = None
    failing: Failing | None = None
    agree: dict[str, Any] | None = None
    differ: dict[str, Any] | None = None
    least: float | None = None
    most: float | None = None
    untestable: str = ""
    why: Text

    @model_validator(mode="after")
    def _decided_by_one(self):
        ways = [name for name in RULES if getattr(self, name) is not None]
        if len(ways) + bool(self.untestable) != 1:
            raise ValueError(f"{self.place}: expected one of {', '.join(RULES)} and untestable")
        if bool(self.run) == bool(self.untestable):
            raise ValueError(f"{self.place}: expected a run, or untestable with the reason")
        if bool(ways and ways[0] in NUMBERS) != (self.least is not None or self.most is not None):
            raise ValueError(f"{self.place}: {', '.join(NUMBERS)} need least or most, and nothing else has them")
        return self

    @model_validator(mode="after")
    def _decided_by_its_quantity(self):
        if self.untestable:
            if self.quantity:
                raise ValueError(f"{self.place}: nothing is measured, so leave out the quantity")
            return self
        wanted = QUANTITIES.get(self.quantity)
        if wanted is None:
            raise ValueError(f"{self.place}: quantity is {self.quantity!r}, expected one of {', '.join(QUANTITIES)}")
        if self.decided_by not in wanted.rules:
            raise ValueError(f"{self.place}: {self.quantity} is not measured by {self.decided_by}")
        if wanted.columns and self.columns not in wanted.columns:
            raise ValueError(f"{self.place}: {self.quantity} is not measured by {' over '.join(self.columns)}")
        if ratio := self.ratio:
            if (ratio.power is not None) != wanted.exponent:
                raise ValueError(f"{self.place}: {self.quantity}: power is of the growth of something, and of it alone")
            if ratio.per_core != wanted.per_core:
                raise ValueError(f"{self.place}: {self.quantity}: per_core is of speed-ups for each core alone")
            if (ratio.above == ratio.below) != wanted.own:
                own = "one cell" if wanted.own else "two cells"
                raise ValueError(f"{self.place}: {self.quantity} is of {own}")
        return self

    @property
    def decided_by(self) -> str:
        """The name of its rule; "" if it is untestable."""
        return next((name for name in RULES if getattr(self, name) is not None), "")

    @property
    def columns(self) -> tuple[str, str] | None:
        """The columns that its rule reads; None if it reads none."""
        if self.ratio:
            return self.ratio.column, self.ratio.over or self.ratio.column
        return (self.value.column, self.value.column) if self.value else None

    @property
    def sides(self) -> list[dict[str, Any]]:
        """The cells of its rule, of which there must be one each."""
        if self.ratio:
            return self.ratio.sides
        if self.apart:
            return [self.apart.first, self.apart.other]
        return [(self.value or self.cores).cell] if self.value or self.cores else []

    @property
    def unit(self) -> str:
        """Of its number, with a space before it where one belongs."""
        return {"apart": " % of the pixels differ", "cores": " cores", "growth": " as exponent"}.get(
            self.decided_by, f" {(self.ratio or self.value).unit}" if self.ratio or self.value else ""
        )

    @property
    def rule(self) -> str:
        """When it is true, in words."""
        if self.decided_by not in NUMBERS:
            texts = {"agree": "all pictures agree", "differ": "pictures differ", "failing": "no level fails"}
            return texts.get(self.decided_by, "")
        scale = 100 if self.apart else 1
        least, most = (None if end is None else f"{scale * end:g}" for end in (self.least, self.most))
        if least == most:
            return f"{least}{self.unit}"
        if least is None:
            return f"at most {most}{self.unit}"
        return f"at least {least}{self.unit}" if most is None else f"{least} to {most}{self.unit}"


class Chapter(_Table):
    title: Text
    claim: Annotated[tuple[Claim, ...], Field(min_length=1)]


class _File(_Table):
    chapter: tuple[Chapter, ...]


@lru_cache(maxsize=1)
def chapters() -> tuple[Chapter, ...]:
    """Returns the chapters of claims.toml. ValidationError for a fault of the file, which names its place."""
    return _File.model_validate(tomllib.loads(FILE.read_text(encoding="utf-8"))).chapter
