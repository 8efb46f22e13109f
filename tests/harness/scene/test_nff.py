"""The reader of NFF, Haines' format."""

import re

import numpy as np
import pytest

from harness.errors import UserError
from harness.renderer.parameters import Parameters
from harness.scene import load, nff
from harness.scene.flatten import flatten
from harness.scene.needs import needs

VIEW = "v\nfrom 0 0 8\nat 0 0 0\nup 0 1 0\nangle 90\nhither 1\nresolution 512 512\n"
FILL = "f 1 0.5 0.25 0.8 0.3 17 0 0\n"


def arrays(content):
    return flatten(nff.read(content))


def test_all_entities():
    found = arrays(
        "# a comment\nb 0.1 0.2 0.3\n" + VIEW + "l 1 2 3 0.5 0.25 1\nl 4 5 6\n" + FILL + "s 1 2 3 0.5 # more\n"
        "p 3\n0 0 0\n1 0 0\n0 1 0\nf 1 1 1 0.1 0.2 9 0.7 1.5\ns -1 -2 -3 2\n"
        "pp 4\n0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n0 1 0 0 0.6 0.8\n"
    )
    assert found["background"] == pytest.approx([0.1, 0.2, 0.3], rel=1e-15)
    half = np.sqrt(2) / 4
    assert found["lights"].tolist() == [
        pytest.approx([1, 2, 3, 0.5, 0.25, 1, 0], rel=1e-15),
        pytest.approx([4, 5, 6, half, half, half, 0], rel=1e-15),
    ]
    assert found["materials"].tolist() == [
        pytest.approx([0.8, 0.4, 0.2, 0.3, 17, 0, 0, 0, 1e6, 1, 0], rel=1e-15),
        pytest.approx([0.1, 0.1, 0.1, 0.7, 9, 1, 1, 1, 2.25, 1, 0], rel=1e-15),
    ]
    assert found["spheres"].tolist() == [[1, 2, 3, 0.5], [-1, -2, -3, 2]]
    assert found["sphere_ids"].tolist() == [[0, 0], [2, 1]]
    assert found["polygon_ids"].tolist() == [[1, 0], [3, 1]]
    assert found["polygon_ranges"].tolist() == [[0, 3], [3, 4]]
    assert found["polygon_vertices"][3:].tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert not found["ambient"].any() and found["air"].tolist() == [1, 1, 1, 1, 1]


@pytest.mark.parametrize("count", [1, 2, 3, 9])
def test_lights_without_a_colour(count):
    lights = arrays(VIEW + "l 1 2 3\n" * count)["lights"]
    assert lights[:, 3:6] == pytest.approx(np.sqrt(count) / (2 * count), rel=1e-14)


def test_camera_of_a_plain_view():
    c, u, v, e = arrays(VIEW)["camera"]
    assert (c + e).tolist() == [0, 0, 8] and e.tolist() == [0, 0, 1]
    assert u == pytest.approx([1, 0, 0], abs=1e-15) and v == pytest.approx([0, 1, 0], abs=1e-15)


@pytest.mark.parametrize("seed", range(10))
def test_camera(seed):
    """`at` is in the middle, `up` points up, and the half-angle is that of the screen's edges."""
    rng = np.random.default_rng(seed)
    eye, at, up, angle = *rng.normal(0, 5, (3, 3)), rng.uniform(1, 170)
    words = [" ".join(map(repr, vector.tolist())) for vector in (eye, at, up)]
    view = f"v from {words[0]} at {words[1]} up {words[2]} angle {angle!r} hither 0.1 resolution 9 9"
    c, u, v, e = arrays(view)["camera"]
    ahead = (at - eye) / np.linalg.norm(at - eye)
    assert c + e == pytest.approx(eye, rel=1e-14)
    assert -e / np.linalg.norm(e) == pytest.approx(ahead, rel=1e-14)
    assert max(abs(u @ v), abs(u @ e), abs(v @ e)) < 1e-12 * np.linalg.norm(u)
    assert v @ up > 0 and abs(u @ up) < 1e-12 * np.linalg.norm(u)
    assert np.linalg.det([u, v, e]) > 0  # as u to the right, v up, e to the viewer
    for side in (u, v):
        assert np.degrees(np.arctan(np.linalg.norm(side) / np.linalg.norm(e))) == pytest.approx(angle / 2, rel=1e-12)


@pytest.mark.parametrize(
    ("k_s", "t", "index", "expected", "features"),
    [
        ("0", "0", "0", [0, 0, 1e6], ""),
        ("0.5", "0", "1.5", [0.5, 0, 1e6], "phong reflection"),
        ("0", "1", "1", [1, 1, 1], "phong reflection transmission"),
        ("0.2", "0.8", "1.5", [0.8, 1, 2.25], "phong reflection transmission"),
        ("0.8", "0.2", "2", [0.8, 1, 4], "phong reflection transmission"),
    ],
)
def test_materials(k_s, t, index, expected, features):
    scene = nff.read(VIEW + f"l 9 9 9\nf 1 1 1 1 {k_s} 3 {t} {index}\ns 0 0 0 1")
    material = flatten(scene)["materials"][0]
    assert material[[3, 5, 8]].tolist() == expected and len(set(material[5:8])) == 1
    assert set(needs(scene, Parameters(depth=1))) == {"diffuse", "sphere", *features.split()}


def test_load(tmp_path):
    path = tmp_path / "a.NFF"
    path.write_bytes((VIEW + FILL + "s 0 0 0 1\n").replace("\n", "\r\n").encode())
    assert len(load(path).objects) == 1


BOW_TIE = "0 0 0\n4 4 0\n4 0 0\n0 4 0"
BRIDGED = "0 0 0\n4 0 0\n3 1 0\n3 3 0\n1 3 0\n3 1 0\n4 0 0\n4 4 0\n2 5 0\n0 4 0"
FAULTS = [
    ("", "1:1", "the file is empty"),
    ("b 0 0 0", "1:8", "expected a viewpoint (v), found the end of the file"),
    (VIEW + VIEW, "8:1", "a second viewpoint (v); keep one of them"),
    ("b 0 0 0\nb 0 0 0", "2:1", "a second background (b)"),
    ("b 0 0 -1", "1:7", "a number from 0 to 1e+30 for the background"),
    (VIEW + "s 0 0 0 1", "8:1", '"s" before the first material (f)'),
    (VIEW + FILL + "c\n0 0 0 1\n1 1 1 0", "9:1", "cones and cylinders (c) are not in the light model"),
    (VIEW + FILL + "q 1", "9:1", 'expected an entity, found "q"; an NFF file has v, b, l, f, s, p, pp, c'),
    (VIEW + FILL + "s 0 0 0 -1", "9:9", "for the radius"),
    (VIEW + FILL + "s 0 0 0\ns 0 0 0 1", "10:1", 'expected a number for the radius, found "s"'),
    (VIEW + FILL + "s 0 0 nan 1", "9:7", "expected a finite number for the centre"),
    (VIEW + FILL + "p 2\n0 0 0\n1 0 0", "9:3", "expected a whole number of vertices, 3 or more"),
    (VIEW + FILL + "p 3\n0 0 0\n1 0 0\n2 0 0", "10:1", "the vertices lie on one line"),
    (
        VIEW + FILL + "hither 1",
        "9:1",
        '"hither" outside of a viewpoint; a viewpoint is v from at up angle hither resolution, in this order',
    ),
    (VIEW + FILL + "p 3\n0 0 0\n0 0 0\n1 0 0", "11:1", "vertices 1 and 2 are the same point"),
    (VIEW + FILL + f"p 4\n{BOW_TIE}", "10:1", "the polygon crosses itself"),
    (VIEW + FILL + "p 4\n0 0 0\n4 3 0\n4 0 0\n0 4 0", "12:1", "crosses itself; the sides after vertices 1 and 3 meet"),
    (VIEW + FILL + f"p 10\n{BRIDGED}", "16:1", "touches itself; vertices 2 and 7 are the same point"),
    (
        VIEW + FILL + "p 5\n0 0 0\n4 0 0\n4 4 0\n2 0 0\n0 4 0",
        "10:1",
        "the side after vertex 1 passes through another vertex",
    ),
    (VIEW + FILL + "p 4\n0 0 0\n4 0 0\n2 0 0\n2 2 0", "10:1", "the side after vertex 1 passes through another vertex"),
    (VIEW + FILL + "p 5\n0 0 0\n4 0 0\n4 4 0\n2 1 0.01\n0 4 0", "12:1", "the polygon is not planar; vertex 3"),
    (VIEW + FILL + "pp 3\n0 0 0 0 0 1\n1 0 0\n0 1 0", "12:6", "expected a number for vertex 3, found the end"),
    (VIEW + "f 1 1 1 1 1 1 1 0", "8:17", 'expected an index of refraction for a material with T > 0, found "0"'),
    (VIEW + "f 1 1 1 1 1 1 1", "8:16", "the index of refraction, found the end"),
    (VIEW + "f 1 1 1 1 1 -1 0 0", "8:13", "for Shine"),
    (VIEW + "l 1 2 3 1", "8:10", "expected a number for the colour"),
    (VIEW.replace("at 0 0 0", "at 0 0 8"), "3:4", "from and at are the same point"),
    (VIEW.replace("up 0 1 0", "up 0 0 1"), "4:4", "up has no part across the view"),
    (VIEW.replace("up 0 1 0", "up 0 0 0"), "4:4", "up has no part across the view"),
    (VIEW.replace("angle 90", "angle 180"), "5:7", "an angle between 0 and 180 degrees"),
    (VIEW.replace("angle 90\n", ""), "5:1", 'expected "angle" in the viewpoint, found "hither"'),
    ("v (0,0,0)", "1:3", 'expected "from" in the viewpoint, found "("'),
]


@pytest.mark.parametrize(("content", "place", "message"), FAULTS)
def test_faults(content, place, message):
    with pytest.raises(UserError, match=re.escape(message)) as caught:
        nff.read(content, "a.nff")
    assert str(caught.value).startswith(f"a.nff:{place}: ")
