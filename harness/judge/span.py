"""Judges ill-conditioned pixels: by how many of them leave what perturbed references span."""

import numpy as np

THRESHOLD = 0.1 / 255  # linear RGB, the least change of a colour that counts as one
WIDENED = 0.5  # by so much of its own width a span grows on either side
ALARM = 1e-9  # probability at most that a right picture is rejected for its ill-conditioned pixels


def leaves(pixels: np.ndarray, span: np.ndarray, tolerance: float | np.ndarray) -> np.ndarray:
    """Which of `pixels` (M, 3) have a channel beyond `span` (2, M, 3), its lowest and highest values: booleans (M,).

    The span is widened on either side by `tolerance`, a number or (M,), but at least THRESHOLD, and by WIDENED of its
    width.
    """
    return ~(excess(pixels, span, tolerance) <= 0)


def excess(pixels: np.ndarray, span: np.ndarray, tolerance: float | np.ndarray) -> np.ndarray:
    """By how much `pixels` (M, 3) leave their widened spans in their worst channel, (M,): not above 0 within."""
    low, high = span
    wider = np.maximum(tolerance, THRESHOLD).reshape(-1, 1) + WIDENED * (high - low)
    return np.maximum(low - wider - pixels, pixels - high - wider).max(axis=-1)


def most(count: int, left: tuple[int, ...]) -> int:
    """The largest number of `count` ill-conditioned pixels that may leave their spans in a right picture.

    left: how many leave them in each of the further references. The model: a right picture is one more of these, and
    pixels leave apart from each other. Each that leaves is then as likely the picture's as any one reference's, and how
    many of them are the picture's is binomial; a number is too large if it, or more, has a probability below ALARM.
    Each reference counts as the one in which most leave, since neighbours do not quite leave apart from each other.
    """
    others, worst = len(left), max(left)
    k = np.arange(1, count + 2 * worst + 100)  # the sum below goes on to where nothing is left
    # P(X < k) of X out of others * worst + k, each with probability p = 1 / (others + 1), is the sum over i < k of
    # C(others * worst + i, i) p^i (1 - p)^(others * worst + 1). Its terms, up to a factor:
    logarithms = np.cumsum(np.log((others * worst + k) / (k * (others + 1))), dtype=float)
    terms = np.exp(np.append(0.0, logarithms) - max(0.0, logarithms.max()))
    from_k = np.cumsum(terms[::-1])[::-1]
    return int(np.count_nonzero(from_k[1 : count + 1] >= ALARM * from_k[0]))
