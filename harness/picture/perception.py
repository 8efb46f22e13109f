"""Computes the perceptual difference of two pictures as a display shows them: PSNR, SSIM and FLIP.

A display shows sRGB, clipped to 0..1. Judge the pictures first (judge.py): they must be finite and of one shape, as
FLIP hides NaN.
"""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from harness.picture import colour

WINDOW, SIGMA = 11, 1.5  # pixels: SSIM's window, a Gaussian (Wang et al., IEEE TIP 13(4), 2004)
C1, C2 = 0.01**2, 0.03**2  # SSIM's constants for data of range 1


@dataclass(frozen=True)
class Perception:
    """Differences, each a number or {"unavailable": reason}.

    psnr_db: for data of range 1. ssim: mean structural similarity, 1 for equal pictures. flip: mean of flip_map, for a
    viewer 0.7 m from a display 0.7 m and 3840 pixels wide, 67 pixels a degree (Andersson et al., HPG 2020). flip_map:
    (height, width) float32, from 0 (invisible) to 1.
    """

    psnr_db: float | dict
    ssim: float | dict
    flip: float
    flip_map: np.ndarray

    def record(self) -> dict:
        return {"psnr_db": self.psnr_db, "ssim": self.ssim, "flip": self.flip}


def perceive(picture: np.ndarray, reference: np.ndarray, arithmetic: str = "linear") -> Perception:
    """Compares a judged `picture` (height, width, 3) with its reference. arithmetic: srgb if both are sRGB."""
    import flip_evaluator

    shown, right = (_shown(each, arithmetic) for each in (picture, reference))
    if np.array_equal(shown, right):
        psnr = {"unavailable": "infinite: the display shows no difference"}
    else:
        psnr = float(-10 * np.log10(np.mean((right - shown) ** 2)))
    ssim = {"unavailable": f"the picture is smaller than its window of {WINDOW} x {WINDOW} pixels"}
    if min(shown.shape[:2]) >= WINDOW:
        ssim = _ssim(right, shown)
    seen, mean, _ = flip_evaluator.evaluate(right.astype(np.float32), shown.astype(np.float32), "LDR", applyMagma=False)
    return Perception(psnr, ssim, float(mean), seen[..., 0])


def _ssim(a: np.ndarray, b: np.ndarray) -> float:
    """Mean structural similarity over the channels and all windows inside the picture (Wang et al., equation 13)."""
    weights = np.exp(-((np.arange(WINDOW) - WINDOW // 2) ** 2) / (2 * SIGMA**2))
    weights /= weights.sum()

    def blur(values: np.ndarray) -> np.ndarray:
        for axis in (0, 1):
            values = sliding_window_view(values, WINDOW, axis) @ weights
        return values

    mean_a, mean_b = blur(a), blur(b)
    squares = mean_a**2 + mean_b**2
    variances = blur(a * a) + blur(b * b) - squares
    product = mean_a * mean_b
    covariance = blur(a * b) - product
    return float(np.mean((2 * product + C1) * (2 * covariance + C2) / ((squares + C1) * (variances + C2))))


def _shown(picture: np.ndarray, arithmetic: str) -> np.ndarray:
    codes = colour.encode(picture) if arithmetic == "linear" else np.asarray(picture, np.float64)
    return np.clip(codes, 0.0, 1.0)
