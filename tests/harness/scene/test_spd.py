"""Generated balls and tetra: counts, tangencies and symmetries that their description promises."""

import numpy as np
import pytest

from harness.errors import UserError
from harness.renderer.parameters import Parameters
from harness.scene import load, nff
from harness.scene.flatten import flatten
from harness.scene.generate.spd import _turned, balls, tetra
from harness.scene.needs import needs


@pytest.mark.parametrize("size", range(5))
def test_balls(size):
    scene = nff.read(balls(size))
    arrays = flatten(scene)
    spheres = arrays["spheres"]
    assert len(spheres) == sum(9**k for k in range(size + 1)) and len(arrays["polygon_ids"]) == 1
    assert spheres[0].tolist() == [0, 0, 0, 0.5]
    radii = np.array([0.5 / 3**k for k in range(size + 1)])
    level = np.abs(spheres[:, 3:] - radii).argmin(axis=1)
    assert np.bincount(level).tolist() == [9**k for k in range(size + 1)]
    # Depth first, so that the parent of a sphere is the last one before it that is a level up.
    last = {}
    for row, k in zip(spheres, level, strict=True):
        if k:
            parent = last[k - 1]
            assert np.linalg.norm(row[:3] - parent[:3]) == pytest.approx(row[3] + parent[3], rel=1e-7)
        last[k] = row
    expected = {"diffuse", "phong", "polygon", "reflection", "shadows", "sphere"}
    assert set(needs(scene, Parameters(depth=5, shadows=True))) == expected


def test_balls_stand_upright_on_their_parents():
    """The nine of a sphere: six at a right angle to the direction it grew in, three above, all 60 degrees apart."""
    spheres = flatten(nff.read(balls(2)))["spheres"][:, :3]
    children = np.arange(1, 91, 10)  # of the first; each is followed by its own nine
    families = [(0, children, np.array([0, 0, 1.0]))]
    families += [(i, np.arange(i + 1, i + 10), spheres[i] / np.linalg.norm(spheres[i])) for i in children]
    for parent, nine, up in families:
        places = spheres[nine] - spheres[parent]
        places /= np.linalg.norm(places, axis=1)[:, None]
        assert np.sort(places @ up) == pytest.approx([0] * 6 + [np.sqrt(2 / 3)] * 3, abs=1e-7)
        assert (places @ places.T)[~np.eye(9, dtype=bool)].max() == pytest.approx(0.5, abs=1e-7)


def test_turning():
    """As the shortest turn does; straight down is a half turn about y, as in the published files."""
    rng = np.random.default_rng(2)
    print("seed 2")
    assert _turned((1, 2, 3), (0, 0, 1)) == (1, 2, 3) and _turned((1, 2, 3), (0, 0, -1)) == (-1, 2, -3)
    for up in rng.normal(size=(50, 3)):
        up /= np.linalg.norm(up)
        axis = np.cross([0, 0, 1], up) / np.hypot(*up[:2])
        frame, turned = np.eye(3), np.array([_turned(column, up) for column in np.eye(3)])
        assert turned @ turned.T == pytest.approx(frame, abs=1e-14) and np.linalg.det(turned) > 0
        assert turned[2] == pytest.approx(up, abs=1e-14) and axis @ turned == pytest.approx(axis, abs=1e-14)


@pytest.mark.parametrize("size", range(1, 6))
def test_tetra(size):
    scene = nff.read(tetra(size))
    vertices = flatten(scene)["polygon_vertices"].reshape(-1, 3, 3)
    assert len(vertices) == 4**size
    edges = np.linalg.norm(vertices - np.roll(vertices, 1, axis=1), axis=2)
    assert edges == pytest.approx(np.sqrt(8) / 2 ** (size - 1), rel=1e-12)
    assert np.unique(vertices.reshape(-1, 3), axis=0).shape[0] == 2 * 4 ** (size - 1) + 2
    assert len(np.unique(np.sort(vertices, axis=1), axis=0)) == 4**size  # no side twice
    assert np.abs(vertices).max() == 1
    assert needs(scene, Parameters(depth=5, shadows=True)) == ("diffuse", "polygon", "shadows")


def test_sizes():
    assert balls() == balls(4) and tetra() == tetra(6)
    for make, size, least in ((balls, -1, 0), (tetra, 0, 1)):
        with pytest.raises(UserError, match=f"expected a size factor from {least}, found {size}"):
            make(size)


@pytest.mark.parametrize("name", ["balls", "tetra"])
def test_command(name, rayrace, tmp_path):
    rayrace("generate", name, "--size", 2, "-o", tmp_path / "a.nff", code=0)
    make = {"balls": balls, "tetra": tetra}[name]
    assert (tmp_path / "a.nff").read_text() == make(2) == rayrace("generate", name, "--size", 2, code=0).stdout
    assert load(tmp_path / "a.nff") == nff.read(make(2))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("balls", "--spheres", "3"), "--spheres is not an option of balls"),
        (("tetra", "--lights", "3"), "--lights is not an option of tetra"),
        (("comparison", "--size", "3"), "--size is not an option of comparison"),
        (("tetra", "--size", "0"), "expected a size factor from 1, found 0"),
        (("tetra", "-o", "a.txt"), "a.txt: tetra is written as .nff"),
        (("comparison", "-o", "a.nff"), "a.nff: comparison is written as .txt"),
    ],
)
def test_wrong_use_of_the_command(words, message, rayrace, tmp_path):
    assert message in rayrace("generate", *words, cwd=tmp_path, code=2).stderr
