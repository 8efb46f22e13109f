"""Pictures inside a page, each once, as long as there is room."""

import base64
import hashlib
import io

import numpy as np
from PIL import Image

LOSSY = 82  # quality of WebP where a picture is only looked at


class Embedded:
    """Pictures by a short key, as data: addresses, of `room` bytes together. left_out: how many did not fit."""

    def __init__(self, room: int):
        self.room, self.left_out = room, 0
        self.images: dict[str, str] = {}
        self._known: dict[str, str] = {}

    def add(self, data: bytes, kind: str) -> str | None:
        """The key of a picture of this kind ("image/webp", say); None if there is no room for it."""
        found = hashlib.sha256(data).hexdigest()
        if found not in self._known:
            address = f"data:{kind};base64,{base64.b64encode(data).decode()}"
            if len(address) > self.room:
                self.left_out += 1
                return None
            self.room -= len(address)
            self._known[found] = f"p{len(self.images)}"
            self.images[self._known[found]] = address
        return self._known[found]

    def add_pixels(self, pixels: np.ndarray, exact: bool = False) -> str | None:
        """The same of uint8 sRGB (height, width, 3), to the last bit if `exact`."""
        file = io.BytesIO()
        how = {"lossless": True, "quality": 60} if exact else {"quality": LOSSY}
        Image.fromarray(pixels, "RGB").save(file, "WEBP", method=4, **how)
        return self.add(file.getvalue(), "image/webp")


def smaller(pixels: np.ndarray, longest: int) -> np.ndarray:
    """uint8 (height, width, 3) with no side longer than `longest` pixels."""
    high, wide = pixels.shape[:2]
    if max(high, wide) <= longest:
        return pixels
    scale = longest / max(high, wide)
    size = max(1, round(wide * scale)), max(1, round(high * scale))
    return np.asarray(Image.fromarray(pixels, "RGB").resize(size, Image.Resampling.LANCZOS))
