"""Resamples pictures in blocks of pixels, since the errors of neighbouring pixels are correlated."""

import numpy as np

from harness.statistics.statistics import LEVEL

RESAMPLES = 999
SIDE = 8  # most pixels of a block's side
LEAST = 16  # blocks for an interval


class Blocks:
    """The blocks of a picture of height x width pixels.

    of: (height, width), the block number of each pixel. count: of blocks. weights: (RESAMPLES, blocks), how often each
    resample contains a block; None if there are fewer than LEAST blocks.
    """

    def __init__(self, height: int, width: int, seed: int = 1):
        side = int(np.clip(min(height, width) // 8, 1, SIDE))
        columns = -(-width // side)
        rows = np.arange(height)[:, None] // side
        self.of = rows * columns + np.arange(width) // side
        self.count = int(self.of[-1, -1]) + 1
        self.weights = None
        if self.count >= LEAST:
            rng = np.random.default_rng(seed)
            self.weights = rng.multinomial(self.count, np.full(self.count, 1 / self.count), size=RESAMPLES)

    def sums(self, values: np.ndarray) -> np.ndarray:
        """Returns the sum of `values` (height, width) in each block, (blocks,)."""
        return np.bincount(self.of.ravel(), weights=values.ravel(), minlength=self.count)

    def means(self, values: np.ndarray) -> np.ndarray:
        """Returns the mean of `values` (height, width) in each resample, (RESAMPLES,)."""
        return (self.weights @ self.sums(values)) / (self.weights @ self.sums(np.ones(self.of.shape)))

    def medians(self, values: np.ndarray, some: np.ndarray) -> np.ndarray:
        """Returns the median of `values` (height, width) where `some`, in each resample; NaN where it has none."""
        block, selected = self.of[some], values[some]
        order = np.argsort(selected)
        block, selected = block[order], selected[order]
        medians = np.full(len(self.weights), np.nan)
        for number, weights in enumerate(self.weights):
            up_to = np.cumsum(weights[block])
            if len(up_to) and up_to[-1]:
                medians[number] = selected[np.searchsorted(up_to, up_to[-1] / 2)]
        return medians


def ends(values: np.ndarray) -> tuple[float, float]:
    """Returns the 95 % interval (percentile) of a number of each resample."""
    low, high = np.nanpercentile(values, [50 * (1 - LEVEL), 50 * (1 + LEVEL)])
    return float(low), float(high)
