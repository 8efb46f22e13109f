"""A row of the catalogue at one level of stress, as the parts of a cell: a scene, its needs, a judge."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from harness.renderer.job import count_shapes, fingerprint
from harness.renderer.parameters import Parameters
from harness.scene.flatten import flatten
from harness.scene.needs import needs, shapes
from harness.stress.row import ROUNDOFF, Row, Trial


class Stressed:
    """Stands in the place of a source.Source. seed: of the row's random numbers."""

    size = None

    def __init__(self, row: Row, level: float, precision: str, seed: int):
        self.row, self.level, self.precision, self.seed = row, level, precision, seed
        self.stem, self.name = row.name, f"stress/{row.name}.txt"
        self._flat: dict[str, tuple[str, dict[str, np.ndarray]]] = {}

    @cached_property
    def trial(self) -> Trial:
        """The seed, the row and the level choose the numbers, so that a level is the same in any list of levels."""
        key = [self.seed, *self.row.name.encode(), *np.array([self.level]).view(np.uint32).tolist()]
        return self.row.make(self.level, self.precision, np.random.default_rng(key))

    @cached_property
    def counts(self) -> tuple[int, int]:
        _, arrays = self.flat("linear")
        return sum(count_shapes(arrays).values()), len(arrays["lights"])

    def flat(self, arithmetic: str) -> tuple[str, dict[str, np.ndarray]]:
        """The hash of its arrays, and the arrays, its rays among them."""
        if arithmetic not in self._flat:
            arrays = flatten(self.trial.scene, arithmetic)
            if self.trial.rays is not None:
                arrays = {**arrays, "rays": np.ascontiguousarray(self.trial.rays, dtype=np.float64)}
            self._flat[arithmetic] = fingerprint(arrays), arrays
        return self._flat[arithmetic]

    def parameters(self, image, threads: int, frames: int, least_frame: float = 0.0) -> Parameters:
        """Returns the parameters of the job; `image` has the trial's parameters and the method."""
        made = image.parameters(threads, frames, least_frame)
        return made if self.trial.rays is None else replace(made, kind="rays", depth=0)

    def needs(self, parameters: Parameters) -> tuple[str, ...]:
        if self.trial.rays is None:
            return needs(self.trial.scene, parameters)
        return tuple(sorted(shapes(self.trial.scene)))

    def record(self, result, parameters: Parameters) -> dict:
        """`stability` of a record (store.py): what a picture or list of hits is worth."""
        told, u = parameters.values(), ROUNDOFF[parameters.precision]
        return {
            "row": self.row.name,
            "level": self.level,
            **self.trial.judge(result).record(),
            "expected": self.row.expected(self.level, u, told),
            "limit": self.row.limit(u, told),
        }
