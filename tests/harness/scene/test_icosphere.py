"""The sphere of triangles: a closed surface, outward, in general position, and the file that is committed."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from harness.errors import UserError
from harness.renderer.job import count_shapes
from harness.renderer.parameters import Parameters
from harness.scene import surface
from harness.scene.flatten import flatten
from harness.scene.generate import generated
from harness.scene.generate.icosphere import RADIUS, icosphere, mirror
from harness.scene.mesh.mesh import Files
from harness.scene.needs import needs

PEERS = Path(__file__).parents[3] / "experiments" / "scenes" / "peers"


def edges_of(triangles):
    """(T, 3, 2): the edges as they run round each triangle."""
    return np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)


@pytest.mark.parametrize("size", range(6))
def test_a_closed_sphere(size):
    vertices, triangles = icosphere(size)
    assert (len(vertices), len(triangles), triangles.dtype) == (10 * 4**size + 2, 20 * 4**size, np.int32)
    assert sorted(np.unique(triangles)) == list(range(len(vertices)))
    runs = {tuple(edge) for edge in edges_of(triangles).reshape(-1, 2).tolist()}
    assert len(runs) == 3 * len(triangles)  # none runs twice in one direction
    assert all((b, a) in runs for a, b in runs)  # and each runs once in the other
    assert len(vertices) - len(runs) // 2 + len(triangles) == 2
    assert np.abs(np.linalg.norm(vertices, axis=1) - 1).max() < 4e-16
    assert len(np.unique(vertices.round(9), axis=0)) == len(vertices)


@pytest.mark.parametrize("size", [0, 1, 4])
def test_the_mirror_is_as_a_file_of_it_would_be_read(size, tmp_path, rayrace):
    """Closed and outward, as the reader of meshes finds it; at its radius, to the digits of the file."""
    rayrace("generate", "icosphere", "--size", size, "-o", tmp_path / "sphere.obj", code=0)
    made = mirror(size)
    read, triangles, closed = Files(tmp_path).placed("sphere.obj", made.position, made.rotation, made.scale)
    assert closed and len(triangles) == len(made.triangles)
    assert cKDTree(made.vertices).query(read)[0].max() < 1e-6
    assert np.abs(np.linalg.norm(made.vertices, axis=1) - RADIUS).max() < 2e-15
    assert np.array_equal(surface.outward(made.vertices, made.triangles), made.triangles)
    a, b, c = (made.vertices[corner] for corner in made.triangles.T)
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > 0).all()


@pytest.mark.parametrize("size", [0, 1, 3, 5])
def test_general_position(size):
    """No edge and no normal is along an axis or in a plane of two, and no vertex on one."""
    made = mirror(size)
    a, b, c = (made.vertices[corner] for corner in made.triangles.T)
    edges = made.vertices[edges_of(made.triangles).reshape(-1, 2)]
    for arrows in (edges[:, 1] - edges[:, 0], np.cross(b - a, c - a), made.vertices):
        units = np.abs(arrows / np.linalg.norm(arrows, axis=1, keepdims=True))
        assert units.min() > 1e-6 and units.max() < 1 - 1e-6


def test_the_scene():
    scene = generated.generated("icosphere", size=3)
    arrays = flatten(scene)
    assert arrays["mesh_ranges"].tolist() == [[0, 1280, 1]] and arrays["mesh_ids"].tolist() == [[0, 0]]
    assert needs(scene, Parameters(depth=2)) == ("diffuse", "mesh", "phong", "reflection")
    c, u, v, e = arrays["camera"]
    eye = c + e
    for side, other in ((u, v), (-u, v), (v, u), (-v, u)):
        plane = np.cross(side - e, other)
        plane *= np.sign(plane @ -e) / np.linalg.norm(plane)
        assert ((arrays["mesh_vertices"] - eye) @ plane).min() > 0  # all of it is in view


@pytest.mark.parametrize(
    ("name", "counts"),
    [
        ("comparison", {"objects": 7, "lights": 2}),
        *(("balls", {"size": size}) for size in range(4)),
        *(("tetra", {"size": size}) for size in (1, 2, 4)),
        *(("icosphere", {"size": size}) for size in range(4)),
    ],
)
def test_counts_are_told_without_making_it(name, counts):
    arrays = flatten(generated.generated(name, **counts))
    assert generated.count(name, **counts) == (sum(count_shapes(arrays).values()), len(arrays["lights"]))


def test_the_committed_file(rayrace, tmp_path):
    out = tmp_path / "icosphere.obj"
    rayrace("generate", "icosphere", "-o", out, code=0)
    assert out.read_bytes() == (PEERS / "icosphere.obj").read_bytes()


def test_a_size_that_cannot_be():
    with pytest.raises(UserError, match="expected a size from 0, found -1"):
        icosphere(-1)
