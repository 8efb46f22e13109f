"""Reads the study's claims from claims.toml: what each says, and what of which run decides it."""

import tomllib
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

FILE = Path(__file__).with_name("claims.toml")
Text = Annotated[str, Field(min_length=1)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Ratio(_Table):
    """A column of one cell over that of another, in the same rounds where they share enough.

    above, below: a cell by its variant and by values of what was swept or of parameters. column, over: of `above` and
    of `below`, columns of repetitions (reports/run/repetition.py). times: a factor. power: the logarithm of the ratio
    to this base in place of the ratio, which is the exponent of growth. unit: of the value.
    """

    above: dict[str, Any]
    below: dict[str, Any]
    column: str = "steady_s"
    over: str = ""
    times: float = 1.0
    power: float | None = None
    unit: str = "×"


class Apart(_Table):
    """Two cells, of whose stored pictures pixels are compared."""

    one: dict[str, Any]
    other: dict[str, Any]


class Claim(_Table):
    """A claim, and what decides it: a number within `least` to `most`, pictures that agree, or why nothing can.

    place: its section, table or figure in the study. says: the claim in our words. run: an experiment by name. ratio,
    apart: the number; apart: the share of pixels that two pictures show in other colours. agree: cells, whose pictures
    all agree with the reference; differ: the same, and the claim is true if they do not. untestable: the reason. why:
    what explains the verdict, true whatever the run says.
    """

    place: Text
    says: Text
    run: str = ""
    ratio: Ratio | None = None
    apart: Apart | None = None
    least: float | None = None
    most: float | None = None
    agree: dict[str, Any] | None = None
    differ: dict[str, Any] | None = None
    untestable: str = ""
    why: Text

    @model_validator(mode="after")
    def _decided_by_one(self):
        ways = [self.ratio, self.apart, self.agree, self.differ, self.untestable or None]
        if sum(way is not None for way in ways) != 1:
            raise ValueError(f"{self.place}: expected one of ratio, apart, agree, differ and untestable")
        if bool(self.run) == bool(self.untestable):
            raise ValueError(f"{self.place}: expected a run, or untestable with the reason")
        if bool(self.ratio or self.apart) != (self.least is not None or self.most is not None):
            raise ValueError(f"{self.place}: ratio and apart need least or most, and nothing else has them")
        if self.apart and self.least is None:
            raise ValueError(f"{self.place}: apart needs least")
        return self

    @property
    def rule(self) -> str:
        """When it is true, in words."""
        if self.untestable:
            return ""
        if not (self.ratio or self.apart):
            return "all pictures agree" if self.agree is not None else "pictures differ"
        if self.apart:
            return f"at least {100 * self.least:g} % of the pixels differ"
        unit = f" {self.ratio.unit}"
        if self.least is None:
            return f"at most {self.most:g}{unit}"
        return f"at least {self.least:g}{unit}" if self.most is None else f"{self.least:g} to {self.most:g}{unit}"


class Chapter(_Table):
    title: Text
    claim: Annotated[tuple[Claim, ...], Field(min_length=1)]


class _File(_Table):
    chapter: tuple[Chapter, ...]


@lru_cache(maxsize=1)
def chapters() -> tuple[Chapter, ...]:
    """Returns the chapters of claims.toml. ValidationError for a fault of the file, which names its place."""
    return _File.model_validate(tomllib.loads(FILE.read_text(encoding="utf-8"))).chapter


Verdict = Literal["true", "false", "not decided", "not testable here", "unavailable"]
