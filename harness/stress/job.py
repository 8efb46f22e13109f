"""A row of the catalogue at one level of stress, as the source of cells: a scene, its needs, and a judge."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from harness.renderer.parameters import Parameters
from harness.scene.needs import FAR_FLOAT32, shapes
from harness.scene.source import Source
from harness.stress.row import ROUNDOFF, Row, Trial


class Stressed(Source):
    """The source of a row's cells at one level. precision: float32 or float64; seed: of the row's random numbers."""

    def __init__(self, row: Row, level: float, precision: str, seed: int):
        super().__init__(f"stress/{row.name}.txt", lambda: self.trial.scene)
        self.row, self.level, self.precision, self.seed = row, level, precision, seed

    @cached_property
    def trial(self) -> Trial:
        """Seed, row and level choose the random numbers, so a level is the same in any list of levels."""
        key = [self.seed, *self.row.name.encode(), *np.array([self.level]).view(np.uint32).tolist()]
        return self.row.make(self.level, self.precision, np.random.default_rng(key))

    def arrays(self, arithmetic: str) -> dict[str, np.ndarray]:
        arrays = super().arrays(arithmetic)
        if self.trial.rays is not None:
            arrays["rays"] = np.ascontiguousarray(self.trial.rays, dtype=np.float64)
        return arrays

    def parameters(self, image, threads: int, frames: int, least_frame: float = 0.0) -> Parameters:
        """The parameters of the job. image: an Image with the trial's parameters and the method."""
        made = super().parameters(image, threads, frames, least_frame)
        return made if self.trial.rays is None else replace(made, kind="rays", depth=0)

    def needs(self, parameters: Parameters) -> tuple[str, ...]:
        if self.trial.rays is not None:
            return tuple(sorted(shapes(self.scene)))
        # What lies far away is what is put to the test.
        return tuple(name for name in super().needs(parameters) if name != FAR_FLOAT32)

    def record(self, result, parameters: Parameters) -> dict:
        """The verdict on a result as `stability` of a record (store.py)."""
        methods, u = parameters.values(), ROUNDOFF[parameters.precision]
        return {
            "row": self.row.name,
            "level": self.level,
            **self.trial.judge(result).record(),
            "expected": self.row.expected(self.level, u, methods),
            "limit": self.row.limit(u, methods),
        }
