"""Converts between sRGB and linear RGB (SPEC.md, COL-2 and COL-3; IEC 61966-2-1).

Arrays may have any shape; a value is one channel. Arithmetic is float64.
"""

import mpmath
import numpy as np


def decode(srgb):
    """Linear values for sRGB values, not clamped (COL-2)."""
    srgb = np.asarray(srgb, np.float64)
    curve = ((np.maximum(srgb, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(srgb <= 0.04045, srgb / 12.92, curve)


def decode_exactly(srgb):
    """As `decode`, but each power is correctly rounded, and so the same on every processor.

    NumPy's power differs by a unit in the last place between processors with and without AVX-512. This one takes
    some 20 us for each distinct value.
    """
    values, places = np.unique(np.asarray(srgb, np.float64), return_inverse=True)
    bases = (np.maximum(values, 0.04045) + 0.055) / 1.055
    with mpmath.workprec(100):
        curve = np.array([float(mpmath.power(base, 2.4)) for base in bases.tolist()])
    return np.where(values <= 0.04045, values / 12.92, curve)[places].reshape(np.shape(srgb))


def encode(linear):
    """sRGB values for linear values, not clamped (COL-3). ValueError if one is NaN or infinite."""
    linear = np.asarray(linear, np.float64)
    if not np.isfinite(linear).all():
        raise ValueError("cannot encode a colour that is NaN or infinite")
    curve = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curve)


def encode_8bit(linear):
    """uint8 sRGB codes for linear values: clamped, encoded, rounded (COL-3). ValueError as `encode`."""
    # Clamping after encoding is equivalent, and lets `encode` detect NaN.
    return np.rint(255 * np.clip(encode(linear), 0, 1)).astype(np.uint8)


def codes(picture, arithmetic="linear"):
    """uint8 sRGB codes of a picture. arithmetic: linear, or srgb for sRGB values. ValueError as `encode`."""
    return encode_8bit(picture if arithmetic == "linear" else decode(picture))
