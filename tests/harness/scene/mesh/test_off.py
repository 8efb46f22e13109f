"""OFF files as people have them: read right, or refused with the line."""

import re

import numpy as np
import pytest

from harness.scene.mesh import off
from harness.scene.mesh.faces import Fault, triangles

DART = "-1 -1 0\n0 -0.5 0\n1 -1 0\n0 1 0\n"  # of area 1.5; its hull has 2
FACE = "4 0 1 2 3\n"


def area(text):
    vertices, faces = off.read(text.encode())
    a, b, c = (vertices[corner] for corner in triangles(vertices, faces).T)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


DARTS = {
    "plain": f"OFF\n4 1 0\n{DART}{FACE}",
    "without the number of edges": f"OFF\n4 1\n{DART}{FACE}",
    "counts behind the keyword": f"OFF 4 1 0\n{DART}{FACE}",
    "counts against the keyword": f"OFF4 1 0\n{DART}{FACE}",
    "without the keyword": f"4 1 0\n{DART}{FACE}",
    "comments, empty lines, tabs": f"# a\nOFF # b\n\n4\t1 0 # c\n# d\n{DART}\n\n4 0 1 2\t3 # e\n",
    "lines of Windows": f"OFF\n4 1 0\n{DART}{FACE}".replace("\n", "\r\n"),
    "a byte order mark": f"\ufeffOFF\n4 1 0\n{DART}{FACE}",
    "a coloured face": f"OFF\n4 1 0\n{DART}4 0 1 2 3 255 0 0\n",
    "coloured vertices": "COFF\n4 1 0\n" + DART.replace("\n", " 0.5 1 0 1\n") + FACE,
    "normals": "NOFF\n4 1 0\n" + DART.replace("\n", " 0 0 1\n") + FACE,
    "small letters": f"off\n4 1 0\n{DART}{FACE}",
}


@pytest.mark.parametrize("name", DARTS)
def test_darts(name):
    assert area(DARTS[name]) == pytest.approx(1.5, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("", "", "empty"),
        ("OFF\n", "line 1", "missing"),
        ("OFF\nfour 1 0\n", "line 2", "the numbers of vertices"),
        (f"OFF\n4 2 0\n{DART}{FACE}", "line 2", "4 vertices and 2 faces are announced; 5 lines follow"),
        (f"OFF\n4 1 0\n{DART}{FACE}{FACE}", "line 2", "6 lines follow"),
        (f"OFF\n4 1 0\n{DART}4 0 1 2 4\n", "line 7", "does not exist"),
        (f"OFF\n4 1 0\n{DART}4 0 1 2 -1\n", "line 7", "corners of a face"),
        (f"OFF\n4 1 0\n{DART}4 0 1 2\n", "line 7", "corners of a face"),
        (f"OFF\n4 1 0\n{DART}2 0 1\n", "line 7", "2 corners"),
        (f"OFF\n4 1 0\n{DART.replace('-0.5', '-0,5')}{FACE}", "line 4", "3 numbers"),
        (f"OFF\n4 1 0\n{DART.replace('-0.5', 'inf')}{FACE}", "line 7", "not finite"),
        (f"4OFF\n4 1 0\n{DART}{FACE}", "line 1", "three dimensions"),
        ("OFF BINARY\n\1\2", "line 1", "binary OFF"),
    ],
)
def test_refused_with_the_line(text, place, message):
    with pytest.raises(Fault, match=re.escape(message)) as caught:
        area(text)
    assert caught.value.place == place
