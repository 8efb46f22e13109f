"""Reads the OpenEXR pictures that POV-Ray writes: scan lines of 16-bit floats, ZIP or not compressed."""

import struct
import zlib

import numpy as np

LINES = {0: 1, 2: 1, 3: 16}  # scan lines of a chunk by compression: none, ZIPS, ZIP


def read(path):
    """The picture at `path` as float32 (height, width, 3), row 0 on top."""
    with open(path, "rb") as file:
        data = file.read()
    magic, version = struct.unpack_from("<II", data)
    if magic != 20000630 or version != 2:
        raise ValueError(f"{path}: not a plain OpenEXR picture")
    header, at = _header(data, 8)
    left, top, right, bottom = struct.unpack("<4i", header["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    channels = _channels(header["channels"])
    lines = LINES[header["compression"][0]]
    picture = np.empty((height, len(channels), width), np.float16)
    for offset in struct.unpack_from(f"<{-(-height // lines)}Q", data, at):
        y, size = struct.unpack_from("<ii", data, offset)
        rows = picture[y - top : y - top + lines]
        rows[...] = _pixels(data[offset + 8 : offset + 8 + size], rows.nbytes).reshape(rows.shape)
    order = [channels.index(name) for name in "RGB"]
    return picture[:, order].transpose(0, 2, 1).astype(np.float32)


def _header(data, at):
    """The attributes, and where they end."""
    found = {}
    while data[at]:
        name, at = _word(data, at)
        _, at = _word(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        found[name] = data[at + 4 : at + 4 + size]
        at += 4 + size
    return found, at + 1


def _word(data, at):
    end = data.index(0, at)
    return data[at:end].decode(), end + 1


def _channels(data):
    """Names of the channels, in the order of the file."""
    names, at = [], 0
    while data[at]:
        name, at = _word(data, at)
        if struct.unpack_from("<i", data, at) != (1,):
            raise ValueError(f"channel {name} is not of 16-bit floats")
        names.append(name)
        at += 16
    return names


def _pixels(chunk, size):
    """The 16-bit floats of a chunk that has `size` bytes of them; one that would grow is stored as it is."""
    if len(chunk) < size:
        difference = np.frombuffer(zlib.decompress(chunk), np.uint8).copy()
        difference[1:] -= 128
        halves = np.cumsum(difference, dtype=np.uint8)
        chunk = np.empty(size, np.uint8)
        chunk[0::2], chunk[1::2] = halves[: (size + 1) // 2], halves[(size + 1) // 2 :]
    return np.frombuffer(chunk, "<f2")
