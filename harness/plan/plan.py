"""Turns an experiment into cells and orders their repetitions."""

import hashlib
import itertools
import random
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple

from pydantic import ValidationError

from harness import stress
from harness.errors import UserError
from harness.experiment import sweep
from harness.experiment.experiment import Experiment, Reference
from harness.experiment.image import Image
from harness.experiment.where import Constraints
from harness.judge import truth
from harness.judge.hits import Aimed
from harness.plan.sources import Sources
from harness.process.repetition import unsupported
from harness.reduction.leave_out import LeaveOut, leave_outs
from harness.renderer import registry, versions
from harness.renderer.limits import DEFAULT, Limits
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.scene import warnings
from harness.scene.source import Source
from harness.statistics.statistics import LEAST
from harness.store.record import WHOLE
from harness.stress.job import Stressed
from harness.stress.row import ROUNDOFF

PAIRED = ("cpp", "numba", "cpp-threads", "numpy")  # variants for the A/A pair, in order of preference
PROCESSES = 10**6  # of a run, at most


class NoCells(UserError):
    """The constraints of an experiment leave nothing to run."""


@dataclass(frozen=True)
class Cell:
    """A variant at one point of the sweep. key: a hash of renderer, scene content and parameters.

    without: what is left out of its scene or its job. whole: the cell with nothing left out, of which its truth is.
    """

    key: str
    entry: Entry
    scene: str
    scene_version: str  # hash of its content
    parameters: Parameters
    needs: tuple[str, ...]
    processes: int
    timeout: float
    point: dict  # the swept values, as the experiment spells them
    objects: int  # that a ray is tested against
    lights: int
    stressed: Stressed | None = None  # of a [[stress]] experiment
    limits: Limits = DEFAULT
    without: LeaveOut | None = None
    whole: "Cell | None" = None

    @property
    def label(self) -> str:
        """The cell's name for people and files: variant, scene, swept values."""
        swept = [f"{key} {value}" for key, value in self.point.items()]
        return ", ".join([self.entry.name, Path(self.scene).stem, *swept])

    @property
    def refused(self) -> str | None:
        """Why its variant cannot run here, or cannot do the job; None if it can."""
        smaller = self.without.unavailable if self.without else ""
        return self.entry.unavailable or smaller or unsupported(self.entry, self.parameters, self.needs)

    @property
    def work(self) -> int:
        """The work of a frame by the study's equation 4.1: pixels * orders of rays * (objects + lights)."""
        x0, y0, x1, y1 = self.parameters.bounds()
        return (x1 - x0) * (y1 - y0) * (self.parameters.depth + 1) * (self.objects + self.lights)

    def facts(self) -> dict:
        """The part of a row that is known before the cell runs (harness/store/record.py)."""
        renderer = self.entry.renderer
        return {
            "cell": self.key,
            "variant": self.entry.name,
            "renderer": renderer.manifest.name,
            "renderer_version": renderer.version,
            "technology": renderer.manifest.technology,
            "lines": renderer.lines,
            "scene": self.scene,
            "scene_version": self.scene_version,
            "point": self.point,
            "parameters": self.parameters.values(),
            "needs": list(self.needs),
            **({"without": {"kind": self.without.kind, "proof": self.without.proof}} if self.without else {}),
        }


class Turn(NamedTuple):
    """One process of a cell. kind: timed; pair: the second process of the A/A pair in a round; cold: with no cache;
    count: several processes, in which instructions are counted and nothing is timed.
    """

    cell: Cell
    number: int
    kind: str


@dataclass(frozen=True)
class Plan:
    """The cells of an experiment.

    arrays: flattened scenes by scene_version. pair: the cell that runs twice in every round, for the noise floor; None
    for the given pair_reason. left_out: expressions of `where`, and how many cells each left out. cold: every cell
    also runs without a cache, once a round. peaks: the machine is calibrated before every timed repetition.
    warnings: about its scenes, and what is held against an equal version. against: names of variants, and of those of
    another version that they are held against. count: instructions of every cell are counted when all has been timed.
    """

    cells: tuple[Cell, ...]
    arrays: dict[str, dict]
    pair: Cell | None = None
    pair_reason: str = ""
    left_out: tuple[tuple[str, int], ...] = ()
    truths: "Truths | None" = None
    cold: bool = False
    peaks: bool = False
    warnings: tuple[str, ...] = ()
    against: tuple[tuple[str, str], ...] = ()
    count: bool = False

    def truths_of(self, cells: Iterable[Cell]) -> set[tuple]:
        """The names of the truths that these cells need."""
        return {name for cell in cells if self.truths and (name := self.truths.name(cell))}

    def order(self, seed: int, how: str = "interleaved") -> list[Turn]:
        """All processes of the plan in the order in which they run.

        interleaved: in rounds with every cell once, so that a run that is cut off is a thinner study of everything. A
        round is shuffled, and the next is its reverse: a linear drift of the machine then adds the same to every cell's
        mean over the two. sequential: all processes of a cell before the next cell, in the order of the file. Counts
        come last in both, as they would disturb what is timed.
        """
        last = [Turn(cell, 0, "count") for cell in self.cells if self.count and not cell.stressed]
        members = []
        for cell in self.cells:
            more = [("pair", cell is self.pair), ("cold", self.cold)]
            members += [(cell, "timed"), *((cell, kind) for kind, wanted in more if wanted)]
        if how == "sequential":
            return [Turn(cell, number, kind) for cell, kind in members for number in range(cell.processes)] + last
        turns, most = [], max((cell.processes for cell in self.cells), default=0)
        for number, shuffled in enumerate(rounds(members, most, seed)):
            turns += [Turn(cell, number, kind) for cell, kind in shuffled if number < cell.processes]
        return turns + last


def rounds(members: list, count: int, seed: int) -> Iterator[list]:
    """Yields the members of each round in their order: shuffled, and in the next round in reverse (Plan.order)."""
    rng = random.Random(seed)
    for number in range(count):
        members = members[::-1] if number % 2 else rng.sample(members, len(members))
        yield members


def make(
    experiment: Experiment, file: Path, entries: dict[str, Entry], only: tuple[str, ...] = (), against: str = ""
) -> Plan:
    """The plan of an experiment read from `file`. entries: variants by name; only: names of those that are to run,
    also of such as the experiment does not list; if there are none, all that it lists.

    against: where another version of them is, if they are to be held against it (renderer/versions.py): each cell then
    has one more beside it.

    UserError for an unknown renderer, a faulty scene, swept value or constraint, and for two equal cells unless they
    are from different [[points]] tables.
    """
    listed = [registry.find(name, entries, file) for name in experiment.renderers]
    if unknown := [name for name in only if name not in entries]:
        near = get_close_matches(unknown[0], entries, n=1)
        names = f"the experiment lists {', '.join(experiment.renderers)}; `rayrace list` has all"
        hint = f'did you mean "{near[0]}"?' if near else names
        raise UserError(f"--only {', '.join(unknown)}: no such renderer", remedy=hint)
    more = [entries[name] for name in only if name not in experiment.renderers]
    chosen = [entry for entry in (*listed, *more) if not only or entry.name in only]
    others = versions.others(against, chosen) if against else {}
    equal = [name for name, other in others.items() if other.renderer.version == entries[name].renderer.version]
    chosen = [version for entry in chosen for version in (entry, others.get(entry.name)) if version]
    constraints = Constraints(experiment.where, file)
    arrays: dict[str, dict] = {}
    seen: dict[str, tuple[Cell, int]] = {}
    sources: dict[str, Source] = {}
    for picture in _located(_pictures(experiment, file), file):
        for cell in _located(picture.cells(experiment, chosen, constraints), file, picture.point):
            other, table = seen.setdefault(cell.key, (cell, picture.table))
            if other is not cell and table == picture.table:
                raise UserError(f'{file}: "{other.label}" and "{cell.label}" are the same cell; leave one out')
            for cell_or_whole, source in ((cell, picture.source), (cell.whole, picture.whole and picture.whole.source)):
                if cell_or_whole:
                    sources.setdefault(cell_or_whole.scene_version, source)
                    arrays.setdefault(cell_or_whole.scene_version, source.flat(picture.image.arithmetic)[1])
    cells = tuple(cell for cell, _ in seen.values())
    if not cells:
        raise NoCells("every cell is left out by where", file=file)
    if (processes := sum(cell.processes for cell in cells)) > PROCESSES:
        raise UserError(f"{len(cells)} cells have {processes} processes, {PROCESSES} at most", file=file)
    pair, reason = pair_of(cells, experiment.measure.pair)
    truths = Truths(cells, sources, experiment.reference)
    left_out = tuple(constraints.left_out.items())
    cold, peaks = experiment.measure.cold, experiment.measure.peaks
    jobs: dict[str, list[Parameters]] = {}
    for cell in cells:
        if not cell.without:
            jobs.setdefault(cell.scene_version, []).append(cell.parameters)
    shown = ((source.scene, jobs.get(key, ())) for key, source in sources.items() if isinstance(source, Source))
    doubts = tuple(dict.fromkeys(text for scene, of_scene in shown for text in warnings(scene, of_scene)))
    doubts += tuple(f"{name} has the same sources as {others[name].name}" for name in equal)
    pairs = tuple((name, other.name) for name, other in others.items())
    return Plan(cells, arrays, pair, reason, left_out, truths, cold, peaks, doubts, pairs, experiment.measure.count)


class Truths:
    """The truth jobs of all cells, made on first use, as a plan can have many cells."""

    def __init__(self, cells: tuple[Cell, ...], sources: dict[str, Source], wanted: Reference | None):
        self.cells, self.sources = cells, sources
        self.wanted = wanted or Reference(spots=0)
        self.jobs: dict[str, dict] = {}  # by scene_version, then by view
        self.names: dict[str, tuple | None] = {}  # by key of a cell

    def of(self, cell: Cell) -> truth.Job:
        """The truth job of a cell."""
        whole = cell.whole or cell
        version = whole.scene_version
        if version not in self.jobs:
            wholes = {whole_cell.key: whole_cell for whole_cell in (other.whole or other for other in self.cells)}
            shown = [other.parameters for other in wholes.values() if other.scene_version == version]
            self.jobs[version] = truth.jobs(shown, self.wanted, self.sources[version].needs)
        return self.jobs[version][truth.view(whole.parameters, self.wanted)]

    def name(self, cell: Cell) -> tuple | None:
        """What cells with the same truth have in common; None for a cell without a truth."""
        if cell.key not in self.names:
            none, whole = cell.stressed or cell.parameters.kind == "rays", cell.whole or cell
            self.names[cell.key] = None if none else (whole.scene_version, truth.view(whole.parameters, self.wanted))
        return self.names[cell.key]


@dataclass(frozen=True)
class _Picture:
    """A point of the sweep for all variants. table: number of its [[points]] table. without, whole: as of a Cell."""

    source: Source | Aimed | Stressed
    image: Image
    point: dict
    table: int
    without: LeaveOut | None = None
    whole: "_Picture | None" = None

    def cells(self, experiment: Experiment, chosen: list[Entry], constraints: Constraints) -> Iterator[Cell]:
        climbers = sweep.climbers(experiment, self.table)
        for entry in chosen:
            if climbers is not None and entry.variant.name not in climbers:
                continue
            override = experiment.override.get(entry.variant.name)
            frames = experiment.frames if override is None or override.frames is None else override.frames
            threads = entry.threads() if self.image.threads == "default" else self.image.threads
            processes = (override and override.processes) or experiment.processes
            if experiment.where and not constraints.keep(self._names(entry, threads, frames, processes)):
                continue
            timeout = (override and override.timeout) or experiment.timeout
            yield self._cell(experiment, entry, threads, frames, processes, timeout)

    def _cell(self, experiment, entry: Entry, threads: int, frames: int, processes: int, timeout: float) -> Cell:
        parameters = self.source.parameters(self.image, threads, frames, experiment.measure.least_frame)
        version, _ = self.source.flat(self.image.arithmetic)
        objects, lights = self.source.counts
        return Cell(
            key=_key(entry, version, parameters, *([self.without.name] if self.without else [])),
            entry=entry,
            scene=self.source.name,
            scene_version=version,
            parameters=parameters,
            needs=self.source.needs(parameters),
            processes=processes,
            timeout=timeout,
            point=self.point,
            objects=objects,
            lights=lights,
            stressed=self.source if isinstance(self.source, Stressed) else None,
            limits=experiment.limits,
            without=self.without,
            whole=self.whole and self.whole._cell(experiment, entry, threads, frames, processes, timeout),
        )

    def _names(self, entry: Entry, threads: int, frames: int, processes: int) -> dict:
        """The values of where.NAMES for one variant."""
        objects, lights = self.source.counts
        image = self.image
        return {
            **image.model_dump(),
            "sampler": image.chosen_sampler(),
            "threads": threads,
            "renderer": entry.variant.name,
            "scene": self.source.stem,
            "case": self.point.get("case", ""),
            "stress": self.point.get("stress", ""),
            "level": self.point.get("level"),
            "without": self.point.get("without", WHOLE),
            "objects": objects,
            "lights": lights,
            "size": self.source.size,
            "side": image.width if image.width == image.height else None,
            "processes": processes,
            "frames": frames,
        }


def _pictures(experiment: Experiment, file: Path) -> Iterator[_Picture]:
    """Yields every point of every scene. UserError for a value out of range."""
    if experiment.stress:
        yield from _stressed(experiment, file)
        return
    sources = Sources(experiment, file)
    scenes = [(name, {}, {}) for name in (*experiment.scenes, *sources.made)]
    for case in experiment.case:
        scenes.append((case.scene, {"case": case.name}, case.model_dump(exclude={"name", "scene"}, exclude_none=True)))
    points, image, keys = sweep.points(experiment), experiment.image.model_dump(), set(Image.model_fields)
    for name, case, own in scenes:
        values = {**image, **own}
        square = values["width"] == values["height"]
        defaults = {**values, **sources.counts(name), **({"side": values["width"]} if square else {})}
        seen: dict[str, int] = {}
        for swept, table in points:
            source = sources.find(name, swept)
            if source is None:
                continue
            point = {**case, **sweep.filled(swept, experiment, defaults)}
            if seen.setdefault(repr(point), table) != table:
                continue
            chosen = {**values, **{key: value for key, value in swept.items() if key in keys}}
            if "side" in swept:
                chosen |= {"width": swept["side"], "height": swept["side"]}
            where = [f'case "{case["case"]}"'] if case else []
            point_image = _image(chosen, file, [*where, *([f"sweep {swept}"] if swept else [])])
            if experiment.leave_out is None:
                yield _Picture(sources.aimed(source, point_image), point_image, point, table)
                continue
            whole = _Picture(source, point_image, {**point, "without": WHOLE}, table)
            yield whole
            kinds, job = experiment.leave_out.kinds(), source.parameters(point_image, threads=1, frames=0)
            for left_out in leave_outs(source.scene, job, kinds):
                yield _Picture(
                    sources.without(source, left_out),
                    point_image,
                    {**point, "without": left_out.name},
                    table,
                    left_out,
                    whole,
                )
        if not seen:
            raise UserError(f"sweep: every point sweeps a count that {Path(name).stem} does not have", file=file)


def _stressed(experiment: Experiment, file: Path) -> Iterator[_Picture]:
    """Yields every level of every row, with every combination of the row's sweep and the experiment's."""
    rows, image, made = stress.rows(), experiment.image.model_dump(), {}
    for stress_table in experiment.stress:
        if stress_table.row not in rows:
            raise UserError(f'stress: no row "{stress_table.row}"', file=file, remedy=f"known: {', '.join(rows)}")
        row = rows[stress_table.row]
        axes = [[(key, value) for value in values] for key, values in stress_table.sweep.items()]
        for (common, table), *own in itertools.product(sweep.points(experiment), *axes):
            swept = {**common, **dict(own)}
            for level in stress_table.levels or row.levels:
                precision = swept.get("precision", image["precision"])
                if precision not in ROUNDOFF:
                    why = f'stress: {row.name} has no precision "{precision}"'
                    raise UserError(why, file=file, remedy=f"known: {', '.join(ROUNDOFF)}")
                key = row.name, level, precision
                source = made.setdefault(key, Stressed(row, level, precision, experiment.seed))
                point = {"stress": row.name, "level": level, **swept}
                point_image = _image({**image, **source.trial.parameters, **swept}, file, [f"stress {point}"])
                yield _Picture(source, point_image, point, table)


def _located(items: Iterator, file: Path, point: dict | None = None) -> Iterator:
    """Yields pictures, or the cells of a point; a UserError that names no file gets this one, and the point."""
    try:
        yield from items
    except UserError as error:
        if error.file is not None or str(file) in str(error):
            raise
        where = f"point {point}: " if point else ""
        raise UserError(f"{where}{error.message}", file=file, remedy=error.remedy) from None


def _image(chosen: dict, file: Path, where: list[str]) -> Image:
    try:
        return Image.model_validate(chosen).scaled()
    except ValidationError as error:
        why = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise UserError(f"{file}: {', '.join(where)}: {why}") from None


def pair_of(cells: tuple[Cell, ...], wanted: str) -> tuple[Cell | None, str]:
    """The cell for the A/A pair, and why there is none. wanted: measure.pair: "auto", "off" or a variant.

    It is the cell with the most work of the first suitable variant.
    """
    if wanted == "off":
        return None, 'measure.pair is "off"'
    variants = dict.fromkeys(cell.entry.name for cell in cells)
    order = dict.fromkeys([*(name for name in PAIRED if name in variants), *variants])
    whose = "any variant" if wanted == "auto" else wanted
    reason = f"no cell of {whose} runs here without being an exhibit or simulated"
    for name in order if wanted == "auto" else [wanted]:
        able = [cell for cell in cells if cell.entry.name == name and _comparable(cell)]
        many = [cell for cell in able if cell.processes >= LEAST]
        if many:
            return max(many, key=lambda cell: cell.work), ""
        if able:
            reason = f"its noise floor needs {LEAST} processes"
    return None, reason


def pair_facts(pair: Cell | None, reason: str) -> dict:
    """`pair` of run.json."""
    return {"cell": pair.key, "label": pair.label} if pair else {"unavailable": reason}


def _comparable(cell: Cell) -> bool:
    """Whether a cell runs here and may be compared."""
    return not (cell.entry.variant.exhibit or cell.entry.simulated or cell.refused)


def _key(entry: Entry, scene_version: str, parameters: Parameters, *without: str) -> str:
    """without: the name of what is left out, if something is: without it the job may be another cell's."""
    text = repr((entry.name, entry.renderer.version, scene_version, parameters, *without))
    return hashlib.sha256(text.encode()).hexdigest()[:12]
