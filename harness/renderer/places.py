"""Places of the samples of later frames (FRM-1), and checksums of their pictures (FRM-2)."""

import zlib

import numpy as np

MOST_RENDERS = 4096  # of a frame
STEPS = 3242174889, 2447445413  # 2^32 times the R2 sequence's (Roberts 2018), odd
SPREAD = 16  # of a pixel's side, the part in which the places of one job lie
DIGITS = 8  # of a checksum


def place(key: tuple[int, int], frame: int, render: int, sample: tuple[float, float]) -> tuple[float, float]:
    """Returns the place in a pixel of the sample of a render of a later frame. sample: the job's (CAM-4)."""
    count = MOST_RENDERS * frame + render
    units = (((first + count * step) % 2**32 >> 8) * 2.0**-24 for first, step in zip(key, STEPS, strict=True))
    x, y = (((SPREAD - 1) * own + unit) / SPREAD for own, unit in zip(sample, units, strict=True))
    return x, y


def checksum(picture: np.ndarray) -> str:
    """Returns the checksum of a picture's numbers: CRC-32 in hexadecimal digits."""
    return f"{zlib.crc32(np.ascontiguousarray(picture)):0{DIGITS}x}"
