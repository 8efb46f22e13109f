"""Embeds pictures into a page, each once, until the room is used up."""

import base64
import hashlib
import io

import numpy as np
from PIL import Image

# Of WebP. The default effort makes files 4 to 8 % smaller, in two to three times as long.
LOSSY = {"quality": 82, "method": 2}  # for pictures that are only looked at
EXACT = {"lossless": True, "quality": 30, "method": 1}


class Embedded:
    """Pictures as data: addresses by a short key, at most `room` bytes in total. left_out: how many did not fit.

    inline: an address is written wherever its picture is used, and so counts each time.
    """

    def __init__(self, room: int, inline: bool = False):
        self.room, self.inline, self.left_out = room, inline, 0
        self.images: dict[str, str] = {}
        self._known: dict[str, str] = {}

    def add(self, data: bytes, kind: str, counted: bool = True) -> str | None:
        """Adds a picture of a kind such as "image/webp"; returns its key, None if it does not fit.

        counted: count it as left out if it does not fit.
        """
        digest = hashlib.sha256(data).hexdigest()
        if digest in self._known and not self.inline:
            return self._known[digest]
        address = f"data:{kind};base64,{base64.b64encode(data).decode()}"
        if len(address) > self.room:
            self.left_out += counted
            return None
        self.room -= len(address)
        key = self._known.setdefault(digest, f"p{len(self.images)}")
        self.images[key] = address
        return key

    def add_pixels(self, pixels: np.ndarray, exact: bool = False) -> str | None:
        """Adds a picture, uint8 sRGB (height, width, 3), without loss if `exact`; returns as `add`."""
        if self.room <= 0:  # nothing to encode it for
            self.left_out += 1
            return None
        file = io.BytesIO()
        Image.fromarray(pixels, "RGB").save(file, "WEBP", **(EXACT if exact else LOSSY))
        return self.add(file.getvalue(), "image/webp")


def smaller(pixels: np.ndarray, longest: int) -> np.ndarray:
    """Reduces a picture, uint8 (height, width, 3), so that no side is longer than `longest` pixels."""
    high, wide = pixels.shape[:2]
    if max(high, wide) <= longest:
        return pixels
    scale = longest / max(high, wide)
    size = max(1, round(wide * scale)), max(1, round(high * scale))
    return np.asarray(Image.fromarray(pixels, "RGB").resize(size, Image.Resampling.LANCZOS))
