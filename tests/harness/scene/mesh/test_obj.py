"""OBJ files as people have them: read right, or refused with the line."""

import gc
import re
import time

import numpy as np
import pytest

from harness.scene.mesh import obj
from harness.scene.mesh.faces import Fault, triangles

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
FACE = "f 1 2 3 4\n"


def area(content):
    vertices, faces = obj.read(content if isinstance(content, bytes) else content.encode())
    a, b, c = (vertices[corner] for corner in triangles(vertices, faces).T)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def indented(text):
    return "".join(f" \t{line}\n" for line in text.splitlines())


# The square, of area 1.
SQUARES = {
    "plain": SQUARE + FACE,
    "tabs": (SQUARE + FACE).replace(" ", "\t"),
    "indented": indented(SQUARE + FACE),
    "capitals": (SQUARE + FACE).upper(),
    "a byte order mark": "\ufeff" + SQUARE + FACE,
    "lines of Windows": (SQUARE + FACE).replace("\n", "\r\n"),
    "lines of old Macs": (SQUARE + FACE).replace("\n", "\r"),
    "no newline at the end": SQUARE + FACE.strip(),
    "spaces at the ends of lines": (SQUARE + FACE).replace("\n", "  \n"),
    "a face on two lines": SQUARE + "f 1 2\\\n3 4\n",
    "a face on four lines": SQUARE + "f \\\n1 2 \\\n3\\ \n 4\n",
    "a face on two lines of Windows": SQUARE + "f 1 2 \\\r\n3 4\r\n",
    "a vertex on two lines": "v 0 \\\n0 0\n" + SQUARE.split("\n", 1)[1] + FACE,
    "a comment before the line goes on": SQUARE + "f 1 2 \\ # half\n3 4\n",
    "a backslash at the end of the file": SQUARE + FACE.strip() + "\\",
    "a comment that ends in a backslash": "# C:\\meshes\\\n" + SQUARE + "# \\\n" + FACE,
    "a comment behind a face": SQUARE + "f 1 2 3 4 # a square\n",
    "a comment against a face": SQUARE + "f 1 2 3 4# \\\n",
    "a comment in any encoding": b"# caf\xe9 \xff\n" + (SQUARE + FACE).encode(),
    "a name that ends in a backslash": "o C:\\meshes\\\n" + SQUARE + "g C:\\\n" + FACE,
    "names": "mtllib a b.mtl\ng a\no \xe9#1\n" + SQUARE + "usemtl f 1 2 3\ns off\n" + FACE + "l 1 2 3\np 1\n",
    "a continued name": "g a \\\nb c\n" + SQUARE + FACE,
    "formats in one file": SQUARE + "vn 0 0 1\nvt 0 0\nf 1//1 2//1 3//1\nf 1 3 4\n",
    "formats in one face": SQUARE + "vn 0 0 1\nvt 0 0\nf 1/1/1 2/1 3//1 4\n",
    "slashes with nothing behind": SQUARE + "f 1/ 2/ 3// 4/\n",
    "normals that do not exist": SQUARE + "f 1/9/9 2/9/9 3/9/9 4/9/9\n",
    "counted back": SQUARE + "f -4 -3 -2 -1\nv 9 9 9\nv 8 8 8\n",
    "counted back, and not": SQUARE + "f 1 -3 3 -1\n",
    "counted back twice": SQUARE + "f -4 -3 -2\n" + SQUARE + "f -4 -2 -1\n",
    "a face before its vertices": FACE + SQUARE,
    "with w": SQUARE.replace(" 0\n", " 0 1.0\n") + FACE,
    "with colours": SQUARE.replace(" 0\n", " 0 0.5 0.2 1\n") + FACE,
    "some with colours": SQUARE.replace(" 0\n", " 0 0.5 0.2 1\n", 2) + FACE,
    "the old keyword of faces": SQUARE + "fo 1 2 3 4\n",
    "repeated corners": SQUARE + "f 1 1 2 3 3 3 4 1\n",
    "two corners at one place": SQUARE + "v 1 1 0\nf 1 2 3 5 4\n",
    "a face without an area": SQUARE + "f 1 1 2\nf 1 2 1 2\n" + FACE,
    "a corner on a side": SQUARE + "v 0.5 0 0\nf 1 5 2 3 4\n",
    "numbers of all kinds": "v +0 -0.0 0e5\nv 1. .0 0\nv 1E0 10e-1 0\nv 0 1 0\nf +1 2 3 04\n",
}


@pytest.mark.parametrize("name", SQUARES)
def test_squares(name):
    assert area(SQUARES[name]) == pytest.approx(1, rel=1e-15)


REFUSED = {
    "counted from 0": (SQUARE + "f 0 1 2\nf 0 2 3\n", "line 5", "OBJ counts from 1"),
    "beyond the last": (SQUARE + FACE + "f 1 2 5\n", "line 6", "does not exist; the file has 4"),
    "beyond the last, on a line that goes on": (SQUARE + "f 1 2 \\\n 9\n" + FACE, "line 5", "does not exist"),
    "counted back too far": ("v 0 0 0\nf -1 -2 -3\nv 1 0 0\nv 0 1 0\n", "line 2", "back to vertex -2; only 1 come"),
    "a decimal comma": (SQUARE + "v 1,5 0 0\n" + FACE, "line 5", "not a number"),
    "too large a number": (SQUARE + "v 1e400 0 0\nf 1 2 5\n", "line 6", "not finite; it is number 5"),
    "no number": (SQUARE + "v nan 0 0\n" + FACE + "f 1 2 5\n", "line 7", "not finite"),
    "a hexadecimal number": (SQUARE + "v 0x10 0 0\n" + FACE, "line 5", "not a number"),
    "an underscore": (SQUARE + "v 1_0 0 0\n" + FACE, "line 5", "not a number"),
    "an underscore in a face": (SQUARE + "f 1 2 0_3\n", "line 5", "not a corner"),
    "two numbers": (SQUARE + "v 1 2\n" + FACE, "line 5", "three numbers; here are 2"),
    "ten numbers": (SQUARE + "v 1 2 3 4 5 6 7 8 9 10\n" + FACE, "line 5", "here are 10"),
    "no corner": (SQUARE + "f\n", "line 5", "0 corners"),
    "one corner": (SQUARE + "f 1\n", "line 5", "1 corner;"),
    "two corners": (SQUARE + FACE + "\n# a line\nf 1 2\n", "line 8", "2 corners; it needs 3"),
    "a word in a face": (SQUARE + "f 1 2 x\n", "line 5", "not a corner"),
    "a fraction in a face": (SQUARE + "f 1 2 3.5\n", "line 5", "not a corner"),
    "four numbers in a corner": (SQUARE + "f 1/1/1/1 2 3\n", "line 5", "not a corner"),
    "a line that a face swallows": (SQUARE + "f 1 2 3 \\\nf 1 3 4\n", "line 5", "not a corner"),
    "a face that crosses itself": (SQUARE + "f 1 2 4 3\n", "line 5", "crosses itself"),
    "no keyword": (SQUARE + "1 2 3\n" + FACE, "line 5", "keyword"),
    "another keyword": (SQUARE + "vertex 1 2 3\n" + FACE, "line 5", "keyword"),
    "a free-form surface": (SQUARE + "surf 0 1 0 1 1 2 3 4\n", "line 5", "free-form"),
    "a command": (SQUARE + "call other.obj\n", "line 5", "carried out"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_the_line(name):
    content, place, message = REFUSED[name]
    with pytest.raises(Fault, match=re.escape(message)) as caught:
        area(content)
    assert caught.value.place == place and caught.value.remedy
    assert not {"1,5", "0x10", "3.5", "other"} & set(str(caught.value).split())  # nothing of the file is quoted


@pytest.mark.parametrize("seed", range(20))
def test_any_way_to_write_a_mesh_is_the_same_mesh(seed):
    rng = np.random.default_rng(seed)
    print("seed", seed)
    points = rng.normal(size=(40, 3))
    corners = np.array([rng.choice(40, 3, replace=False) for _ in range(60)])
    lines, known = [], 0
    for a, b, c in corners.tolist():
        while known <= max(a, b, c):
            lines.append(f"v {' '.join(map(repr, points[known].tolist()))}")
            known += 1
        words = []
        for corner in (a, b, c):
            word = str(corner + 1 if rng.random() < 0.5 else corner - known)
            words.append(word + rng.choice(["", "/1", "//1", "/1/1", "/-1/-1"]))
        gap = rng.choice([" ", "\t", "  ", " \\\n", "\\\n\t"])
        lines.append(rng.choice(["f ", "F\t", "  f "]) + gap.join(words) + rng.choice(["", " ", " # \\", "\t#x"]))
        lines += ["# \\"] * (rng.random() < 0.2) + ["vn 0 0 1"] * (rng.random() < 0.2) + [""] * (rng.random() < 0.2)
    vertices, faces = obj.read(rng.choice(["\n", "\r\n"]).join(lines).encode())
    assert np.array_equal(vertices, points[:known])
    assert np.array_equal(triangles(vertices, faces), corners)


def test_time_is_linear():
    """Eight times the file takes nowhere near 64 times as long, also where each line goes on in the next."""
    for end in ("\n", " \\\n# x\n\n"):
        took = []
        for count in (2_000, 16_000):
            text = "".join(f"v {i} 0 0{end}v 0 {i} 1{end}v 1 1 {i}{end}f -1 -2 -3{end}" for i in range(count)).encode()
            took.append(min(_timed(text) for _ in range(3)))
        assert took[1] < 24 * took[0] + 0.05


def _timed(text):
    gc.disable()  # whose work grows with what other tests left
    try:
        began = time.process_time()
        obj.read(text)
        return time.process_time() - began
    finally:
        gc.enable()
