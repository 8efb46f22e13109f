"""The exhibit of the study's meshes (TRI-4): what a ray that leaves one loses, and that nothing else is lost."""

import numpy as np
import pytest
from stage import linear
from tessellate import ball, block, obj

EXHIBIT = "python-flat-meshes"
STAGE = "CAMERA (0.3,0.4,3) (1e-9,0,0) (0,1e-9,0) (0,0,1)\nAMBIENT (0.2,0.3,0.1)\n"  # one ray, straight down z
BEHIND = "LIGHT (0.3,0.4,-7) (0.9,0.5,0.7) 0\n"  # beyond the far side of the block
GLASS = "(0.5,0.4,0.3) 0.8 3 (1,1,1) 2.25 1"
PIXEL = {"width": 1, "height": 1, "shadows": True}


@pytest.fixture
def mesh(tmp_path):
    """Makes the scene text of a mesh."""

    def make(shape, material):
        (tmp_path / "mesh.obj").write_text(obj(*shape))
        return f'MESH "{tmp_path / "mesh.obj"}" (0,0,0) (0,0,0) 1 {material}\n'

    return make


def test_the_ray_through_a_block_of_glass(bench, mesh):
    """By hand: at depth 1 it enters with T = 1 - (0.5/2.5)², and at the far side it gets the diffuse light of a light
    right behind, n·l = 1; no highlight, c = l·d - 2 (n·l)(n·d) = -1. In the exhibit only the ambient light is left."""
    scene = STAGE + BEHIND + mesh(block(), GLASS)
    right, flat = (bench.picture(name, scene, depth=1, **PIXEL)[0, 0] for name in ("python", EXHIBIT))
    k_d, ambient, light = linear(0.5, 0.4, 0.3), linear(0.2, 0.3, 0.1), linear(0.9, 0.5, 0.7)
    through = 0.8 * (1 - 0.2**2)
    np.testing.assert_allclose(flat, k_d * ambient * (1 + through), rtol=0, atol=1e-12)
    np.testing.assert_allclose(right - flat, through * k_d * light, rtol=0, atol=1e-12)


def test_only_what_is_seen_through_glass_is_darker(bench, mesh):
    """No pixel is brighter, and where nothing is transmitted the picture is the same to the byte."""
    stage = (
        "CAMERA (0.1,0.2,0) (1.5,0,0) (0,1.5,0) (0.3,0.5,5)\nAMBIENT (0.2,0.3,0.1)\nBACKGROUND (0.2,0.2,0.3)\n"
        "LIGHT (3,4,5) (0.9,0.8,0.7) 0\nLIGHT (-4,2,-5) (0.5,0.6,0.7) 0\n"
    )
    size = {"width": 24, "height": 20, "depth": 3, "shadows": True}
    for material, same in ((GLASS, False), (GLASS.replace("(1,1,1)", "(0,0,0)"), True)):
        scene = stage + mesh(ball(2), material)
        right, flat = (bench.picture(name, scene, **size) for name in ("python", EXHIBIT))
        lost = right - flat
        print(f"{material}: at most {lost.max():.3f} of {right.max():.3f}, in {(lost > 1e-9).any(axis=-1).mean():.0%}")
        assert (lost.max() == 0) == same and lost.min() >= -1e-12


def test_other_shapes_and_open_meshes_are_as_they_are(bench, tmp_path):
    vertices, triangles = block()
    (tmp_path / "open.obj").write_text(obj(vertices, triangles[1:]))
    scene = STAGE.replace("1e-9", "1.5") + BEHIND + f"SPHERE (0.4,0.2,-1) 1.2 {GLASS}\n"
    scene += f'MESH "{tmp_path / "open.obj"}" (0,0,0) (0,0,0) 1 {GLASS}\n'
    size = {"width": 16, "height": 12, "depth": 3, "shadows": True}
    right, flat = (bench.picture(name, scene, **size) for name in ("python", EXHIBIT))
    np.testing.assert_array_equal(right, flat)
