"""Turns an experiment into cells, and orders their repetitions."""

import hashlib
import itertools
import random
from collections.abc import Iterator
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
from harness.renderer import registry
from harness.renderer.limits import DEFAULT, Limits
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.scene import warnings
from harness.scene.source import Source
from harness.statistics.statistics import LEAST
from harness.stress.job import Stressed
from harness.stress.row import ROUNDOFF

PAIRED = ("cpp", "numba", "cpp-threads", "numpy")  # whose cell is run twice: the first of them that can
PROCESSES = 10**6  # of a run


class NoCells(UserError):
    """The constraints of an experiment leave nothing to run."""


@dataclass(frozen=True)
class Cell:
    """One point of the sweep. `key` is a hash of all that makes it: renderer, scene content, parameters."""

    key: str
    entry: Entry
    scene: str
    scene_version: str  # hash of its content
    parameters: Parameters
    needs: tuple[str, ...]
    processes: int
    timeout: float
    point: dict  # the swept values, as the experiment spells them
    objects: int  # that a ray is tried against
    lights: int
    stressed: Stressed | None = None  # what it is put under, of a [[stress]] experiment
    limits: Limits = DEFAULT

    @property
    def label(self) -> str:
        """For people and file names: variant, scene, swept values."""
        swept = [f"{key} {value}" for key, value in self.point.items()]
        return ", ".join([self.entry.name, Path(self.scene).stem, *swept])

    @property
    def refused(self) -> str | None:
        """None, or why its variant cannot do it, or cannot run here."""
        return self.entry.unavailable or unsupported(self.entry, self.parameters, self.needs)

    @property
    def work(self) -> int:
        """The work of a frame by the study's equation 4.1: p * d * (o + l), for d + 1 orders of rays."""
        x0, y0, x1, y1 = self.parameters.bounds()
        return (x1 - x0) * (y1 - y0) * (self.parameters.depth + 1) * (self.objects + self.lights)

    def facts(self) -> dict:
        """Returns the part of a row that is known before the cell runs (harness/store/record.py)."""
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
        }


class Turn(NamedTuple):
    """One process of a cell. kind: timed; pair, the second process of the A/A pair in a round; cold, with no cache."""

    cell: Cell
    number: int
    kind: str


@dataclass(frozen=True)
class Plan:
    cells: tuple[Cell, ...]
    arrays: dict[str, dict]  # flattened scenes by scene_version
    pair: Cell | None = None  # the cell that is run twice in every round, which tells the noise floor
    pair_reason: str = ""  # why there is none
    left_out: tuple[tuple[str, int], ...] = ()  # expressions of `where`, and how many cells each left out
    truths: "Truths | None" = None
    cold: bool = False  # is every cell also run without a cache, once a round?
    peaks: bool = False  # is the machine calibrated before every timed repetition?
    warnings: tuple[str, ...] = ()  # of its scenes

    def order(self, seed: int, how: str = "interleaved") -> list[Turn]:
        """Every process of the plan in turn.

        interleaved: every cell once, and then again, so that a run that is cut off is a thin study of everything. A
        round is shuffled, and the next is the same one backwards: a linear drift of the machine then adds the same to
        every cell's mean over the two. sequential: all of a cell before the next, in the order of the file.
        """
        members = []
        for cell in self.cells:
            more = [("pair", cell is self.pair), ("cold", self.cold)]
            members += [(cell, "timed"), *((cell, kind) for kind, wanted in more if wanted)]
        if how == "sequential":
            return [Turn(cell, number, kind) for cell, kind in members for number in range(cell.processes)]
        rng, turns = random.Random(seed), []
        for number in range(max((cell.processes for cell in self.cells), default=0)):
            members = members[::-1] if number % 2 else rng.sample(members, len(members))
            turns += [Turn(cell, number, kind) for cell, kind in members if number < cell.processes]
        return turns


def make(experiment: Experiment, file: Path, known: dict[str, Entry], only: tuple[str, ...] = ()) -> Plan:
    """The plan of an experiment read from `file`.

    UserError for an unknown renderer, a faulty scene, swept value or constraint, and if two cells are the same that no
    two [[points]] tables hold.
    """
    chosen = [registry.find(name, known, file) for name in experiment.renderers]
    if unknown := [name for name in only if name not in experiment.renderers]:
        near = get_close_matches(unknown[0], experiment.renderers, n=1)
        hint = f'did you mean "{near[0]}"?' if near else f"they are: {', '.join(experiment.renderers)}"
        raise UserError(f"--only {', '.join(unknown)}: not among the experiment's renderers", remedy=hint)
    chosen = [entry for entry in chosen if not only or entry.name in only]
    constraints = Constraints(experiment.where, file)
    arrays: dict[str, dict] = {}
    seen: dict[str, tuple[Cell, int]] = {}
    sources: dict[str, Source] = {}
    for picture in _pictures(experiment, file):
        for cell in picture.cells(experiment, chosen, constraints):
            other, table = seen.setdefault(cell.key, (cell, picture.table))
            if other is not cell and table == picture.table:
                raise UserError(f'{file}: "{other.label}" and "{cell.label}" are the same cell; leave one out')
            sources.setdefault(cell.scene_version, picture.source)
            arrays.setdefault(cell.scene_version, picture.source.flat(picture.image.arithmetic)[1])
    cells = tuple(cell for cell, _ in seen.values())
    if not cells:
        raise NoCells("every cell is left out by where", file=file)
    if (asked := sum(cell.processes for cell in cells)) > PROCESSES:
        raise UserError(f"{len(cells)} cells are {asked} processes, {PROCESSES} at most", file=file)
    pair, reason = pair_of(cells, experiment.measure.pair)
    truths = Truths(cells, sources, experiment.reference)
    left_out = tuple(constraints.left_out.items())
    cold, peaks = experiment.measure.cold, experiment.measure.peaks
    shown = (source.scene for source in sources.values() if isinstance(source, Source))
    doubts = tuple(dict.fromkeys(text for scene in shown for text in warnings(scene)))
    return Plan(cells, arrays, pair, reason, left_out, truths, cold, peaks, doubts)


class Truths:
    """The truth jobs of all cells, worked out on first use: a plan can have many cells."""

    def __init__(self, cells: tuple[Cell, ...], sources: dict[str, Source], wanted: Reference | None):
        self.cells, self.sources, self.wanted = cells, sources, wanted
        self.depth, self.times = (wanted.depth, wanted.times) if wanted else (None, None)
        self.jobs: dict[str, dict] = {}  # by scene_version, then by view

    def of(self, cell: Cell) -> truth.Job:
        version = cell.scene_version
        if version not in self.jobs:
            shown = [other.parameters for other in self.cells if other.scene_version == version]
            self.jobs[version] = truth.jobs(shown, self.depth, self.times, self.sources[version].needs)
        return self.jobs[version][truth.view(cell.parameters, self.depth)]


@dataclass(frozen=True)
class _Picture:
    """A point of the sweep before it is said who renders it. table: the [[points]] table that it is from."""

    source: Source | Aimed | Stressed
    image: Image
    point: dict
    table: int

    def cells(self, experiment: Experiment, chosen: list[Entry], constraints: Constraints) -> Iterator[Cell]:
        for entry in chosen:
            override = experiment.override.get(entry.name)
            frames = experiment.frames if override is None or override.frames is None else override.frames
            threads = entry.threads() if self.image.threads == "default" else self.image.threads
            processes = (override and override.processes) or experiment.processes
            if experiment.where and not constraints.keep(self._names(entry, threads, frames, processes)):
                continue
            parameters = self.source.parameters(self.image, threads, frames, experiment.measure.least_frame)
            version, _ = self.source.flat(self.image.arithmetic)
            objects, lights = self.source.counts
            yield Cell(
                key=_key(entry, version, parameters),
                entry=entry,
                scene=self.source.name,
                scene_version=version,
                parameters=parameters,
                needs=self.source.needs(parameters),
                processes=processes,
                timeout=(override and override.timeout) or experiment.timeout,
                point=self.point,
                objects=objects,
                lights=lights,
                stressed=self.source if isinstance(self.source, Stressed) else None,
                limits=experiment.limits,
            )

    def _names(self, entry: Entry, threads: int, frames: int, processes: int) -> dict:
        """The values of where.NAMES."""
        objects, lights = self.source.counts
        image = self.image
        return {
            **image.model_dump(),
            "sampler": image.chosen_sampler(),
            "threads": threads,
            "renderer": entry.name,
            "scene": self.source.stem,
            "case": self.point.get("case", ""),
            "stress": self.point.get("stress", ""),
            "level": self.point.get("level"),
            "objects": objects,
            "lights": lights,
            "size": self.source.size,
            "side": image.width if image.width == image.height else None,
            "processes": processes,
            "frames": frames,
        }


def _pictures(experiment: Experiment, file: Path) -> Iterator[_Picture]:
    """Every point of every scene. UserError for a value that it cannot have."""
    if experiment.stress:
        yield from _stressed(experiment, file)
        return
    sources = Sources(experiment, file)
    asked = [(name, {}, {}) for name in (*experiment.scenes, *sources.made)]
    for case in experiment.case:
        asked.append((case.scene, {"case": case.name}, case.model_dump(exclude={"name", "scene"}, exclude_none=True)))
    points, image, keys = sweep.points(experiment), experiment.image.model_dump(), set(Image.model_fields)
    for name, case, own in asked:
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
            found = _image(chosen, file, [*where, *([f"sweep {swept}"] if swept else [])])
            yield _Picture(sources.aimed(source, found), found, point, table)
        if not seen:
            raise UserError(f"generate: no point is of {Path(name).stem}, which lacks a count of each", file=file)


def _stressed(experiment: Experiment, file: Path) -> Iterator[_Picture]:
    """Every level of every row, with every combination of its sweep and of the experiment's."""
    known, image, made = stress.rows(), experiment.image.model_dump(), {}
    for asked in experiment.stress:
        if asked.row not in known:
            raise UserError(f'stress: no row "{asked.row}"', file=file, remedy=f"known: {', '.join(known)}")
        row = known[asked.row]
        axes = [[(key, value) for value in values] for key, values in asked.sweep.items()]
        for (common, table), *own in itertools.product(sweep.points(experiment), *axes):
            swept = {**common, **dict(own)}
            for level in asked.levels or row.levels:
                precision = swept.get("precision", image["precision"])
                if precision not in ROUNDOFF:
                    why = f'stress: {row.name} has no precision "{precision}"'
                    raise UserError(why, file=file, remedy=f"known: {', '.join(ROUNDOFF)}")
                key = row.name, level, precision
                source = made.setdefault(key, Stressed(row, level, precision, experiment.seed))
                point = {"stress": row.name, "level": level, **swept}
                found = _image({**image, **source.trial.parameters, **swept}, file, [f"stress {point}"])
                yield _Picture(source, found, point, table)


def _image(chosen: dict, file: Path, where: list[str]) -> Image:
    try:
        return Image.model_validate(chosen).scaled()
    except ValidationError as error:
        why = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise UserError(f"{file}: {', '.join(where)}: {why}") from None


def pair_of(cells: tuple[Cell, ...], wanted: str) -> tuple[Cell | None, str]:
    """The cell with the most work of the first variant that can have one run twice, or why there is none."""
    if wanted == "off":
        return None, 'measure.pair is "off"'
    variants = dict.fromkeys(cell.entry.name for cell in cells)
    order = dict.fromkeys([*(name for name in PAIRED if name in variants), *variants])
    reason = f"no cell {'here' if wanted == 'auto' else f'of {wanted}'} that runs, is no exhibit and is not simulated"
    for name in order if wanted == "auto" else [wanted]:
        able = _comparable([cell for cell in cells if cell.entry.name == name])
        many = [cell for cell in able if cell.processes >= LEAST]
        if many:
            return max(many, key=lambda cell: cell.work), ""
        if able:
            reason = f"its noise floor needs {LEAST} processes"
    return None, reason


def _comparable(cells: list[Cell]) -> list[Cell]:
    """Returns the cells of one variant that run here and may be compared."""
    if not cells:
        return []
    entry = cells[0].entry
    if entry.variant.exhibit or entry.simulated or entry.unavailable:
        return []
    return [cell for cell in cells if unsupported(entry, cell.parameters, cell.needs) is None]


def _key(entry: Entry, scene_version: str, parameters: Parameters) -> str:
    text = repr((entry.name, entry.renderer.version, scene_version, parameters))
    return hashlib.sha256(text.encode()).hexdigest()[:12]
