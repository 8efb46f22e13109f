"""How much of a difference is seen: PSNR, SSIM and FLIP of what a display shows of two pictures.

A display shows sRGB, clipped to 0..1. The pictures must have been judged before (judge.py): all finite, of one shape;
FLIP makes a small number of a NaN.
"""

from dataclasses import dataclass

import numpy as np

from harness import colour

WINDOW = 11  # pixels: SSIM's, Gaussian with sigma = 1.5 (Wang et al., IEEE TIP 13(4), 2004)


@dataclass(frozen=True)
class Perception:
    """Each a number, or {"unavailable": reason}. flip_map: (height, width) float32, 0 not seen to 1 as seen as can be.

    psnr_db: of data of range 1. ssim: mean structural similarity, 1 for equal pictures. flip: mean of the map, for a
    viewer 0.7 m from a display 0.7 m and 3840 pixels wide, 67 pixels a degree (Andersson et al., HPG 2020).
    """

    psnr_db: float | dict
    ssim: float | dict
    flip: float
    flip_map: np.ndarray

    def record(self) -> dict:
        return {"psnr_db": self.psnr_db, "ssim": self.ssim, "flip": self.flip}


def perceive(picture: np.ndarray, reference: np.ndarray, arithmetic: str = "linear") -> Perception:
    """Of a judged `picture` (height, width, 3) beside its reference; both hold sRGB where the arithmetic is `srgb`."""
    import flip_evaluator
    from skimage import metrics

    shown, right = (_shown(each, arithmetic) for each in (picture, reference))
    if np.array_equal(shown, right):
        psnr = {"unavailable": "the display shows no difference: it is infinite"}
    else:
        psnr = float(metrics.peak_signal_noise_ratio(right, shown, data_range=1.0))
    ssim = {"unavailable": f"the picture is smaller than its window of {WINDOW} x {WINDOW} pixels"}
    if min(shown.shape[:2]) >= WINDOW:
        ssim = float(
            metrics.structural_similarity(
                right, shown, channel_axis=-1, data_range=1.0, gaussian_weights=True, sigma=1.5,
                use_sample_covariance=False,
            )
        )  # fmt: skip
    seen, mean, _ = flip_evaluator.evaluate(right.astype(np.float32), shown.astype(np.float32), "LDR", applyMagma=False)
    return Perception(psnr, ssim, float(mean), seen[..., 0])


def _shown(picture: np.ndarray, arithmetic: str) -> np.ndarray:
    codes = colour.encode(picture) if arithmetic == "linear" else np.asarray(picture, np.float64)
    return np.clip(codes, 0.0, 1.0)
