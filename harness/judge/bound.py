"""Proven bound of the error that a cut-off can make, without a picture to compare with (CUT-3)."""

import numpy as np

from harness.judge.judge import LARGEST

# Columns of materials.npy, and of lights.npy.
DIFFUSE, K_S, ATTENUATION, COLOUR = slice(0, 3), slice(3, 4), slice(5, 8), slice(3, 6)


def radiance(arrays: dict[str, np.ndarray], depth: int) -> np.ndarray:
    """L_1 of CUT-3, shape (3,), linear RGB: no ray below an eye ray is brighter. arrays: the flattened scene."""
    background, local, k_s = _background(arrays), _local(arrays), arrays["materials"][:, K_S]
    most = np.zeros(3)
    for _ in range(depth):  # the last order first: its rays have no children
        most = np.maximum(background, (local + k_s * most).max(axis=0, initial=0.0)).clip(max=LARGEST)
    return most


def brightest(arrays: dict[str, np.ndarray]) -> float:
    """The largest channel, linear RGB, of the background and of the light of any one hit (ℓ of CUT-3)."""
    return float(max(_background(arrays).max(), _local(arrays).max(initial=0.0)))


def _background(arrays: dict[str, np.ndarray]) -> np.ndarray:
    return np.asarray(arrays["background"], dtype=np.float64).reshape(3)


def _local(arrays: dict[str, np.ndarray]) -> np.ndarray:
    """ℓ of each material, shape (M, 3)."""
    diffuse, k_s = arrays["materials"][:, DIFFUSE], arrays["materials"][:, K_S]
    lights = arrays["lights"][:, COLOUR].sum(axis=0)
    return diffuse * np.asarray(arrays["ambient"]).reshape(3) + (diffuse + k_s) * lights


def bound(arrays: dict[str, np.ndarray], depth: int, dropped: np.ndarray) -> np.ndarray:
    """The largest error of any channel of each pixel, shape (height, width); dropped: weights of CUT-2, likewise."""
    return float(radiance(arrays, depth).max()) * dropped
