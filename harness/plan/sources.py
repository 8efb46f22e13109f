"""Finds and generates the scenes of an experiment, each once."""

from pathlib import Path

from pydantic import ValidationError

from harness.errors import UserError
from harness.experiment.experiment import Experiment, Generate
from harness.experiment.image import Image
from harness.judge.hits import Aimed
from harness.reduction.leave_out import LeaveOut
from harness.reduction.reduced import Reduced
from harness.scene import load
from harness.scene.generate.generated import COUNTS, count, generated
from harness.scene.source import Source

COUNTED = {key for counts in COUNTS.values() for key in counts}  # names of counts of any generated scene
OBJECTS = 10**7  # of a generated scene, at most


class Sources:
    """The scenes of an experiment that was read from `file`. made: the generated scenes by the names that cells use."""

    def __init__(self, experiment: Experiment, file: Path):
        self.file = file
        names = [*experiment.scenes, *(case.scene for case in experiment.case)]
        self.sources = {name: Source(name, lambda source=load(file.parent / name): source) for name in names}
        swept = {key for table in _tables(experiment) for key in table}
        self.made = {_name(made, swept): made for made in experiment.made()}

    def counts(self, name: str) -> dict[str, int]:
        """The counts of the generated scene of this name before any sweep; {} for a scene from a file."""
        return self.made[name].counts() if name in self.made else {}

    def find(self, name: str, point: dict) -> Source | None:
        """The scene of this name, a generated one for the counts of a point of the sweep.

        None if the point sweeps a count that this scene does not have. UserError for a count out of range.
        """
        counts = self.counts(name)
        if any(key in point for key in COUNTED - set(counts)):
            return None
        if name not in self.made:
            return self.sources[name]
        counts = {key: point.get(key, value) for key, value in counts.items()}
        key = repr((name, counts))
        if key not in self.sources:
            self.sources[key] = self._generated(name, self.made[name].scene, counts)
        return self.sources[key]

    def aimed(self, source: Source, image: Image) -> Source | Aimed:
        """The source itself for a picture, or with image.rays rays for first hits."""
        if not image.rays:
            return source
        key = f"{id(source)}, {image.rays} rays, seed {image.seed}"
        return self.sources.setdefault(key, Aimed(source, image.rays, image.seed))

    def without(self, source: Source, left_out: LeaveOut) -> Reduced:
        """The source with one thing left out; what has one name is the same at every point of a sweep."""
        return self.sources.setdefault(f"{id(source)} without {left_out.name}", Reduced(source, left_out))

    def _generated(self, name: str, scene: str, counts: dict) -> Source:
        try:
            Generate.model_validate({"scene": scene, **counts})
        except ValidationError as error:
            fault = error.errors()[0]
            place = ".".join(map(str, ("sweep", *fault["loc"][-1:])))
            raise UserError(f"{self.file}: {place}: {fault['msg'].removeprefix('Value error, ')}") from None

        objects, lights = count(scene, **counts)

        def read():
            if objects > OBJECTS:
                why = f"{name} has {objects} objects, {OBJECTS} at most"
                raise UserError(why, file=self.file, remedy="leave it out with where")
            try:
                return generated(scene, **counts)
            except UserError as error:
                raise UserError(f"{self.file}: generate: {error}") from None

        return Source(name, read, (objects, lights), counts.get("size"))


def _name(made: Generate, swept: set[str]) -> str:
    """The name of a generated scene: its counts, except those that are swept."""
    fixed = made.model_dump(exclude={"scene", *swept}, exclude_none=True)
    return f"generated/{'-'.join([made.scene, *(f'{key}-{value}' for key, value in fixed.items())])}.txt"


def _tables(experiment: Experiment) -> list[dict]:
    sweep = [experiment.sweep] if isinstance(experiment.sweep, dict) else experiment.sweep
    return [*sweep, *experiment.points]
