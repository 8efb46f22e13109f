"""What a smaller model changes in a picture, and whether its error grows: of `rayrace needs` and of reports."""

from dataclasses import dataclass

import numpy as np

SEEN = 1e-9  # of a channel, linear RGB: less is a difference that float64 renderers may have
SURE = 2  # standard errors that a change of the error must exceed


@dataclass(frozen=True)
class Change:
    """How a reduced picture differs from the full one.

    pixels: share of them with a channel that differs by more than SEEN. largest: of the differences, linear RGB.
    added: by how much its mean squared error, from the truth of the full scene, exceeds that of the full picture, and
    doubt: the standard error of that.
    """

    pixels: float
    largest: float
    added: float
    doubt: float

    def verdict(self, proof: str) -> str:
        """Whether the picture needs what was left out: what was proved is told apart from what was measured."""
        if proof:
            return f"needs none of it (proved): {proof}"
        if self.pixels == 0:
            return "changes no pixel (measured)"
        if abs(self.added) <= SURE * self.doubt:
            return "error: not resolved"
        return "error grows" if self.added > 0 else "error shrinks"


def between(
    reduced: np.ndarray, full: np.ndarray, truth: np.ndarray, noise: np.ndarray | None, lacking: float
) -> Change:
    """The Change from a full picture to a reduced one, both (height, width, 3).

    noise: standard error of the truth, likewise; None: it has none. lacking: RMS of what the truth may lack. With a
    truth t + n, (r - t - n)^2 - (f - t - n)^2 has the noise 2 n (f - r) alone: that of both squares cancels. What it
    lacks, c, adds at most 2 c times the RMS of f - r (Cauchy and Schwarz).
    """
    apart = np.abs(reduced - full)
    added = float(np.mean((reduced - truth) ** 2 - (full - truth) ** 2))
    doubt = 0.0 if noise is None else 2 * np.sqrt(np.sum((apart * noise) ** 2)) / apart.size
    doubt = float(np.hypot(doubt, 2 * lacking * np.sqrt(np.mean(apart**2))))
    return Change(float(np.mean(apart.max(axis=-1) > SEEN)), float(apart.max()), added, doubt)
