"""PLY files as people have them: text and binary, read right, or refused with the line."""

import re
import struct

import numpy as np
import pytest

from harness.scene.mesh import ply
from harness.scene.mesh.faces import Fault, triangles

DART = [(-1, -1, 0), (0, -0.5, 0), (1, -1, 0), (0, 1, 0)]  # of area 1.5; its hull has 2
PROPERTIES = "property float x\nproperty float y\nproperty float z\n"
LIST = "property list uchar int vertex_indices\n"


def area(content):
    vertices, faces = ply.read(content)
    a, b, c = (vertices[corner] for corner in triangles(vertices, faces).T)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def header(kind, faces=1, vertex=PROPERTIES, face=LIST, element="face", more=""):
    head = f"ply\nformat {kind} 1.0\ncomment by hand\nobj_info none\nelement vertex 4\n{vertex}"
    return f"{head}{more}element {element} {faces}\n{face}end_header\n"


def text(*faces, points=DART, **given):
    rows = [" ".join(map(str, row)) for row in (*points, *faces)]
    return (header("ascii", len(faces), **given) + "\n".join(rows) + "\n").encode()


def binary(order, *faces, length="B", item="i", **given):
    kind = "binary_little_endian" if order == "<" else "binary_big_endian"
    rows = [struct.pack(f"{order}3f", *point) for point in DART]
    rows += [struct.pack(f"{order}{length}{len(face)}{item}", len(face), *face) for face in faces]
    return header(kind, len(faces), **given).encode() + b"".join(rows)


WHOLE = (0, 1, 2, 3)
SHORT = LIST.replace("uchar int", "int ushort").replace("indices", "index")
FLAGS = LIST + "property uchar flags\nproperty list uchar float texcoord\n"
DARTS = {
    "text": text((4, *WHOLE)),
    "text, lines of Windows": text((4, *WHOLE)).replace(b"\n", b"\r\n"),
    "text, more properties": text((4, *WHOLE, 9, 2, 0.5, 0.5), face=FLAGS),
    "text, in triangles and more": text((3, 0, 1, 3), (3, 1, 2, 3)),
    "text, coloured vertices": text(
        (4, *WHOLE), points=[(*p, 255, 0) for p in DART], vertex=PROPERTIES + "property uchar red\nproperty int k\n"
    ),
    "text, another order": text(
        (4, *WHOLE), points=[(z, y, x) for x, y, z in DART], vertex="".join(f"property double {a}\n" for a in "zyx")
    ),
    "text, strips": text((4, 0, 1, 3, 2), element="tristrips"),
    "text, strips with ends": text((9, 0, 1, 3, -1, 1, 2, 3, -1, 0), element="tristrips"),
    "text, elements between": text(
        (7, 7), (4, *WHOLE), more="element edge 1\nproperty int vertex1\nproperty int vertex2\n"
    ).replace(b"face 2", b"face 1"),
}
for ORDER, NAME in (("<", "little endian"), (">", "big endian")):
    DARTS |= {
        NAME: binary(ORDER, WHOLE),
        f"{NAME}, lines of Windows": binary(ORDER).replace(b"\n", b"\r\n").replace(b"face 0", b"face 1")
        + struct.pack(f"{ORDER}B4i", 4, *WHOLE),
        f"{NAME}, faces of different length": binary(ORDER, WHOLE, (0, 0, 1), (1, 1, 1, 1, 2)),
        f"{NAME}, other types": binary(ORDER, WHOLE, length="i", item="H", face=SHORT),
        f"{NAME}, strips": binary(ORDER, (0, 1, 3, 2), (0, 0, 0, -1, 1), element="tristrips"),
        f"{NAME}, more properties": header(
            "binary_little_endian" if ORDER == "<" else "binary_big_endian", 2, face=FLAGS
        ).encode()
        + b"".join(struct.pack(f"{ORDER}3f", *point) for point in DART)
        + struct.pack(f"{ORDER}B4iBB2f", 4, *WHOLE, 7, 2, 0.5, 0.5)
        + struct.pack(f"{ORDER}B3iBB", 3, 0, 0, 1, 7, 0),
    }


@pytest.mark.parametrize("name", DARTS)
def test_darts(name):
    assert area(DARTS[name]) == pytest.approx(1.5, rel=1e-15)


def test_every_other_triangle_of_a_strip_is_turned_over():
    """So all triangles of a strip face to one side."""
    vertices, faces = ply.read(text((4, 0, 1, 3, 2), element="tristrips"))
    assert triangles(vertices, faces).tolist() == [[0, 1, 3], [3, 1, 2]]


@pytest.mark.parametrize(
    ("content", "place", "message"),
    [
        (b"", "line 1", "begins with a line ply"),
        (b"ply\nformat ascii 1.0\nelement vertex 4\n", "line 4", "no end"),
        (b"ply\nelement vertex 4\nend_header\n", "", "names no format"),
        (b"ply\nformat ascii 2.0\nend_header\n", "line 2", "PLY 1.0"),
        (text((4, *WHOLE)).replace(b"float y", b"half y"), "line 7", "PLY 1.0"),
        (text((4, *WHOLE)).replace(b"float y", b"float v"), "", "no property y"),
        (text((4, *WHOLE)).replace(b"vertex_indices", b"corners"), "", "no property vertex_indices"),
        (text((4, *WHOLE)).replace(b"list uchar int", b"list uchar float"), "", "whole numbers"),
        (text((4, 0, 1, 2, 4)), "line 16", "does not exist; the file has 4"),
        (text((4, 0, 1, 2, -1)), "line 16", "does not exist"),
        (text((4, 0, 1, 2)), "line 16", "5 numbers here, by the header; the line has 4"),
        (text((2, 0, 1)), "line 16", "2 corners"),
        (
            text((4, *WHOLE), (4, *WHOLE)).replace(b"face 2", b"face 3"),
            "",
            "announces 3 of the element face; here are 2",
        ),
        (text((4, *WHOLE), (4, *WHOLE)).replace(b"face 2", b"face 1"), "line 17", "more than the header announces"),
        (text((4, *WHOLE)).replace(b"-0.5", b"-0,5"), "line 13", "not a number"),
        (text((4, *WHOLE)).replace(b"-0.5", b"nan"), "line 16", "not finite"),
        (binary("<", WHOLE)[:-1], "", "ends in number 1"),
        (binary(">", (0, 1, 2), (0, 1, 9)), "face 2", "does not exist"),
        (
            binary("<", WHOLE, WHOLE, length="b", face=LIST.replace("uchar", "char"))[:-17] + b"\xff",
            "face 2",
            "negative",
        ),
    ],
)
def test_refused_with_the_line(content, place, message):
    with pytest.raises(Fault, match=re.escape(message)) as caught:
        area(content)
    assert caught.value.place == place


@pytest.mark.parametrize("seed", range(10))
def test_faces_of_any_length(seed):
    """Text and binary are the same faces."""
    rng = np.random.default_rng(seed)
    print("seed", seed)
    faces = [tuple(rng.integers(0, 4, rng.integers(1, 9)).tolist()) for _ in range(200)]
    expected = np.concatenate(faces).tolist()
    for content in (text(*((len(face), *face) for face in faces)), binary("<", *faces), binary(">", *faces)):
        found = ply.read(content)[1]
        assert found.corners.tolist() == expected and found.counts.tolist() == list(map(len, faces))
