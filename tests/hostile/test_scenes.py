"""Hostile scenes, in the course's text and in NFF: a scene that can be rendered, or an error at its line."""

from pathlib import Path

import hostile
import numpy as np
import outlines
import pytest

from harness.errors import UserError
from harness.renderer.parameters import Parameters
from harness.scene import concave, load
from harness.scene.flatten import flatten
from harness.scene.generate.comparison import comparison
from harness.scene.generate.spd import balls, tetra
from harness.scene.needs import needs
from harness.scene.nff import _ENTITIES
from harness.scene.text import _KEYWORDS

SCENES = Path(__file__).parents[2] / "experiments" / "scenes"
CAMERA = "CAMERA (0,0,1) (1,0,0) (0,1,0) 2\n"
CLEAR, OPAQUE = "(0.9,0.2,0.1) 0.3 50 (1,0.5,1) 2 1\n", "(0.9,0.2,0.1) 0.3 50 (0,0,0) 1e6 1\n"
PART = "SPHERE (0.5,0.5,-3.5) 0.7 "
SOLIDS = f"""{CAMERA}
OR BOX (0,0,-4) (1,0,0) (0,1,0) (0,0,1) AND SPHERE (0.5,0.5,-3.5) 0.7 NOT SPHERE (0.5,0.5,3) 4 END END END {CLEAR}
NOT OR ELLIPSOID (0,0,0) (1,0,0) (0,1,0) (0,0,1) AND SPHERE (0,0,-3.5) 0.7 END END END {CLEAR}
POLYGON 4 (0,0,0) (1,0,0) (1,1,0) (0,1,0) {OPAQUE}
"""
TEXT = [(SCENES / "local.txt").read_text(), SOLIDS, SOLIDS, comparison(3, 2)]
NFF = [balls(1), tetra(1), "v from 0 0 5 at 0 0 0 up 0 1 0 angle 40 hither 1 resolution 9 9\nf 1 1 1 .5 .5 9 .5 1.5\n"]
NFF[2] += "l 1 2 3 1 1 1\npp 3 0 0 0 0 0 1 1 0 0 0 0 1 0 1 0 0 0 1\ns 0 0 0 1\n"
NFF += [outlines.gears(1, 3)]


def read(path):
    """What a job is made of; its arrays are finite."""
    scene = load(path)
    arrays = flatten(scene)
    assert all(np.isfinite(array).all() for array in arrays.values())
    needs(scene, Parameters(depth=5, shadows=True))
    return scene


@pytest.fixture
def tried(place):
    """tried("a.txt", content): the scene in a file of this content, or the UserError."""

    def tried(name, content):
        path = place / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return hostile.outcome(lambda: read(path), name)

    return tried


KINDS = {
    "a.txt": ("scene text", TEXT, [*_KEYWORDS, "((", "1e30", "(1,2,3)"]),
    "a.nff": ("NFF", NFF, [*_ENTITIES, "c", "hither", "1 2 3", "p 4\n0 0 0\n4 0 0\n1 1 0\n0 4 0\n"]),
}


@pytest.mark.parametrize("name", KINDS)
def test_cases(fuzz, tried, name):
    kind, valid, pieces = KINDS[name]

    def once(random):
        found = tried(name, hostile.mutated(random, valid, pieces))
        if isinstance(found, UserError) and "not a text file" not in str(found):
            assert found.line is None or (found.line >= 1 and found.column >= 1)

    fuzz(kind, once)


DEEP = 100_000
GOOD = {
    "a solid 100,000 deep": CAMERA + "NOT " * DEEP + PART + "END " * DEEP + OPAQUE,
    "a clear solid 20,000 deep": CAMERA + "OR " * 20_000 + PART + "END " * 20_000 + CLEAR,
    "a solid of 20,000 parts": CAMERA + "AND " + PART * 20_000 + "END " + OPAQUE,
    "a byte order mark": b"\xef\xbb\xbf" + SOLIDS.encode(),
    "lines of Windows": SOLIDS.replace("\n", "\r\n"),
    "lines of old Macs": SOLIDS.replace("\n", "\r"),
    "names and comments in any script": SOLIDS + "# ünï\u2028cödé \U0001f600\n",
    "one line of a megabyte": SOLIDS + "#" + "x" * 10**6,
    "the largest and the smallest": CAMERA + f"SPHERE (1e30,-1e30,1e30) 1e-30 {OPAQUE}SPHERE (0,0,0) 1e30 {CLEAR}",
    "denormals": CAMERA + f"SPHERE (5e-324,0,-5e-324) 1 {OPAQUE}LIGHT (5e-324,0,0) (5e-324,0,0) 5e-324\n",
}
BAD = {
    "nothing": (b"", "1:1: the file is empty"),
    "NUL bytes": (b"\0" * 1000, r"not a text file \(UTF-8\)"),
    "a NUL byte": (SOLIDS.encode() + b"\0", r"not a text file \(UTF-8\)"),
    "UTF-16": (SOLIDS.encode("utf-16"), r"not a text file \(UTF-8\)"),
    "UTF-16 without a mark": (SOLIDS.encode("utf-16-le"), r"not a text file \(UTF-8\)"),
    "half a letter": (SOLIDS.encode() + b"\xc3", r"not a text file \(UTF-8\)"),
    "half a pair": (SOLIDS.encode() + b"\xed\xa0\x80", r"not a text file \(UTF-8\)"),
    "an ELF file": (b"\x7fELF\x02\x01\x01\0" + bytes(range(256)) * 9, r"not a text file"),
    "escapes for a terminal": (CAMERA + "\x1b[2J", r"found '\\x1b\[2J'"),
    "a mark that turns text round": (CAMERA + "\u202eSPHERE", r"unknown keyword '\\u202eSPHERE'"),
    "a polygon of 999,999,999 vertices": (CAMERA + "POLYGON 999999999 (0,0,0)", "for vertex 2, found the end"),
    "a polygon of 10^12 vertices": (CAMERA + "POLYGON 1000000000000 (0,0,0)", "expected a whole number of vertices"),
    "a number of a megabyte": (CAMERA + "SPHERE (0,0,0) " + "1" * 10**6, "expected a number from"),
    "a number of 10^5 digits in a fraction": (CAMERA + "SPHERE (0,0,0) 0." + "0" * 10**5, "expected a number from"),
    "a keyword of a megabyte": (CAMERA + "S" * 10**6, 'expected a keyword, found "SSS'),
    "unclosed, 100,000 deep": (CAMERA + "OR " * DEEP, "expected END for the OR of line 2, found the end"),
    "ends, 100,000 of them": (CAMERA + "END " * DEEP, "END without an OR, AND or NOT"),
    "brackets, a megabyte of them": (CAMERA + "SPHERE " + "(" * 10**6, r'expected a number for the centre, found "\("'),
    "1e308": (CAMERA + "SPHERE (1e308,0,0) 1", r"at most 1e\+30 in size"),
    "1e999": (CAMERA + "SPHERE (1e999,0,0) 1", r"at most 1e\+30 in size"),
    "no number": (CAMERA + "SPHERE (nan,0,0) 1", "expected a finite number"),
    "infinity": (CAMERA + "SPHERE (inf,0,0) 1", "expected a finite number"),
    "many clear solids in one place": (CAMERA + f"{PART}{CLEAR}" * 5000, "more than 63 clear solids touch"),
}


@pytest.mark.parametrize("name", GOOD)
def test_strange_and_good(tried, name):
    found = tried("a.txt", GOOD[name])
    assert not isinstance(found, UserError), found


@pytest.mark.parametrize("name", BAD)
def test_bad(tried, name):
    content, match = BAD[name]
    hostile.refused(lambda: _raised(tried("a.txt", content)), "a.txt", match=match)


@pytest.mark.parametrize(
    ("more", "match"),
    [
        ("p 999999999 0 0 0", "a number for vertex 2, found the end"),
        ("p 1000000000000 0 0 0", "whole number of vertices"),
        ("s 0 0 0 1e308", "for the radius"),
        ("f 1 1 1 1 1 1 nan 1", "expected a finite number for T"),
        ("f 1 1 1 1 1 1 1 1e308", "for the index of refraction"),
        ("c 0 0 0 1 1 1 1 1", r"cones and cylinders \(c\) are not in the light model"),
        ("hither 1", "outside of a viewpoint"),
        ("p 4 0 0 0 4 0 0 nan 1 0 0 4 0", "expected a finite number for vertex 3"),
        ("p 4 0 0 0 4 4 0 4 0 0 0 4 0", "the polygon crosses itself"),
        ("p 4 0 0 0 4 4 0 4 0 0 0 5 0", "the polygon crosses itself"),
        ("p 5 0 0 0 4 0 0 4 4 0 0 0 0 0 4 0", "the polygon touches itself"),
        ("p 4 0 0 0 1e30 0 0 1e29 1e29 0 0 1e30 1e31", "at most 1e"),
        ("\x1b[2J", "expected an entity"),
        ("l " * 100_000, "for the position"),
    ],
)
def test_bad_nff(tried, more, match):
    hostile.refused(lambda: _raised(tried("a.nff", NFF[2] + more)), "a.nff", match=match)


def _outline(points):
    """NFF text of a polygon in a general plane."""
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    return outlines.polygon(np.asarray(points, float) @ turn[:2])


def _smooth(_, count):
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return outlines.ring(angles, 1 + 0.3 * np.cos(5 * angles))


def _slow(count):
    """A dense straight side close to long needles, each of which crosses very many triangles."""
    x = np.arange(count // 4) * 1e-4
    tips, roots = np.stack([x, np.ones(len(x))], axis=1), np.stack([x + 4e-5, np.arange(len(x)) % 7 / 1000], axis=1)
    dense = np.stack([np.full(count // 2, -1e-4), np.linspace(0, 1, count // 2)], axis=1)
    return np.vstack([dense, np.stack([tips, roots], axis=1).reshape(-1, 2), [(99, 0), (99, -1), (-1e-4, -1)]])


MANY = concave.MOST
OUTLINES = {
    "a star": (outlines.star, ""),
    "a gear": (outlines.gear, ""),
    "a comb": (lambda rng, n: outlines.comb(rng, n - 3), ""),
    "a spiral": (outlines.spiral, ""),
    "a monotone one": (lambda rng, n: outlines.monotone(rng, n - 2), ""),
    "a smooth one": (_smooth, ""),
    "a needle": (lambda rng, n: outlines.comb(rng, n - 3) * [1, 1e-4], ""),
    "one that is slow to cut": (lambda rng, n: _slow(n - 3), ""),
    "one that is all but a line": (lambda rng, n: outlines.comb(rng, n - 3) * [1, 1e-12], "on one line|the same point"),
    "points on one line": (lambda rng, n: rng.random((n, 1)) * [[1, 2]], "on one line"),
    "one point": (lambda rng, n: np.ones((n, 2)), "the same point"),
    "four points in any order": (lambda rng, n: rng.integers(0, 2, (n, 2)), "the polygon (crosses|touches) itself"),
    "points anywhere": (lambda rng, n: rng.random((n, 2)), "the polygon crosses itself"),
    "once round, twice": (lambda rng, n: np.tile(outlines.gear(rng, n // 2), (2, 1)), "touches itself; vertices"),
    "a spiral with a hole": (lambda rng, n: outlines.spiral(rng, n - 2)[[*range(n - 2), n // 3, n // 2]], "touches"),
}


@pytest.mark.parametrize("name", OUTLINES)
def test_polygons_of_very_many_vertices(tried, name):
    """As many as are cut; and five times as many, which are refused, whatever is wrong with them."""
    make, match = OUTLINES[name]
    content = NFF[2] + _outline(make(np.random.default_rng(5), MANY))
    if match:
        hostile.refused(lambda: _raised(tried("a.nff", content)), "a.nff", match=match)
    else:
        found = tried("a.nff", content)
        assert not isinstance(found, UserError), found
        assert len(found.objects[-1].triangles) > MANY - 10
    content = NFF[2] + _outline(make(np.random.default_rng(5), 5 * MANY))
    match = "smaller ones|line|same point|itself"
    hostile.refused(lambda: _raised(tried("a.nff", content)), "a.nff", match=match)


@pytest.mark.parametrize("scale", [1e-27, 1e-15, 1e15, 1e29])
def test_concave_polygons_of_any_size(tried, scale):
    for make in outlines.KINDS.values():
        found = tried("a.nff", NFF[2] + _outline(scale * make(np.random.default_rng(5), 60)))
        assert not isinstance(found, UserError), found
        assert found.objects[-1].triangles.size


def _raised(found):
    if isinstance(found, UserError):
        raise found
    return found
