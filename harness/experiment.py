"""An experiment: one TOML file, checked and with every default filled in."""

import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, create_model, model_validator

from harness.errors import UserError
from harness.job import Parameters
from harness.manifest import Strict, read_toml, validated

BLOCK = 1024  # threads that a block of a GPU can have
UNITS = {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}


def duration(value: Any) -> Any:
    """Seconds from "50 ms", "10 min" or a plain number of seconds."""
    if isinstance(value, str):
        match = re.fullmatch(r"\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*([a-z]+)\s*", value)
        if not match or match[2] not in UNITS:
            raise ValueError(f'expected a time such as "50 ms", "30 s", "10 min" or "2 h", found "{value}"')
        return float(match[1]) * UNITS[match[2]]
    return value


Seconds = Annotated[float, BeforeValidator(duration), Field(gt=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0, le=10**6)]
Size = Annotated[int, Field(ge=1, le=2**16)]
Precision = Annotated[str, Field(pattern=r"^[a-z]+[0-9]+$")]
Region = Literal["all", "one pixel"] | tuple[Count, Count, Count, Count]
Real = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Image(Strict):
    """What is rendered. Every key may also be swept."""

    width: Size = 512
    height: Size = 512
    region: Region = "all"
    depth: Count = 10
    shadows: bool = False
    sampler: Literal["one", "uniform", "jittered", "adaptive"] | None = None  # None: uniform if samples > 1, else one
    samples: Annotated[int, Field(ge=1, le=1024)] = 1
    adaptive_depth: Annotated[int, Field(ge=0, le=8)] = 3
    adaptive_threshold: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 0.1
    lens_radius: Real = 0.0
    focal_distance: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    feelers: Annotated[int, Field(ge=0, le=10**5)] = 0
    glossy_rays: Annotated[int, Field(ge=0, le=10**4)] = 0
    glossy_weight: Literal["plain", "study"] = "plain"
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    walk: Literal["least", "recursion", "table", "stack", "chain"] = "least"
    accel: Literal["auto", "none", "bvh"] = "auto"
    arithmetic: Literal["linear", "srgb"] = "linear"  # srgb: codes added as if they were light (figure 2.6)
    sample_x: Annotated[float, Field(ge=0, lt=1)] = 0.5
    sample_y: Annotated[float, Field(ge=0, lt=1)] = 0.5
    precision: Precision = "float64"
    threads: Annotated[int, Field(ge=1)] | Literal["default"] = "default"
    scene_memory: Literal["auto", "global", "constant", "shared"] = "auto"  # of a GPU, as what follows
    block_width: Annotated[int, Field(ge=1, le=BLOCK)] = 16
    block_height: Annotated[int, Field(ge=1, le=BLOCK)] = 16
    total_threads: Annotated[int, Field(ge=0, lt=2**31)] = 0  # 0: one for each pixel
    max_registers: Annotated[int, Field(ge=0, le=255)] = 0  # of a thread; 0: no cap

    @model_validator(mode="after")
    def _sides_fit(self):
        if isinstance(self.region, tuple):
            x0, y0, x1, y1 = self.region
            if not (x0 < x1 <= self.width and y0 < y1 <= self.height):
                raise ValueError(f"region {list(self.region)}: expected x0 < x1 <= width and y0 < y1 <= height")
        threads = self.block_width * self.block_height
        if threads > BLOCK:
            sides = f"{self.block_width} x {self.block_height}"
            raise ValueError(f"block_width x block_height: {sides} is {threads} threads, expected {BLOCK} at most")
        return self

    def bounds(self) -> tuple[int, int, int, int] | None:
        """The region in pixels; None for the whole picture. One pixel is the one in the middle."""
        if self.region == "one pixel":
            i, j = self.width // 2, self.height // 2
            return i, j, i + 1, j + 1
        return None if self.region == "all" else self.region

    def parameters(self, threads: int, frames: int) -> Parameters:
        if self.lens_radius and self.focal_distance is None:
            raise UserError("lens_radius: also needs focal_distance, from the eye to what is in focus")
        values = self.model_dump(exclude={"region", "threads"}, exclude_none=True)
        values.setdefault("sampler", "uniform" if self.samples > 1 else "one")
        return Parameters(**values, region=self.bounds(), threads=threads, frames=frames)


# One picture of its own: a scene, and what differs from [image].
Case = create_model(
    "Case",
    __base__=Strict,
    name=(Annotated[str, Field(min_length=1)], ...),
    scene=(str, ...),
    **{key: (kind | None, None) for key, kind in Image.__annotations__.items()},
)


class Measure(Strict):
    """gpu_load: of the load pass, one more process of each cell of a GPU, with frames that fill this time. 0: none."""

    interval: Seconds = 0.05
    gpu_load: Annotated[float, BeforeValidator(duration), Field(ge=0, le=3600)] = 5.0


class Override(Strict):
    """Other repetitions, for a renderer much slower than the rest."""

    processes: Annotated[int, Field(ge=1)] | None = None
    frames: Count | None = None
    timeout: Seconds | None = None


class Experiment(Strict):
    """One experiment: scenes x renderers x sweep x processes, or [[case]] tables in place of the scenes.

    sweep: a table of lists gives every combination; each table of an array of tables is zipped, its lists being of one
    length, and the tables are combined with each other.
    """

    title: str = Field(min_length=1)
    scenes: tuple[str, ...] = ()
    renderers: tuple[str, ...] = Field(min_length=1)
    processes: Annotated[int, Field(ge=1)] = 5
    frames: Count = 2
    timeout: Seconds = 600.0
    seed: int = 1
    image: Image = Image()
    case: tuple[Case, ...] = ()
    sweep: dict[str, tuple[Any, ...]] | tuple[dict[str, tuple[Any, ...]], ...] = {}
    measure: Measure = Measure()
    override: dict[str, Override] = {}

    @model_validator(mode="after")
    def _sweep_known(self):
        swept = set()
        for table in (self.sweep,) if isinstance(self.sweep, dict) else self.sweep:
            if swept & set(table):
                raise ValueError(f"sweep: {', '.join(sorted(swept & set(table)))} is in two tables")
            swept |= set(table)
            for key, values in table.items():
                if key not in Image.model_fields:
                    raise ValueError(f"sweep.{key}: no such parameter; known: {', '.join(Image.model_fields)}")
                if not values:
                    raise ValueError(f"sweep.{key}: expected at least one value")
            if not isinstance(self.sweep, dict) and len({len(values) for values in table.values()}) > 1:
                raise ValueError(f"sweep: the lists of one [[sweep]] table are zipped, so of one length: {list(table)}")
        if bool(self.scenes) == bool(self.case):
            raise ValueError("scenes or [[case]]: expected one of the two, with at least one scene")
        if len({case.name for case in self.case}) != len(self.case):
            raise ValueError("case: each needs a name of its own")
        for name in self.override:
            if name not in self.renderers:
                raise ValueError(f"override.{name}: not among the experiment's renderers")
        if len(set(self.renderers)) != len(self.renderers) or len(set(self.scenes)) != len(self.scenes):
            raise ValueError("scenes and renderers: each may be named once")
        return self


def load(path: Path, settings: tuple[str, ...] = ()) -> Experiment:
    """The experiment in a TOML file, with `key=value` settings (values as in TOML, keys dotted) put over it."""
    path = Path(path)
    tables = read_toml(path)
    for setting in settings:
        _set(tables, setting)
    return validated(Experiment, tables, path)


def _set(tables: dict, setting: str) -> None:
    import tomllib

    key, equals, text = setting.partition("=")
    if not equals or not key:
        raise UserError(f"--set {setting}: expected key=value, such as image.depth=5 or processes=3")
    try:
        value = tomllib.loads(f"x = {text}")["x"]
    except tomllib.TOMLDecodeError:
        value = text  # a bare word is a string
    *place, last = key.strip().split(".")
    for step in place:
        tables = tables.setdefault(step, {})
        if not isinstance(tables, dict):
            raise UserError(f"--set {setting}: {step} is no table")
    tables[last] = value
