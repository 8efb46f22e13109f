"""sRGB and linear RGB (SPEC.md, COL-2 and COL-3; IEC 61966-2-1).

Arrays may have any shape; a value is one channel. Arithmetic is float64.
"""

import io

import numpy as np


def decode(srgb):
    """Linear values of sRGB ones. Nothing is clamped (COL-2)."""
    srgb = np.asarray(srgb, np.float64)
    curve = ((np.maximum(srgb, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(srgb <= 0.04045, srgb / 12.92, curve)


def encode(linear):
    """sRGB values of linear ones. Nothing is clamped (COL-3). ValueError if one is NaN or infinite."""
    linear = np.asarray(linear, np.float64)
    if not np.isfinite(linear).all():
        raise ValueError("cannot encode a colour that is NaN or infinite")
    curve = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curve)


def encode_8bit(linear):
    """uint8 sRGB codes of linear values: clamped, encoded, rounded (COL-3). ValueError as `encode`."""
    # Clamping after encoding is the same, and leaves NaN for `encode` to find.
    return np.rint(255 * np.clip(encode(linear), 0, 1)).astype(np.uint8)


def codes(picture, arithmetic="linear"):
    """uint8 sRGB of a picture of this `arithmetic`: one of srgb holds sRGB values already. ValueError as `encode`."""
    return encode_8bit(picture if arithmetic == "linear" else decode(picture))


def to_png_bytes(linear):
    """The bytes of a PNG file of a linear picture, shape (height, width, 3). ValueError as `encode`."""
    from PIL import Image  # here, because few who need colours need Pillow

    linear = np.asarray(linear)
    if linear.ndim != 3 or linear.shape[2] != 3:
        raise ValueError(f"expected a picture of shape (height, width, 3), found {linear.shape}")
    file = io.BytesIO()
    Image.fromarray(encode_8bit(linear), "RGB").save(file, "PNG")
    return file.getvalue()
