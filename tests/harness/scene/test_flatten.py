"""The arrays against the table of renderers/README.md."""

import re
from pathlib import Path

import numpy as np
import pytest

from harness.picture import colour
from harness.renderer import sobol
from harness.scene import load, text
from harness.scene.flatten import flatten

ROOT = Path(__file__).parents[3]
CAMERA = "CAMERA (1,2,3) (4,0,0) (0,5,0) (0,0,6)\n"
SCENE = (
    CAMERA
    + """
AIR 1.5 2 (0.9,0.8,0.7)
AMBIENT (0.5,0.02,1)
BACKGROUND (0,0.5,1)
LIGHT (1,2,3) (0.5,1,0) 0.25
SPHERE (1,2,3) 4                                        (0.5,0,1) 0.3 50 (0,0.5,1) 2.25 1.5 0.125
POLYGON 3 (0,0,0) (1,0,0) (0,1,0)                       (1,1,1) 0 1 (0,0,0) 1e6 1
BOX (1,2,3) (4,0,0) (0,5,0) (0,0,6)                     (0.5,0,1) 0.3 50 (0,0.5,1) 2.25 1.5 0.125
POLYGON 4 (0,0,7) (1,0,7) (1,1,7) (0,1,7)               (1,1,1) 0 1 (0,0,0) 1e6 1 0
ELLIPSOID (1,2,3) (4,0,0) (0,5,0) (0,0,6)               (0,0,0) 0 1 (0,0,0) 1e6 1
SPHERE (9,9,9) 1                                        (0,0,0) 0 1 (0,0,0) 1e6 1
AND SPHERE (9,9,9) 3 NOT OR BOX (1,2,3) (4,0,0) (0,5,0) (0,0,6) SPHERE (1,2,3) 4
  ELLIPSOID (1,2,3) (4,0,0) (0,5,0) (0,0,6) END END END (0,0,0) 0 1 (0,0,0) 1e6 1
OR SPHERE (9,9,9) 3 END                                 (0,0,0) 1 1 (1,1,1) 1e6 1
"""
)
HALF = 0.21404114048223255


def contract():
    """Name, dtype and shape of every array in the README that is not the list of rays."""
    readme = (ROOT / "renderers" / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`\w+\.npy`[^|]*)\| (\w+) (\(.+?\)) \|", readme, re.M)
    found = {}
    for names, dtype, shapes in rows:
        names, shapes = re.findall(r"`(\w+)\.npy`", names), re.findall(r"\((.+?)\)", shapes)
        for name, shape in zip(names, shapes if len(shapes) > 1 else shapes * len(names), strict=True):
            sizes = [int(n) if n.isdigit() else None for n in re.split(r",\s*", shape) if n]
            found[name] = (dtype, sizes)
    del found["rays"]
    return found


@pytest.mark.parametrize("content", [CAMERA, SCENE, (ROOT / "experiments/scenes/local.txt").read_text()])
def test_arrays_are_those_of_the_contract(content, tmp_path):
    arrays = {**flatten(text.read(content)), "sobol": sobol.matrices()}  # which every job has
    expected = contract()
    assert len(expected) == 29
    assert arrays.keys() == expected.keys()
    for name, (dtype, sizes) in expected.items():
        array = arrays[name]
        assert array.dtype == np.dtype(dtype).newbyteorder("<"), name
        assert array.flags.c_contiguous
        assert len(array.shape) == len(sizes), name
        assert all(n is None or n == m for n, m in zip(sizes, array.shape, strict=True)), name
        np.save(tmp_path / "a.npy", array)
        assert (tmp_path / "a.npy").read_bytes()[:8] == b"\x93NUMPY\x01\x00"


def test_values():
    arrays = {name: array.tolist() for name, array in flatten(text.read(SCENE)).items()}
    frame = [1, 2, 3, 4, 0, 0, 0, 5, 0, 0, 0, 6]
    assert np.ravel(arrays["camera"]).tolist() == frame
    assert arrays["air"] == [1.5, 2, 0.9, 0.8, 0.7]
    assert arrays["ambient"] == pytest.approx([HALF, 0.02 / 12.92, 1], rel=1e-15)
    assert arrays["background"] == pytest.approx([0, HALF, 1], rel=1e-15)
    assert arrays["lights"] == [pytest.approx([1, 2, 3, HALF, 1, 0, 0.25], rel=1e-15)]
    assert arrays["materials"] == [
        pytest.approx([HALF, 0, 1, 0.3, 50, 0, 0.5, 1, 2.25, 1.5, 0.125], rel=1e-15),
        pytest.approx([1, 1, 1, 0, 1, 0, 0, 0, 1e6, 1, 0], rel=1e-15),
        pytest.approx([0, 0, 0, 0, 1, 0, 0, 0, 1e6, 1, 0], rel=1e-15),
        pytest.approx([0, 0, 0, 1, 1, 1, 1, 1, 1e6, 1, 0], rel=1e-15),
    ]
    assert arrays["spheres"] == [[1, 2, 3, 4], [9, 9, 9, 1]]
    assert arrays["boxes"] == arrays["ellipsoids"] == [frame]
    assert arrays["polygon_vertices"][3] == [0, 0, 7]
    assert arrays["polygon_ranges"] == [[0, 3], [3, 4]]
    assert arrays["sphere_ids"] == [[0, 0], [5, 2]]
    assert arrays["polygon_ids"] == [[1, 1], [3, 1]]
    assert arrays["box_ids"] == [[2, 0]]
    assert arrays["ellipsoid_ids"] == [[4, 2]]
    assert arrays["csg_ids"] == [[6, 2], [7, 3]]
    assert arrays["csg_spheres"] == [[9, 9, 9, 3], [1, 2, 3, 4], [9, 9, 9, 3]]
    assert arrays["csg_boxes"] == arrays["csg_ellipsoids"] == [frame]
    assert arrays["csg_code"] == [[0, 0], [1, 0], [0, 1], [4, 0], [2, 0], [4, 0], [6, 0], [5, 0], [0, 2]]
    assert arrays["csg_ranges"] == [[0, 8], [8, 1]]
    assert arrays["mesh_ids"] == arrays["mesh_ranges"] == arrays["mesh_vertices"] == arrays["csg_meshes"] == []
    # The first sphere, the last solid and the box are clear, each smaller than the one before. None holds the eye:
    # (1, 2, 9) is on the box, which is not in it.
    assert arrays["media"] == [[0, 0, 0], [7, 3, 0], [2, 0, 0]]


def test_meshes(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "b.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    matt, glass = "(1,1,1) 0 1 (0,0,0) 1e6 1", "(1,1,1) 1 1 (1,1,1) 1e6 1"
    (tmp_path / "scene.txt").write_text(
        f"{CAMERA}MESH b.obj (5,0,0) (0,0,0) 2 {matt}\nMESH a.obj (0,0,0) (0,0,0) 1 {glass}\n"
        f"SPHERE (9,9,9) 1 {matt}\nMESH b.obj (0,0,0) (0,0,0) 1 {glass}\n"
    )
    arrays = flatten(load(tmp_path / "scene.txt"))
    assert arrays["mesh_ranges"].tolist() == [[0, 4, 1], [4, 1, 0], [5, 4, 1]]
    assert arrays["mesh_ids"].tolist() == [[0, 0], [1, 1], [3, 1]]
    corners = arrays["mesh_vertices"][arrays["mesh_triangles"]]
    assert corners.shape == (9, 3, 3) and len(arrays["mesh_vertices"]) == 4 + 3 + 4
    assert corners[:4].reshape(-1, 3).min(axis=0).tolist() == [5, 0, 0]
    assert np.array_equal(corners[:4], 2 * corners[5:] + [5, 0, 0])
    centre = np.array([0.25, 0.25, 0.25])
    for a, b, c in corners[5:]:
        assert np.cross(b - a, c - a) @ (a - centre) > 0
    assert arrays["media"].tolist() == [[3, 1, 0]]  # the open one has no inside


def test_srgb_arithmetic_leaves_colours_as_they_are_written():
    linear, srgb = flatten(text.read(SCENE)), flatten(text.read(SCENE), "srgb")
    assert srgb["materials"][0, :3].tolist() == [0.5, 0, 1]
    assert srgb["lights"][0, 3:6].tolist() == [0.5, 1, 0]
    assert (srgb["ambient"].tolist(), srgb["background"].tolist()) == ([0.5, 0.02, 1], [0, 0.5, 1])
    for name in linear.keys() - {"materials", "lights", "ambient", "background"}:
        assert np.array_equal(linear[name], srgb[name])
    assert np.array_equal(linear["materials"][:, 3:], srgb["materials"][:, 3:])
    with pytest.raises(KeyError):
        flatten(text.read(SCENE), "gamma")


def test_colours_survive_encoding():
    scene = load(ROOT / "experiments/scenes/comparison.txt")
    arrays = flatten(scene)
    written = np.array([thing.material.diffuse for thing in scene.objects])
    rows = arrays["sphere_ids"][:, 1]
    assert np.abs(colour.encode(arrays["materials"][rows, :3]) - written).max() < 3e-8
