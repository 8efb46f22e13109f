from pathlib import Path

import numpy as np
import pytest

from harness.errors import UserError
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.generate.comparison import comparison
from harness.scene.generate.lattice import MATERIALS, lattice
from harness.scene.needs import needs

COMMITTED = Path(__file__).parents[3] / "experiments" / "scenes" / "comparison.txt"


def test_committed_file_is_what_is_generated():
    assert COMMITTED.read_bytes() == comparison().encode()


def test_study_scene():
    scene = text.read(comparison())
    arrays = flatten(scene)
    grid = [(x, y, z) for z in (-1.2, 0, 1.2) for y in (-1.8, -0.6, 0.6, 1.8) for x in (-1.8, -0.6, 0.6, 1.8)]
    assert arrays["spheres"].tolist() == [[*centre, 0.4] for centre in grid]
    assert arrays["lights"][:, :3].tolist() == [[10, 10, 10], [-10, 8, 8], [0, -10, 6]]
    assert np.all(arrays["materials"][:, 3:] == [1, 30, 0, 0, 0, 1e6, 1, 0])
    assert needs(scene, Parameters(depth=10)) == ("diffuse", "phong", "reflection", "sphere")


def test_camera_is_square_and_at_right_angles():
    c, u, v, e = flatten(text.read(comparison()))["camera"]
    assert not c.any() and u[1] == 0 and v[1] > 0
    assert np.linalg.norm(u) == pytest.approx(np.linalg.norm(v), rel=1e-15)
    assert max(abs(u @ v), abs(u @ e), abs(v @ e)) < 1e-14


@pytest.mark.parametrize("count", [*range(1, 130), 1000, 4097])
def test_any_count_stays_in_view_and_apart(count):
    arrays = flatten(text.read(comparison(spheres=count)))
    centres, radius = arrays["spheres"][:, :3], arrays["spheres"][0, 3]
    assert len(centres) == count
    c, u, v, e = arrays["camera"]
    for side, other in ((u, v), (-u, v), (v, u), (-v, u)):
        plane = np.cross(side - e, other)  # through the eye and one edge of the screen
        plane *= np.sign(plane @ -e) / np.linalg.norm(plane)  # its positive side holds the view
        assert ((centres - c - e) @ plane).min() > radius
    if count > 1:
        gaps = np.linalg.norm(centres[1:] - centres[:-1], axis=1)
        assert gaps.min() > 2.9 * radius


@pytest.mark.parametrize("count", [0, 1, 3, 4, 50])
def test_lights(count):
    lights = flatten(text.read(comparison(lights=count)))["lights"]
    more = flatten(text.read(comparison(lights=51)))["lights"]
    assert lights[:, :3].tolist() == more[:count, :3].tolist()
    if count:
        assert lights[:, 3:6].sum() == pytest.approx(3 * 1.7, rel=2e-2)  # colours are written with 4 digits


def test_empty_and_negative():
    assert text.read(comparison(spheres=0, lights=0)).objects == ()
    with pytest.raises(UserError, match="from 0, found -1 and 3"):
        comparison(spheres=-1)


def test_the_knot_is_closed_and_outward(rayrace, tmp_path):
    """The committed mesh is what the generator writes, and a solid."""
    from harness.scene.mesh.mesh import Files

    out = tmp_path / "knot.obj"
    rayrace("generate", "knot", "-o", out, code=0)
    committed = Path(__file__).parents[3] / "experiments" / "scenes" / "gallery" / "knot.obj"
    assert out.read_text() == committed.read_text()
    vertices, triangles, closed = Files(tmp_path).placed("knot.obj", (0, 0, 0), (0, 0, 0), 1.0)
    assert closed and len(triangles) == 2 * 144 * 16
    a, b, c = (vertices[corner] for corner in triangles.T)
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 > 30


@pytest.mark.parametrize("material", MATERIALS)
def test_the_lattices_of_the_experiments(material):
    file = COMMITTED.with_name("lattice") / f"{material}.txt"
    assert file.read_text(encoding="utf-8") == lattice(material)
    found = text.read(lattice(material, 0.3))
    assert len(found.objects) == 48 and {thing.radius for thing in found.objects} == {0.3}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("lattice", "--material", "wood"), "--material wood: expected one of matte, mirror, perfect, glass"),
        (("lattice", "--radius", "0.5"), "--radius 0.5: expected more than 0 and less than 0.5"),
        (("comparison", "--radius", "0.3"), "--radius is not an option of comparison"),
    ],
)
def test_a_lattice_that_cannot_be(rayrace, words, told):
    assert told in rayrace("generate", *words, code=2).stderr
