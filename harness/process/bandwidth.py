"""Measures how quickly this machine writes memory: no frame can be shorter than that takes for its pixels."""

import ctypes
import math
import struct
import time
import zlib
from collections.abc import Callable
from functools import cache

TRIES = 10  # of which the quickest counts: other programs may run meanwhile
SMALLEST, LARGEST = 1 << 16, 1 << 26  # bytes of a block: in the nearest cache, and in none
PIXELS, SUMMED = 20_000, 1 << 20  # numbers and bytes that are packed and summed


def write_s(size: int) -> float:
    """Returns the seconds in which one thread writes `size` bytes again and again, at the quickest, with memset(3).

    A small block stays in a cache, so its rate is that of a block of the same size.
    """
    block = min(max(SMALLEST, 1 << math.ceil(math.log2(max(1, size)))), LARGEST)
    return size * _per_byte(block)


@cache
def _per_byte(block: int) -> float:
    memory = ctypes.create_string_buffer(block)
    return quickest(lambda: ctypes.memset(memory, 1, block)) / block


@cache
def pack_pixel_s() -> float:
    """Returns the seconds in which an interpreter packs a pixel for a file: the slowest of honest ways to save one."""
    pixels = [(0.1, 0.2, 0.3)] * PIXELS
    pack = struct.Struct(f"<{3 * PIXELS}d").pack
    return quickest(lambda: pack(*[value for pixel in pixels for value in pixel])) / PIXELS


def checksum_s(size: int) -> float:
    """Returns the seconds that zlib takes for the checksum of so many bytes (FRM-2)."""
    return size * _checksum_per_byte()


@cache
def _checksum_per_byte() -> float:
    data = bytes(SUMMED)
    return quickest(lambda: zlib.crc32(data)) / SUMMED


def quickest(work: Callable[[], object]) -> float:
    """Returns the least seconds that some work took."""
    taken = []
    for _ in range(TRIES):
        begun = time.perf_counter()
        work()
        taken.append(time.perf_counter() - begun)
    return min(taken)
