"""The arrays against the table of renderers/README.md."""

import re
from pathlib import Path

import numpy as np
import pytest

from harness import colour
from harness.scene import load, text
from harness.scene.flatten import flatten

ROOT = Path(__file__).parents[2]
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
"""
)
HALF = 0.21404114048223255


def contract():
    """Name, dtype and shape of every array in the README that is not the list of rays."""
    readme = (ROOT / "renderers" / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`\w+\.npy`[^|]*)\| (\w+) \((.+?)\) \|", readme, re.M)
    found = {}
    for names, dtype, shape in rows:
        for name in re.findall(r"`(\w+)\.npy`", names):
            sizes = [int(n) if n.isdigit() else None for n in re.split(r",\s*", shape) if n]
            found[name] = (dtype, sizes)
    del found["rays"]
    return found


@pytest.mark.parametrize("content", [CAMERA, SCENE, (ROOT / "experiments/scenes/local.txt").read_text()])
def test_arrays_are_those_of_the_contract(content, tmp_path):
    arrays = flatten(text.read(content))
    expected = contract()
    assert len(expected) == 15
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
    ]
    assert arrays["spheres"] == [[1, 2, 3, 4], [9, 9, 9, 1]]
    assert arrays["boxes"] == arrays["ellipsoids"] == [frame]
    assert arrays["polygon_vertices"][3] == [0, 0, 7]
    assert arrays["polygon_ranges"] == [[0, 3], [3, 4]]
    assert arrays["sphere_ids"] == [[0, 0], [5, 2]]
    assert arrays["polygon_ids"] == [[1, 1], [3, 1]]
    assert arrays["box_ids"] == [[2, 0]]
    assert arrays["ellipsoid_ids"] == [[4, 2]]


def test_colours_survive_encoding():
    scene = load(ROOT / "experiments/scenes/comparison.txt")
    arrays = flatten(scene)
    written = np.array([thing.material.diffuse for thing in scene.objects])
    rows = arrays["sphere_ids"][:, 1]
    assert np.abs(colour.encode(arrays["materials"][rows, :3]) - written).max() < 3e-8
