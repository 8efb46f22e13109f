"""The scenes of an experiment, each with the results that many cells share, computed once."""

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from pydantic import ValidationError

from harness.errors import UserError
from harness.experiment.experiment import Experiment, Generate
from harness.experiment.image import Image
from harness.judge.hits import Aimed
from harness.renderer.job import count_shapes, fingerprint
from harness.renderer.parameters import Parameters
from harness.scene import load
from harness.scene.flatten import flatten
from harness.scene.generate.generated import COUNTS, count, generated
from harness.scene.model import Scene
from harness.scene.needs import needs

# The parameters that needs() reads.
ASKED = ("depth", "shadows", "sampler", "lens_radius", "feelers", "glossy_rays", "cutoff")

COUNTED = {key for counts in COUNTS.values() for key in counts}  # what is a count of some generated scene
OBJECTS = 10**7  # of a generated scene


class Source:
    """A scene. name: what cells call it. counts: objects that a ray is tried against, and lights, if they are known
    unread. size: the count of that name of a generated scene.
    """

    def __init__(self, name: str, read: Callable[[], Scene], counts: tuple[int, int] | None = None, size=None):
        self.name, self.stem = name, Path(name).stem
        self.read, self.size = read, size
        self._flat: dict[str, tuple[str, dict]] = {}
        self._needs: dict[tuple, tuple[str, ...]] = {}
        if counts:
            self.counts = counts

    @cached_property
    def scene(self) -> Scene:
        return self.read()

    @cached_property
    def counts(self) -> tuple[int, int]:
        """Objects that a ray is tried against, and lights."""
        _, arrays = self.flat("linear")
        return sum(count_shapes(arrays).values()), len(arrays["lights"])

    def flat(self, arithmetic: str) -> tuple[str, dict[str, np.ndarray]]:
        """The hash of its arrays, and the arrays."""
        if arithmetic not in self._flat:
            arrays = flatten(self.scene, arithmetic)
            self._flat[arithmetic] = fingerprint(arrays), arrays
        return self._flat[arithmetic]

    def parameters(self, image: Image, threads: int, frames: int, least_frame: float = 0.0) -> Parameters:
        return image.parameters(threads, frames, least_frame)

    def needs(self, parameters: Parameters) -> tuple[str, ...]:
        asked = {name: getattr(parameters, name) for name in ASKED}
        key = tuple(asked.values())
        if key not in self._needs:
            self._needs[key] = needs(self.scene, SimpleNamespace(**asked))
        return self._needs[key]


class Sources:
    """The scenes of an experiment read from `file`, each generated one for every value of its counts.

    made: the generated ones by what cells call them.
    """

    def __init__(self, experiment: Experiment, file: Path):
        self.file = file
        names = [*experiment.scenes, *(case.scene for case in experiment.case)]
        self.known = {name: Source(name, lambda source=load(file.parent / name): source) for name in names}
        swept = {key for table in _tables(experiment) for key in table}
        self.made = {_name(made, swept): made for made in experiment.made()}

    def counts(self, name: str) -> dict[str, int]:
        """Returns the counts of a generated scene of this name, without swept values."""
        return self.made[name].counts() if name in self.made else {}

    def find(self, name: str, point: dict) -> Source | None:
        """The scene called so; of a generated one, the one for a point, or None if the point is not of that scene."""
        if name not in self.made:
            return self.known[name]
        scene, counts = self.made[name].scene, self.counts(name)
        if any(key in point for key in COUNTED - set(counts)):
            return None
        counts = {key: point.get(key, value) for key, value in counts.items()}
        key = repr((name, counts))
        if key not in self.known:
            self.known[key] = self._generated(name, scene, counts)
        return self.known[key]

    def aimed(self, source: Source, image: Image) -> Source | Aimed:
        """Returns the source for a point of the sweep: a picture of a scene, or first hits of rays."""
        if not image.rays:
            return source
        key = f"{id(source)}, {image.rays} rays, seed {image.seed}"
        return self.known.setdefault(key, Aimed(source, image.rays, image.seed))

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
                why = f"{name} is of {objects} objects, {OBJECTS} at most"
                raise UserError(why, file=self.file, remedy="leave it out with where")
            try:
                return generated(scene, **counts)
            except UserError as error:
                raise UserError(f"{self.file}: generate: {error}") from None

        return Source(name, read, (objects, lights), counts.get("size"))


def _name(made: Generate, swept: set[str]) -> str:
    """Names a generated scene by its counts, except those that are swept."""
    fixed = made.model_dump(exclude={"scene", *swept}, exclude_none=True)
    return f"generated/{'-'.join([made.scene, *(f'{key}-{value}' for key, value in fixed.items())])}.txt"


def _tables(experiment: Experiment) -> list[dict]:
    sweep = [experiment.sweep] if isinstance(experiment.sweep, dict) else experiment.sweep
    return [*sweep, *experiment.points]
