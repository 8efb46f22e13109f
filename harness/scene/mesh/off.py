"""Reads OFF (Geomview): vertices, with normals, colours or texture places behind them, and faces, with colours.

OFF                 or COFF, NOFF, STOFF and their combinations; the counts may stand behind it
vertices faces edges
x y z ...
n i j k ...         numbers of vertices, from 0
"""

import re
from itertools import chain

import numpy as np

from harness.scene.mesh.faces import Faces, Fault

_HEADER = re.compile(rb"(?:ST)?C?N?(4?n?)OFF", re.IGNORECASE)
_COUNT = re.compile(rb"\d{1,15}")
AGAIN = "the file is incomplete or damaged; export it again"


def read(content: bytes) -> tuple[np.ndarray, Faces]:
    """Vertices (V, 3) and faces of an OFF file. Fault, with its line, for what cannot be read right."""
    text = content.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"#" in text:
        text = re.sub(rb"#[^\n]*", b"", text)
    lines = [(number, words) for number, line in enumerate(text.split(b"\n"), 1) if (words := line.split())]
    if not lines:
        raise Fault("the file is empty", "", AGAIN)
    number, words = lines[0]
    if header := _HEADER.match(words[0]):
        if header[1]:
            raise Fault("vertices of other than three dimensions", f"line {number}", "export it as OFF")
        words = [word for word in (words[0][header.end() :], *words[1:]) if word]
        if words[:1] == [b"BINARY"]:
            raise Fault("binary OFF is not read", f"line {number}", "export it as text, or as binary PLY")
        lines[0] = number, words
        if not words:
            del lines[0]
    if not lines:
        raise Fault("the numbers of vertices and faces are missing", f"line {number}", AGAIN)
    number, words = lines[0]
    if len(words) not in (2, 3) or not all(map(_COUNT.fullmatch, words)):
        raise Fault("expected OFF, then the numbers of vertices, faces and edges", f"line {number}", AGAIN)
    counts = int(words[0]), int(words[1])
    if len(lines) - 1 != sum(counts):
        why = f"{counts[0]:,} vertices and {counts[1]:,} faces are announced; {len(lines) - 1:,} lines follow"
        raise Fault(why, f"line {number}", "correct the numbers; each vertex and each face has a line of its own")
    points, rings = lines[1 : 1 + counts[0]], lines[1 + counts[0] :]
    vertices = np.array([_numbers(row[:3], 3, float, at) for at, row in points], np.float64).reshape(-1, 3)
    sizes = [_numbers(row[:1], 1, int, at)[0] for at, row in rings]
    corners = [_numbers(row[1 : size + 1], size, int, at) for (at, row), size in zip(rings, sizes, strict=True)]
    at = np.array([at for at, _ in rings], np.int64)
    return vertices, Faces(np.array(list(chain.from_iterable(corners)), np.int64), np.array(sizes, np.int64), at)


def _numbers(words: list[bytes], count: int, kind: type, line: int) -> list:
    """The words as numbers. Fault unless there are so many."""
    try:
        if len(words) == count and not any(b"_" in word or len(word) > 300 for word in words):
            numbers = [kind(word) for word in words]
            if kind is float or all(0 <= number < 2**62 for number in numbers):
                return numbers
    except ValueError:
        pass
    what = f"expected {count} numbers" if kind is float else "expected the corners of a face: how many, and then each"
    raise Fault(what, f"line {line}", "write a point for the decimal comma" if any(b"," in w for w in words) else AGAIN)
