"""The scenes of an experiment, each with what many cells ask of it and is worked out once."""

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from pydantic import ValidationError

from harness.errors import UserError
from harness.experiment import Experiment, Generate
from harness.job import Parameters, count_shapes, fingerprint
from harness.scene import load
from harness.scene.flatten import flatten
from harness.scene.generated import generated
from harness.scene.model import Scene
from harness.scene.needs import needs

# The parameters that needs() reads.
ASKED = ("depth", "shadows", "sampler", "lens_radius", "feelers", "glossy_rays", "cutoff")


class Source:
    """A scene. name: what cells call it. asked: the counts it is generated for; they may tell `counts` unread."""

    def __init__(self, name: str, read: Callable[[], Scene], asked: dict[str, int] | None = None):
        self.name, self.stem = name, Path(name).stem
        self.read, self.size = read, (asked or {}).get("size")
        self._flat: dict[str, tuple[str, dict]] = {}
        self._needs: dict[tuple, tuple[str, ...]] = {}
        if asked and "objects" in asked:
            self.counts = asked["objects"], asked["lights"]

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

    def needs(self, parameters: Parameters) -> tuple[str, ...]:
        asked = {name: getattr(parameters, name) for name in ASKED}
        key = tuple(asked.values())
        if key not in self._needs:
            self._needs[key] = needs(self.scene, SimpleNamespace(**asked))
        return self._needs[key]


class Sources:
    """The scenes of an experiment read from `file`, its generated one for every value of its counts."""

    def __init__(self, experiment: Experiment, file: Path):
        self.generate, self.file = experiment.generate, file
        self.counts = self.generate.counts() if self.generate else {}
        names = [*experiment.scenes, *(case.scene for case in experiment.case)]
        self.known = {name: Source(name, lambda source=load(file.parent / name): source) for name in names}
        if self.generate:
            swept = {key for table in _tables(experiment) for key in table}
            fixed = self.generate.model_dump(exclude={"scene", *swept}, exclude_none=True)
            words = [self.generate.scene, *(f"{key}-{value}" for key, value in fixed.items())]
            self.name = f"generated/{'-'.join(words)}.txt"

    def find(self, name: str | None, point: dict) -> Source:
        """The scene called so, or, without a name, the one generated for a point."""
        if name is not None:
            return self.known[name]
        counts = {key: point.get(key, value) for key, value in self.counts.items()}
        key = repr(counts)
        if key not in self.known:
            self.known[key] = self._generated(counts)
        return self.known[key]

    def _generated(self, counts: dict) -> Source:
        try:
            Generate.model_validate({"scene": self.generate.scene, **counts})
        except ValidationError as error:
            fault = error.errors()[0]
            raise UserError(f"{self.file}: sweep.{fault['loc'][-1]}: {fault['msg']}") from None

        def read():
            try:
                return generated(self.generate.scene, **counts)
            except UserError as error:
                raise UserError(f"{self.file}: generate: {error}") from None

        return Source(self.name, read, counts)


def _tables(experiment: Experiment) -> list[dict]:
    sweep = [experiment.sweep] if isinstance(experiment.sweep, dict) else experiment.sweep
    return [*sweep, *experiment.points]
