"""Judges a picture: its agreement with a reference made the same way, and its errors, from the truth of the scene.

Order of checks: all finite, then shape, then numbers in linear float64. A NaN makes every image metric meaningless,
and some hide it.
"""

from dataclasses import asdict, dataclass

import numpy as np

from harness.judge import span
from harness.process.repetition import Result
from harness.store import record

# Largest difference allowed in any channel outside the mask. float64: the cross-renderer gate of the conformance
# suite. float32: one step of an 8-bit picture.
TOLERANCE = {"float64": 1e-9, "float32": 1 / 255}
STEP = 1 / 255
LARGEST = 1e145  # of a channel: beyond it, squares and their sums leave float64
DARK = 1e-2  # squared linear level below which relative errors count less
EXTERNAL_TOLERANCE = 2 / 255  # of a program that is not ours, whose pictures may come in few bits
RAY_TOLERANCE = {"float64": 1e-4, "float32": 1e-2}  # relative, of each ray count
LARGE_MASK = 0.1  # of a picture: what the mask holds is judged less strictly, so a larger one is said


@dataclass(frozen=True)
class Reference:
    """A float64 picture, the mask (height, width) of its M ill-conditioned pixels, its ray counts and its maker.

    span: (2, M, 3), the lowest and highest values of each channel that it and the perturbed references have in these
    pixels, in the order of the mask; of hits see hits.py. left: how many of them leave it (span.py) in each of the
    further references, of which there are none if there is no such pixel.
    """

    maker: str
    picture: np.ndarray
    mask: np.ndarray
    rays: dict | None
    span: np.ndarray
    left: tuple[int, ...]

    def stored(self) -> tuple[dict, dict[str, np.ndarray]]:
        """Converts it to facts for JSON and arrays, for the cache."""
        facts = {"maker": self.maker, "rays": self.rays, "left": self.left}
        return facts, {"reference": self.picture, "mask": self.mask, "span": self.span}

    @classmethod
    def restored(cls, facts: dict, arrays: dict[str, np.ndarray]) -> "Reference":
        left = tuple(facts["left"])
        return cls(facts["maker"], arrays["reference"], arrays["mask"], facts["rays"], arrays["span"], left)


@dataclass(frozen=True)
class Verdict:
    """The agreement of a picture with its reference (ERR-2). Differences are of linear RGB, over all channels.

    max_outside, max_inside: largest absolute difference outside and inside the mask (None: no such pixels).
    rmse: root of the mean squared difference, all pixels. relative_mse: mean of squared differences, each divided by
    the square of the reference + 0.01, so that dark and bright count alike. bad_pixels: fraction whose largest channel
    difference exceeds 1/255. mask_fraction: share of ill-conditioned pixels. wrong: None, or why the picture is
    rejected.
    """

    wrong: str | None
    max_outside: float | None = None
    max_inside: float | None = None
    rmse: float | None = None
    relative_mse: float | None = None
    bad_pixels: float | None = None
    mask_fraction: float | None = None
    tolerance: float | None = None

    def record(self) -> dict:
        return asdict(self)


def not_finite(picture: np.ndarray) -> str | None:
    """None, or how many pixels have a channel that is NaN, infinite or as good as that."""
    broken = int(np.count_nonzero(~(np.abs(picture) <= np.float64(LARGEST)).all(axis=-1)))
    if not broken:
        return None
    return f"{broken} pixels are not finite" + (f", or beyond {LARGEST:g}" if np.isfinite(picture).all() else "")


def broken(result: Result) -> str | None:
    """None, or how many pixels of a picture are not finite, or how many samples the renderer counted as such."""
    if result.array.ndim != 3:
        return None
    counted = (result.said.rays or {}).get("non_finite")
    return not_finite(result.array) or (f"{counted} samples are not finite" if counted else None)


def judge(
    picture: np.ndarray,
    expected: Reference,
    precision: str,
    external: bool = False,
    bound: np.ndarray | float = 0.0,
) -> Verdict:
    """Judge `picture` (height, width, 3) against a reference: outside the mask each pixel, inside it all (span.py).

    external: the picture is by a program that is not ours. bound: (height, width), what a cut-off may have changed
    beside the tolerance (bound.py).
    """
    reference, mask = expected.picture, expected.mask
    broken = not_finite(picture)
    if broken:
        return Verdict(broken)
    if picture.shape != reference.shape:
        return Verdict(f"its shape is {picture.shape}, the reference's {reference.shape}")
    squares = (picture.astype(np.float64) - reference) ** 2
    difference = np.abs(picture.astype(np.float64) - reference).max(axis=-1)
    outside, inside = difference[~mask], difference[mask]
    tolerance = EXTERNAL_TOLERANCE if external else TOLERANCE.get(precision, TOLERANCE["float64"])
    worst = float(outside.max()) if outside.size else None
    wrong = None
    allowed = tolerance + np.broadcast_to(bound, mask.shape)
    beyond = outside[~(outside <= allowed[~mask])]
    if beyond.size:
        limit = f"{tolerance:.3g}" + ("" if np.isscalar(bound) else " and the bound of its cut-off")
        wrong = f"{beyond.size} pixels off by more than {limit} outside the mask, the worst by {beyond.max():.3g}"
    elif inside.size:
        wrong = _inside(picture[mask].astype(np.float64), expected, allowed[mask])
    return Verdict(
        wrong=wrong,
        max_outside=worst,
        max_inside=float(inside.max()) if inside.size else None,
        rmse=float(np.sqrt(squares.mean())),
        relative_mse=float(np.mean(squares / (reference**2 + DARK))),
        bad_pixels=float(np.mean(difference > STEP)),
        mask_fraction=float(mask.mean()),
        tolerance=tolerance,
    )


def _inside(pixels: np.ndarray, expected: Reference, allowed: np.ndarray) -> str | None:
    """None, or why the ill-conditioned `pixels` (M, 3), allowed to be so far off (M,), are not those of a right one."""
    excess = span.excess(pixels, expected.span, allowed)
    beyond = int(np.count_nonzero(excess > 0))
    limit = span.most(len(pixels), expected.left)
    if beyond <= limit:
        return None
    return (
        f"{beyond} of {len(pixels)} pixels inside the mask are further off than moves of the sample by some float32 "
        f"steps bring them, the worst by {excess.max():.3g}; in a right picture at most {limit} are"
    )


def errors(
    picture: np.ndarray,
    truth: np.ndarray,
    noise: np.ndarray | None,
    mask: np.ndarray | None,
    doubt: float = 0.0,
) -> dict:
    """The errors of a finite picture (height, width, 3): its distance from the truth, over all pixels (ERR-1).

    noise: standard error of the truth, likewise; None: it has none. mask: of ill-conditioned pixels; None: not known.
    doubt: of a Truth. Keys: rmse, free of the noise's share; rmse_standard_error, what the noise leaves uncertain in
    it; below, as of record.below; max and bad_pixels, to which noise adds; relative_mse, as in Verdict; mask_fraction.
    """
    squares = (picture.astype(np.float64) - truth) ** 2
    difference = np.sqrt(squares.max(axis=-1))
    variance = np.zeros(1) if noise is None else noise**2
    mean = max(0.0, float(np.mean(squares) - np.mean(variance)))
    # (d + n)^2 - s^2, with normal noise n and its variance s^2 from 4 pictures, scatters by 4 d^2 v + (2 + 2/3) v^2. In
    # it d^2 + v is known as the square, and v^2 as 3/5 s^4. Of more pictures it scatters less.
    scatter = float(np.sum(4 * squares * variance - 0.8 * variance**2))
    spread = np.sqrt(max(0.0, scatter)) / squares.size
    rmse = float(np.sqrt(mean))
    spread = float(min(np.sqrt(spread), spread / (2 * rmse)) if rmse else np.sqrt(spread))
    return {
        "rmse": rmse,
        "rmse_standard_error": spread,
        "below": record.below({"rmse": rmse, "rmse_standard_error": spread, "change": doubt}),
        "max": float(difference.max()),
        "bad_pixels": float(np.mean(difference > STEP)),
        "relative_mse": max(0.0, float(np.mean((squares - variance) / (truth**2 + DARK)))),
        "mask_fraction": None if mask is None else float(mask.mean()),
    }


def compare_rays(counts: dict | None, reference: dict | None, precision: str) -> str | None:
    """None, or how the ray counts differ from the reference's by more than the tolerance."""
    if counts is None or reference is None:
        return None
    tolerance = RAY_TOLERANCE.get(precision, RAY_TOLERANCE["float64"])
    for name in ("primary", "reflected", "transmitted", "shadow"):
        if abs(counts[name] - reference[name]) > tolerance * max(reference[name], 1):
            return f"{counts[name]} {name} rays, the reference has {reference[name]}"
    return None
