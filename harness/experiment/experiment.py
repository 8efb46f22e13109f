"""The experiment file: one TOML file, validated, with every default filled in."""

import math
from collections.abc import Collection, Iterator
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal, get_type_hints

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    ValidationError,
    WithJsonSchema,
    create_model,
    model_validator,
)

from harness.duration import Seconds, Share, duration
from harness.experiment import cluster, where
from harness.experiment.image import Count, Image
from harness.experiment.ladder import Ladder
from harness.reduction.leave_out import KINDS
from harness.renderer import registry
from harness.renderer.limits import Limits
from harness.scene.generate.generated import COUNTS
from harness.setting import put
from harness.toml import Place, Strict, read_toml, validated

POINTS = 10**5  # of a sweep: as many rows as a run can be expected to have
SIZE = ("width", "height", "region", "scale", "rays")  # what a time is of
Processes = Annotated[int, Field(ge=1, le=10**4)]

# One picture of its own: a scene, and what differs from [image].
_KINDS = get_type_hints(Image, include_extras=True)
Case = create_model(
    "Case",
    __base__=Strict,
    name=(Annotated[str, Field(min_length=1)], ...),
    scene=(str, ...),
    **{key: (_KINDS[key] | None, None) for key in Image.model_fields},
)


class Generate(Strict):
    """A scene that is made for the run, in place of files: its counts may be swept like the keys of [image].

    comparison: mirroring spheres on a grid (the study's scene) for any number of objects and lights. balls, tetra:
    Haines' scenes of a size. `rayrace generate` writes the same. icosphere: in the comparison scene's view, one mirror
    of 20 * 4^size triangles.
    """

    scene: Literal["comparison", "balls", "tetra", "icosphere"]
    objects: Count | None = None
    lights: Count | None = None
    size: Annotated[int, Field(ge=0, le=8)] | None = None

    @model_validator(mode="after")
    def _its_own_counts(self):
        for key in ("objects", "lights", "size"):
            if getattr(self, key) is not None and key not in COUNTS[self.scene]:
                raise ValueError(f"{key} is no count of {self.scene}; it has {', '.join(COUNTS[self.scene])}")
        return self

    def counts(self) -> dict[str, int]:
        """Every count that the scene has."""
        values = self.model_dump(exclude={"scene"}, exclude_none=True)
        return {**COUNTS[self.scene], **values}


class Measure(Strict):
    """How it is measured.

    interval: of the measurer, whose looks take some 0.2 ms each. gpu_load: of the load pass, one more process of each
    cell of a GPU, with frames that fill this time; 0: none. least_frame: later frames that would be shorter are batches
    of renders that last so long; 0: none. pair: the variant of which one cell is run twice in every round, for the
    noise floor of the run; auto takes the fastest there is. cold: every cell is run once more in every round, with no
    code of an earlier process to load; for what starting costs, and in no other time. peaks: before every timed
    repetition of a cell that can run, what the machine can do at most is measured (calibration.py), some 0.2 s, twice
    that where threads are used.
    until: "2 %": the run ends, after `processes` rounds at most, when the interval of every ratio is within so much of
    it (harness/race/enough.py).
    count: after all timed repetitions the instructions of a frame of every cell are counted (counting.py).
    """

    interval: Annotated[float, BeforeValidator(duration), Field(ge=0.01, allow_inf_nan=False)] = 0.05
    gpu_load: Annotated[float, BeforeValidator(duration), Field(ge=0, le=3600)] = 5.0
    least_frame: Annotated[float, BeforeValidator(duration), Field(ge=0, le=60)] = 1e-3
    pair: str = "auto"
    cold: bool = False
    peaks: bool = False
    until: Share | None = None
    count: bool = False


class Reference(Strict):
    """What errors are distances from (ERR-1).

    against: the truth of the scene; or "centres", the limit of each picture's own samples: of one sample a pixel the
    colours at the centres of pixels, of several those over their areas. depth: of the truth's rays: so many, "own",
    as many as the picture has, or "enough", until nothing changes. times: as many samples as the largest picture under
    test the truth has, at least. spots: its pixels that are worked out again in 60 digits. spot_seconds: after which no
    more of them are begun.
    """

    against: Literal["scene", "centres"] = "scene"
    depth: Count | Literal["own", "enough"] = "enough"
    times: Annotated[int, Field(ge=8, le=10**4)] = 64
    spots: Annotated[int, Field(ge=0, le=10**5)] = 100
    spot_seconds: Seconds = 60.0


class Stress(Strict):
    """A row of the catalogue of failures (harness/stress), to be run at each of its levels.

    levels: in place of the row's own. sweep: lists of values of keys of [image], every combination of them: the methods
    to compare.
    """

    row: str
    levels: Annotated[tuple[Annotated[float, Field(ge=0, allow_inf_nan=False)], ...], Field(min_length=1)] | None = None
    sweep: dict[str, tuple[Any, ...]] = {}


def _kind(value: str) -> str:
    if value in KINDS:
        return value
    near = get_close_matches(value, KINDS, n=1)
    hint = f'did you mean "{near[0]}"?' if near else f"known: {', '.join(KINDS)}"
    raise ValueError(f'no kind of thing is called "{value}"; {hint}')


Kind = Annotated[str, AfterValidator(_kind), WithJsonSchema({"enum": KINDS})]


class LeaveOut(Strict):
    """Each scene is also rendered with one thing left out, or made cheaper, in turn (harness/reduction).

    what: kinds of things, "all" for everything that a scene and its job have. The errors of the smaller models are
    distances from the truth of the whole scene, and their pictures agree with references of their own.
    """

    what: Literal["all"] | Annotated[tuple[Kind, ...], Field(min_length=1)] = "all"

    def kinds(self) -> tuple[str, ...]:
        return KINDS if self.what == "all" else self.what


class Override(Strict):
    """Other repetitions, for a renderer much slower than the rest."""

    processes: Processes | None = None
    frames: Count | None = None
    timeout: Seconds | None = None


Table = dict[str, tuple[Any, ...]]


class Experiment(Strict):
    """One experiment: scenes x renderers x sweep x processes.

    What is rendered is [image]; of what: `scenes`, files beside this one, and [generate], a scene made for the run (of
    [[generate]] tables, one each); or [[case]] tables, each a scene and what of [image] is other for it; or
    [[stress]], rows of the catalogue of failures, whose scenes and rays are made for the run from `seed`.

    Any key of [image] may be swept, and `side`, which is width and height at once, and the counts of [generate]: a
    point with a count that one of several generated scenes does not have is not of that scene.
    [sweep] is a table of lists, every combination of them. Of [[sweep]] tables each is zipped, its lists being of one
    length, and the tables are combined with each other. [[points]] tables are put one after the other: in each, a value
    is one or a list, and the lists are combined; what a table does not name is as in [image]. A point that two of
    them hold is run once. With a sweep beside them, all of its points are combined with each. One at a time, and
    jointly, and one point more:

        [[points]]
        side = [64, 128, 256]

        [[points]]
        depth = [0, 5, 10]

        [[points]]
        side = [64, 128]
        depth = [0, 5]

        [[points]]
        side = 512
        region = [[0, 0, 32, 32]]

    ladder: cells in an order, each with one change, in place of a sweep: the points are those of the rungs, and a
    renderer has cells only where it has a rung.

    where: expressions that must be true of a cell, or it is left out and counted:
    "renderer != 'python' or side <= 128".
    They name the keys of [image], side, objects, lights, size, processes, frames, and renderer, scene, case, stress
    (the row) and level as labels show them, and without, "nothing" for a whole scene; and have and, or, not, in,
    comparisons, arithmetic, min, max and abs.

    reference: without it, the truth is made where that takes one picture: of scenes without samples, at each picture's
    own depth.

    leave_out: what each scene can do without is measured too, as points of their own: `without`, "nothing" for the
    whole scene.

    theory: the slope of error against samples that is to be expected, by scene or case and sampler:
    theory.edge.jittered = -0.75. The samplers are those of [image], and feelers, lens, glossy.

    order: interleaved, every cell once in a shuffled order and then again, so that drift of the machine meets all
    alike; sequential, all repetitions of a cell before the next.

    slurm, dask: what `--executor slurm` or `--executor dask` asks of a cluster.
    """

    title: str = Field(min_length=1)
    scenes: tuple[str, ...] = ()
    renderers: tuple[str, ...] = Field(min_length=1)
    processes: Processes = 5
    frames: Count = 2
    timeout: Seconds = 600.0
    seed: int = 1
    order: Literal["interleaved", "sequential"] = "interleaved"
    where: tuple[str, ...] = ()
    image: Image = Image()
    case: tuple[Case, ...] = ()
    generate: Generate | tuple[Generate, ...] | None = None
    stress: tuple[Stress, ...] = ()
    sweep: Table | tuple[Table, ...] = {}
    points: tuple[dict[str, Any], ...] = ()
    ladder: tuple[Ladder, ...] = ()
    measure: Measure = Measure()
    limits: Limits = Limits()
    reference: Reference | None = None
    leave_out: LeaveOut | None = None
    theory: dict[str, dict[str, float]] = {}
    override: dict[str, Override] = {}
    slurm: cluster.Slurm = cluster.Slurm()
    dask: cluster.Dask | None = None

    @model_validator(mode="after")
    def _consistent(self):
        """Every fault at once."""
        if self.measure.until is not None and self.order == "sequential":
            raise ValueError("measure.until: not with order sequential, whose rounds are not whole before the end")
        if faults := [*self._sweep_faults(), *self._where_faults(), *self._name_faults(), *self._ladder_faults()]:
            raise ValueError("\n".join(faults))
        return self

    def _sweep_faults(self) -> Iterator[str]:
        swept = set()
        for table in (self.sweep,) if isinstance(self.sweep, dict) else self.sweep:
            if swept & set(table):
                yield f"sweep: {', '.join(sorted(swept & set(table)))} is in two tables"
            swept |= set(table)
            yield from self._unknown("sweep", table)
            if not isinstance(self.sweep, dict) and len({len(values) for values in table.values()}) > 1:
                names = list(table)
                yield f"sweep.{names[0]}: the lists of one [[sweep]] table are zipped, so of one length: {names}"
        points = {key for table in self.points for key in table}
        if swept & points:
            yield f"points: {', '.join(sorted(swept & points))} is swept too"
        for table in self.points:
            yield from self._unknown("points", table)
        if self.leave_out and ("rays" in swept | points or self.image.rays or any(case.rays for case in self.case)):
            yield "leave_out: not with rays, whose first hits are no picture"
        if "side" in swept | points and {"width", "height"} & (swept | points):
            yield "sweep: side is width and height at once; sweep the one or the others"

    def _where_faults(self) -> Iterator[str]:
        for text in self.where:
            try:
                where.parse(text)
            except ValueError as fault:
                yield f'where "{text}": {fault}'

    def _ladder_faults(self) -> Iterator[str]:
        if self.ladder and (self.sweep or self.points or self.stress):
            yield "ladder: its rungs are the points of the run; leave out [sweep], [[points]] and [[stress]]"
        if len({ladder.name for ladder in self.ladder}) != len(self.ladder):
            yield "ladder: each needs a name of its own"
        for number, ladder in enumerate(self.ladder):
            for step, rung in enumerate(ladder.rung):
                place = f"ladder.{number}.rung.{step}"
                if self.renderers and rung.renderer not in self.renderers:
                    yield f"{place}.renderer: {rung.renderer} is not among the experiment's renderers"
                for key, value in rung.image.items():
                    if key in SIZE:
                        yield f"{place}.image: {key}: of [image] alone, as the rungs of a ladder have one picture"
                    elif key not in Image.model_fields:
                        near = get_close_matches(key, Image.model_fields, n=1)
                        yield f"{place}.image: no such parameter: {key}" + (
                            f'; did you mean "{near[0]}"?' if near else ""
                        )
                    else:
                        yield from (f"{place}.image: {key}: {fault}" for fault in _value_faults(key, (value,)))

    @model_validator(mode="after")
    def _in_bounds(self):
        """Count the points before they are made."""
        tables = [self.sweep] if isinstance(self.sweep, dict) else self.sweep
        zipped = isinstance(self.sweep, tuple)
        swept = math.prod(
            math.prod([len(values) for values in table.values()][: 1 if zipped else None]) for table in tables
        )
        listed = sum(math.prod(len(v) if isinstance(v, tuple) else 1 for v in table.values()) for table in self.points)
        own = sum(math.prod(map(len, row.sweep.values())) * len(row.levels or "1") for row in self.stress)
        if (count := swept * max(listed, 1) * max(own, 1)) > POINTS:
            raise ValueError(f"sweep: {count} points, {POINTS} at most")
        return self

    def made(self) -> tuple[Generate, ...]:
        """The scenes that are made for the run."""
        return self.generate if isinstance(self.generate, tuple) else (self.generate,) if self.generate else ()

    def _unknown(self, name: str, table: dict) -> Iterator[str]:
        counts = dict.fromkeys(key for made in self.made() for key in COUNTS[made.scene])
        names = [*Image.model_fields, "side", *counts]
        for key, values in table.items():
            if key in {key for counts in COUNTS.values() for key in counts} - set(names):
                yield f"{name}.{key}: only of a scene that has it, in [generate]"
            elif key not in names:
                near = get_close_matches(key, names, n=1)
                yield f"{name}.{key}: no such parameter; " + (
                    f'did you mean "{near[0]}"?' if near else f"known: {', '.join(names)}"
                )
            elif values == ():
                yield f"{name}.{key}: expected at least one value"
            elif key not in counts:
                yield from (f"{name}.{key}: {fault}" for fault in _value_faults(key, values))

    def _name_faults(self) -> Iterator[str]:
        if [bool(self.scenes or self.made()), bool(self.case), bool(self.stress)].count(True) != 1:
            yield "scenes and [generate], [[case]] or [[stress]]: expected one of the three, with at least one scene"
        if self.leave_out and self.stress:
            yield "leave_out: not with [[stress]], whose truths are of their inputs as they are"
        for stress in self.stress:
            yield from self._unknown(f"stress.{stress.row}.sweep", stress.sweep)
        if len({case.name for case in self.case}) != len(self.case):
            yield "case: each needs a name of its own"
        for name in self.override:
            if self.renderers and name not in self.renderers:
                yield f"override.{name}: not among the experiment's renderers"
        if self.renderers and self.measure.pair not in ("auto", "off", *self.renderers):
            yield f'measure.pair: expected auto, off or a renderer of the experiment, found "{self.measure.pair}"'
        if len(set(self.renderers)) != len(self.renderers) or len(set(self.scenes)) != len(self.scenes):
            yield "scenes and renderers: each may be named once"


def _value_faults(key: str, values: Any) -> Iterator[str]:
    """What is wrong with swept values, each for itself: a list, or in [[points]] a single one."""
    field = "width" if key == "side" else key
    for value in values if isinstance(values, tuple) else (values,):
        try:
            Image.model_validate({field: value})
        except ValidationError as error:  # one of no place is of this value and others
            messages = [fault["msg"].removeprefix("Value error, ") for fault in error.errors() if fault["loc"]]
            if messages:
                yield f"{value!r}: {' or: '.join(messages)}"


def load(
    path: Path,
    settings: tuple[str, ...] = (),
    more: tuple[tuple[str, ...], ...] = (),
    renderers: Collection[str] | None = None,
) -> Experiment:
    """The experiment in a TOML file, with `key=value` settings (values as in TOML, keys dotted) put over it.

    more: the variants of renderers that take part too, unless the file names one of them. UserError with every mistake
    in keys and values; if there is none, in what concerns several of them; then, if `renderers` names all renderers,
    unknown ones and scenes that are not there.
    """
    path = Path(path)
    tables = read_toml(path)
    for setting in settings:
        put(tables, setting, "--set", "image.depth=5 or processes=3")
    if isinstance(tables.get("renderers"), list):
        for names in more:
            tables["renderers"] += names if not set(names) & set(map(str, tables["renderers"])) else ()

    def check(tables: dict) -> Iterator[tuple[Place, str]]:
        if renderers is None:
            return
        for number, name in enumerate(tables.get("renderers", ())):
            if name not in renderers:
                yield ("renderers", number), registry.unknown(name, renderers)
        named = [(("scenes", number), scene) for number, scene in enumerate(tables.get("scenes", ()))]
        cases = enumerate(tables.get("case", ()))
        named += [(("case", number, "scene"), case["scene"]) for number, case in cases if "scene" in case]
        for place, scene in named:
            if not (path.parent / scene).exists():
                yield place, f"no such file: {path.parent / scene}"

    given = tuple(setting.partition("=")[0].strip() for setting in settings)
    return validated(Experiment, tables, path, given, check)
