"""Proven bound of the error that a cut-off can make, without a picture to compare with (CUT-3)."""

import numpy as np

from harness.judge.judge import LARGEST

K_S = 3  # column of materials.npy


def radiance(arrays: dict[str, np.ndarray], depth: int) -> np.ndarray:
    """L_1 of CUT-3, shape (3,), linear RGB: no ray below an eye ray is brighter. arrays: the flattened scene."""
    materials, lights = arrays["materials"], arrays["lights"]
    background = np.asarray(arrays["background"], dtype=np.float64).reshape(3)
    diffuse, k_s = materials[:, :3], materials[:, K_S : K_S + 1]
    local = diffuse * np.asarray(arrays["ambient"]).reshape(3) + (diffuse + k_s) * lights[:, 3:6].sum(axis=0)
    brightest = np.zeros(3)
    for _ in range(depth):  # the last order first: its rays have no children
        brightest = np.maximum(background, (local + k_s * brightest).max(axis=0, initial=0.0)).clip(max=LARGEST)
    return brightest


def bound(arrays: dict[str, np.ndarray], depth: int, dropped: np.ndarray) -> np.ndarray:
    """The largest error of any channel of each pixel, shape (height, width); dropped: weights of CUT-2, likewise."""
    return float(radiance(arrays, depth).max()) * dropped
