"""Meshes: as the shapes they tessellate, without cracks, and the same with a hierarchy as without (TRI, HIT-6)."""

import numpy as np
import pytest
from random_scenes import random_rays, random_scene, words
from stage import turned
from tessellate import ball, block, obj

MATTE = "(0.7,0.5,0.3) 0.3 20 (0,0,0) 9 1"
GLASS = "(0,0,0) 1 20 (0.8,0.9,0.7) 2.25 1"
STAGE = """CAMERA (0.05,0.1,0) (1.1,0,0) (0,1.1,0) (0.2,0.1,3)
LIGHT (3.1,4.2,5.3) (0.8,0.7,0.6) 0
AMBIENT (0.2,0.3,0.2)
BACKGROUND (0.3,0.5,0.7)
"""


@pytest.fixture
def mesh(tmp_path):
    """Writes an OBJ file; the word for it in scene text."""

    def write(vertices, triangles, name="mesh.obj"):
        path = tmp_path / name
        path.write_text(obj(vertices, triangles))
        return f'MESH "{path}"'

    return write


@pytest.mark.parametrize("material", [MATTE, GLASS], ids=["opaque", "glass"])
def test_a_tessellated_box_is_the_box(bench, serial, mesh, material):
    """Pictures of a block of 12 triangles and of the BOX, inside and outside of glass, shadows included."""
    turn = turned(np.random.default_rng(8))
    corner, edges = np.array([-0.31, -0.42, -1.13]), turn @ np.diag([0.9, 0.8, 1.1])
    vertices, triangles = block()
    source = mesh(corner + vertices @ edges.T, triangles) + f" (0,0,0) (0,0,0) 1 {material}\n"
    box = f"BOX {words(corner)} {' '.join(words(edge) for edge in edges.T)} {material}\n"
    jobs = {"width": 24, "height": 24, "depth": 4, "shadows": True}
    pictures = [bench.result(serial, STAGE + shape, **jobs) for shape in (source, box)]
    np.testing.assert_allclose(pictures[0].array, pictures[1].array, rtol=0, atol=1e-11)
    assert pictures[0].said.rays == pictures[1].said.rays


def test_position_angles_and_scale(bench, serial, mesh):
    """T Rx Ry Rz S: the vertices where a closed form puts them, hit in their middle."""
    vertices, triangles = block()
    scene = mesh(vertices, triangles) + f" (0.3,-0.2,0.7) (31,-47,112) 1.7 {MATTE}\n"
    x, y, z = np.radians([31, -47, 112])
    rx = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    ry = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    rz = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    place = (np.array([0.3, -0.2, 0.7]) + 1.7 * vertices @ (rx @ ry @ rz).T)[triangles]
    middle = place.mean(axis=1)
    normal = np.cross(place[:, 1] - place[:, 0], place[:, 2] - place[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    rays = np.hstack(
        [middle + 3 * normal + 0.2 * np.roll(normal, 1, axis=1), -3 * normal - 0.2 * np.roll(normal, 1, 1)]
    )
    hits = bench.hits(serial, STAGE + scene, rays)
    np.testing.assert_allclose(hits[:, 1:4], middle, rtol=0, atol=1e-12)
    np.testing.assert_allclose(hits[:, 4:7], normal, rtol=0, atol=1e-12)


@pytest.mark.parametrize("reverse", [False, True])
def test_normals_point_out_however_the_file_turns_its_triangles(bench, serial, mesh, reverse):
    vertices, triangles = ball(1)
    rng = np.random.default_rng(3)
    triangles = np.array([t[::-1] if reverse and rng.random() < 0.5 else t for t in triangles])
    inside = random_rays(rng, 60)[:, 3:]
    rays = np.hstack([np.zeros((60, 3)), inside])
    hits = bench.hits(serial, STAGE + mesh(vertices, triangles) + f" (0,0,0) (0,0,0) 1 {MATTE}\n", rays)
    assert (np.einsum("ij,ij->i", hits[:, 4:7], inside) > 0).all()


def test_an_open_mesh_turns_its_normals_to_the_ray(bench, serial, mesh):
    vertices, triangles = block()
    rng = np.random.default_rng(3)
    rays = np.hstack([np.tile([0.5, 0.51, 0.52], (80, 1)), rng.normal(size=(80, 3))])
    hits = bench.hits(serial, STAGE + mesh(vertices, triangles[:-1]) + f" (0,0,0) (0,0,0) 1 {MATTE}\n", rays)
    hit = np.isfinite(hits[:, 0])
    assert 20 < hit.sum() < 80
    assert (np.einsum("ij,ij->i", hits[hit, 4:7], rays[hit, 3:]) < 0).all()


@pytest.mark.parametrize("accel", ["none", "bvh"])
@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_no_crack_on_edges_and_vertices(bench, serial, mesh, accel, precision):
    """Rays from inside a closed mesh, aimed at its edges and vertices: every one hits (S10)."""
    rng = np.random.default_rng(12)
    print("seed 12")
    vertices, triangles = ball(2)
    vertices = (vertices * rng.uniform(1, 1.3, (len(vertices), 1))) @ turned(rng).T
    place = vertices[triangles]
    count = bench.by_speed(serial, 1500, 20000)
    which = rng.integers(0, len(place), count)
    share = rng.random((count, 1))
    aim = place[which, 0] * share + place[which, 1] * (1 - share)
    aim[::4] = place[which[::4], 2]
    origins = rng.uniform(-0.3, 0.3, (count, 3))
    scene = STAGE + mesh(vertices, triangles) + f" (0,0,0) (0,0,0) 1 {MATTE}\n"
    hits = bench.hits(serial, scene, np.hstack([origins, aim - origins]), precision, accel=accel)
    assert np.isfinite(hits[:, 0]).all(), f"{np.isinf(hits[:, 0]).mean():.2%} through cracks"


@pytest.mark.parametrize("seed", [31, 32])
def test_the_hierarchy_answers_as_trying_all(bench, serial, mesh, seed):
    """Hit for hit, over all kinds of shapes, coplanar ties and axis-parallel rays included (HIT-2, HIT-6)."""
    print("seed", seed)
    rng = np.random.default_rng(seed)
    scene = random_scene(rng, 12, 12, 12, 12, material=lambda _: MATTE, rest=STAGE)
    for name in "ab":
        place = f"{words(rng.uniform(-2, 2, 3))} {words(rng.uniform(0, 360, 3))} {rng.uniform(0.3, 0.8)}"
        scene += mesh(*ball(2), f"{name}.obj") + f" {place} {MATTE}\n"
    same = f"BOX (0.5,0.5,-0.5) (1,0,0) (0,1,0) (0,0,1) {MATTE}\n"
    scene += same + same + "POLYGON 4 (0.5,0.5,0.5) (1.5,0.5,0.5) (1.5,1.5,0.5) (0.5,1.5,0.5) " + MATTE + "\n"
    scene += f"OR SPHERE (-1,-1,1) 0.5 BOX (-1,-1,1) (1,0,0) (0,1,0) (0,0,1) END {MATTE}\n"
    scene += mesh(*block(), "c.obj") + f" (0.5,0.5,-0.5) (0,0,0) 1 {MATTE}\n"
    rays = random_rays(rng, bench.by_speed(serial, 1200, 6000))
    rays[::5, 3:] = np.eye(3)[rng.integers(0, 3, len(rays[::5]))] * rng.choice([-1, 1], (len(rays[::5]), 1))
    rays[::10, :3] = np.round(rays[::10, :3] * 2) / 2
    answers = [bench.hits(serial, scene, rays, accel=accel) for accel in ("none", "bvh")]
    assert answers[0].tobytes() == answers[1].tobytes()


@pytest.mark.slow
def test_pictures_with_and_without_a_hierarchy(bench, serial, mesh):
    scene = STAGE + mesh(*ball(3)) + f" (0,0,-0.5) (10,20,30) 0.8 {GLASS}\n"
    scene += f"SPHERE (0.3,0.4,-3) 1.1 {MATTE}\n"
    jobs = {"width": 10, "height": 10, "depth": 4, "shadows": True}
    pictures = [bench.picture(serial, scene, accel=accel, **jobs) for accel in ("none", "bvh")]
    assert pictures[0].tobytes() == pictures[1].tobytes()


def test_a_fine_ball_is_nearly_a_sphere(bench, serial, mesh):
    """Its hits lie within the sagitta of its triangles under the sphere's."""
    vertices, triangles = ball(4)
    place = vertices[triangles]
    longest = np.linalg.norm(place - np.roll(place, 1, axis=1), axis=2).max()
    rng = np.random.default_rng(5)
    directions = rng.normal(size=(200, 3))
    rays = np.hstack([-3 * directions / np.linalg.norm(directions, axis=1, keepdims=True), directions])
    hits = bench.hits(serial, STAGE + mesh(vertices, triangles) + f" (0,0,0) (0,0,0) 1 {MATTE}\n", rays)
    assert (hits[:, 0] >= 2).all() and (hits[:, 0] < 2 + longest**2 / 2).all()
