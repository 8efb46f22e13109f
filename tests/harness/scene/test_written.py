"""Scenes written as text read as the same scenes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import seeds
from random_scenes import random_material, random_scene, random_stage

from harness.scene import load
from harness.scene.model import Csg, Mesh, Operator
from harness.scene.text import read
from harness.scene.written import write

SCENES = Path(__file__).parents[3] / "experiments" / "scenes"
# Nested, and with a NOT of a block; a part alone, as leaving out another leaves it, is an OR of one.
SOLIDS = """
OR SPHERE (0,0,0) 1 SPHERE (0.3,0,0) 1 AND SPHERE (1,0,0) 1 NOT OR SPHERE (1,1,0) 1 SPHERE (0,0,1) 2 END END END END
 (0.1,0.2,0.3) 0.5 20 (0.9,0.8,0.7) 2 1 0.3
AND OR SPHERE (0,0,0) 1 SPHERE (2,0,0) 1 END SPHERE (0.1,0.2,0.3) 1.7 END (1,1,1) 0 1 (0,0,0) 1e6 1
"""


def test_random_scenes(tmp_path):
    (seed, *_) = seeds.numbers("written")
    print("seed", seed)
    rng = np.random.default_rng(seed)
    scene = read(random_scene(rng, 3, 3, 3, 3, material=random_material, rest=random_stage(rng)) + SOLIDS)
    assert write(scene, tmp_path / "scene.txt") == [tmp_path / "scene.txt"]
    assert load(tmp_path / "scene.txt") == scene


@pytest.mark.parametrize("path", sorted(SCENES.rglob("*.txt")), ids=lambda path: path.stem)
def test_bundled_scenes_and_their_meshes(path, tmp_path):
    scene = load(path)
    write(scene, tmp_path / "scene.txt")
    assert load(tmp_path / "scene.txt") == scene


def test_a_part_alone(tmp_path):
    scene = read("CAMERA (0,0,0) (1,0,0) (0,1,0) 2" + SOLIDS)
    part = scene.objects[0].parts()[0]
    alone = replace(scene, objects=(replace(scene.objects[0], code=(part, Operator.NOT, Operator.NOT)),))
    write(alone, tmp_path / "scene.txt")
    assert load(tmp_path / "scene.txt") == alone
    write(replace(scene, objects=(replace(scene.objects[0], code=(part,)),)), tmp_path / "scene.txt")
    (solid,) = load(tmp_path / "scene.txt").objects
    assert isinstance(solid, Csg) and solid.code == (part,)


def test_a_mesh_without_a_file_is_written_beside(tmp_path):
    scene = read("CAMERA (0,0,0) (1,0,0) (0,1,0) 2" + SOLIDS)
    (seed, *_) = seeds.numbers("written mesh")
    print("seed", seed)
    vertices = np.random.default_rng(seed).normal(size=(4, 3))
    triangles = np.array([(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)], np.int32)
    mesh = Mesh(scene.objects[0].material, vertices, triangles, True)
    (tmp_path / "scene-1.obj").write_text("mine")
    files = write(replace(scene, objects=(mesh,)), tmp_path / "scene.txt")
    assert [file.name for file in files] == ["scene.txt", "scene-2.obj"]
    assert (tmp_path / "scene-1.obj").read_text() == "mine"
    (back,) = load(tmp_path / "scene.txt").objects
    assert back.closed and sorted(map(tuple, back.vertices)) == sorted(map(tuple, vertices))
    assert len(back.triangles) == 4
