"""The plan: an experiment as cells, and the order in which their repetitions run."""

import hashlib
import itertools
import json
import random
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from harness import registry
from harness.errors import UserError
from harness.experiment import Experiment, Image
from harness.job import Parameters, fingerprint
from harness.registry import Entry
from harness.scene import load
from harness.scene.flatten import flatten
from harness.scene.needs import needs


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

    @property
    def label(self) -> str:
        """For people and file names: variant, scene, swept values."""
        swept = [f"{key} {value}" for key, value in self.point.items()]
        return ", ".join([self.entry.name, Path(self.scene).stem, *swept])


@dataclass(frozen=True)
class Plan:
    cells: tuple[Cell, ...]
    arrays: dict[str, dict]  # flattened scenes by scene_version

    def order(self, seed: int) -> list[tuple[Cell, int]]:
        """(cell, repetition) pairs: every cell once, in a shuffled order, then every cell again.

        Drift of the machine then meets all cells alike, and a run that is cut off is a thin study of everything.
        """
        rng = random.Random(seed)
        rounds = []
        for repetition in range(max((cell.processes for cell in self.cells), default=0)):
            due = [cell for cell in self.cells if repetition < cell.processes]
            rng.shuffle(due)
            rounds += [(cell, repetition) for cell in due]
        return rounds


def points(experiment: Experiment) -> list[dict]:
    """The swept values of every point, in the order of the file."""
    if isinstance(experiment.sweep, dict):
        axes = [[{key: value} for value in values] for key, values in experiment.sweep.items()]
    else:
        axes = [
            [dict(zip(table, values, strict=True)) for values in zip(*table.values(), strict=True)]
            for table in experiment.sweep
        ]
    return [{k: v for part in parts for k, v in part.items()} for parts in itertools.product(*axes)]


def make(experiment: Experiment, file: Path, known: dict[str, Entry], only: tuple[str, ...] = ()) -> Plan:
    """The plan of an experiment read from `file`. UserError for an unknown renderer, a faulty scene or swept value."""
    chosen = [registry.find(name, known, file) for name in experiment.renderers]
    for name in only:
        if name not in experiment.renderers:
            raise UserError(f"--only {name}: not among the experiment's renderers: {', '.join(experiment.renderers)}")
    chosen = [entry for entry in chosen if not only or entry.name in only]
    pictures = [(name, {}, {}) for name in experiment.scenes]
    for case in experiment.case:
        own = case.model_dump(exclude={"name", "scene"}, exclude_none=True)
        pictures.append((case.scene, {"case": case.name}, own))
    scenes = {name: load(file.parent / name) for name, _, _ in pictures}
    arrays, flat, cells = {}, {}, []
    for (name, case, own), swept, entry in itertools.product(pictures, points(experiment), chosen):
        point = {**case, **swept}
        try:
            image = Image.model_validate({**experiment.image.model_dump(), **own, **swept})
        except ValidationError as error:
            why = error.errors()[0]["msg"].removeprefix("Value error, ")
            where = [f'case "{case["case"]}"'] if case else []
            raise UserError(f"{file}: {', '.join([*where, *([f'sweep {swept}'] if swept else [])])}: {why}") from None
        version = flat.get((name, image.arithmetic))
        if version is None:
            flattened = flatten(scenes[name], image.arithmetic)
            version = flat[name, image.arithmetic] = fingerprint(flattened)
            arrays[version] = flattened
        override = experiment.override.get(entry.name)
        frames = experiment.frames if override is None or override.frames is None else override.frames
        threads = entry.threads() if image.threads == "default" else image.threads
        parameters = image.parameters(threads, frames)
        content = fingerprint(arrays[version], parameters)
        cells.append(
            Cell(
                key=_key(entry, content),
                entry=entry,
                scene=name,
                scene_version=version,
                parameters=parameters,
                needs=needs(scenes[name], parameters),
                processes=(override and override.processes) or experiment.processes,
                timeout=(override and override.timeout) or experiment.timeout,
                point=point,
            )
        )
    seen = {}
    for cell in cells:
        other = seen.setdefault(cell.key, cell)
        if other is not cell:
            raise UserError(f'{file}: "{other.label}" and "{cell.label}" are the same cell; leave one out')
    return Plan(tuple(cells), arrays)


def _key(entry: Entry, content: str) -> str:
    text = json.dumps([entry.name, entry.renderer.version, content])
    return hashlib.sha256(text.encode()).hexdigest()[:12]
