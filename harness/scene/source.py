"""A scene of an experiment, with the results that many cells share, each computed once."""

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from harness.renderer.job import count_shapes, fingerprint
from harness.renderer.parameters import Parameters
from harness.scene.flatten import flatten
from harness.scene.model import Scene
from harness.scene.needs import needs

# The parameters that needs() reads.
ASKED = ("depth", "shadows", "sampler", "lens_radius", "feelers", "glossy_rays", "cutoff", "precision")


class Source:
    """A scene. name: what cells call it. read: returns the Scene; called on first use. size: count of that name of a
    generated scene, or None. counts: (objects that a ray is tried against, lights), if known without reading.
    """

    def __init__(self, name: str, read: Callable[[], Scene], counts: tuple[int, int] | None = None, size=None):
        self.name, self.stem = name, Path(name).stem
        self.read, self.size = read, size
        self._flat: dict[str, tuple[str, dict[str, np.ndarray]]] = {}
        self._needs: dict[tuple, tuple[str, ...]] = {}
        if counts:
            self.counts = counts

    @cached_property
    def scene(self) -> Scene:
        return self.read()

    @cached_property
    def counts(self) -> tuple[int, int]:
        _, arrays = self.flat("linear")
        return sum(count_shapes(arrays).values()), len(arrays["lights"])

    def arrays(self, arithmetic: str) -> dict[str, np.ndarray]:
        """The arrays of a job by name (renderers/README.md). arithmetic: linear or srgb, as flatten() takes it."""
        return flatten(self.scene, arithmetic)

    def flat(self, arithmetic: str) -> tuple[str, dict[str, np.ndarray]]:
        """The hash of `arrays`, and the arrays."""
        if arithmetic not in self._flat:
            arrays = self.arrays(arithmetic)
            self._flat[arithmetic] = fingerprint(arrays), arrays
        return self._flat[arithmetic]

    def parameters(self, image, threads: int, frames: int, least_frame: float = 0.0) -> Parameters:
        """The parameters of a job. image: an experiment's Image; least_frame: s."""
        return image.parameters(threads, frames, least_frame)

    def needs(self, parameters: Parameters) -> tuple[str, ...]:
        """The features that a job with these parameters needs, sorted."""
        values = {name: getattr(parameters, name) for name in ASKED}
        key = tuple(values.values())
        if key not in self._needs:
            self._needs[key] = needs(self.scene, SimpleNamespace(**values))
        return self._needs[key]
