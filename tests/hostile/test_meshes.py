"""Hostile meshes, as scenes name them: triangles, or an error at the line of the scene that asks for them."""

import io
import json
import struct

import hostile
import numpy as np
import pytest
import trimesh

from harness.errors import UserError
from harness.scene import load
from harness.scene.flatten import flatten
from harness.scene.generate.icosphere import obj
from harness.scene.mesh import mesh

CAMERA = "CAMERA (0,0,1) (1,0,0) (0,1,0) 2\n"
MATERIAL = "(0.9,0.2,0.1) 0.3 50 (0,0,0) 1e6 1\n"
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
OBJ = [
    TETRAHEDRON,
    obj(0),
    "mtllib a.mtl\no ünï\n" + TETRAHEDRON.replace("f 1 3 2", "usemtl x\nf -4 -2 -3") + "g a b\ns off\n",
    "v 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 1 1 0 1 1 1\nv 0 1 0 1 1 1\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\nl 1 2\n",
]
PIECES = [
    "v", "vn", "vt", "f", "o", "g", "usemtl", "mtllib", "l", "1/2/3", "1//2", "-1", "0", "\n", "\nf ", "\nv ", "/",
]  # fmt: skip


@pytest.fixture
def tried(place):
    """tried("m.obj", content): the scene with the mesh in a file of this content, or the UserError."""

    def tried(name, content, scene=None):
        (place / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        path = place / "a.txt"
        path.write_text(scene or f"{CAMERA}MESH {name} (0,0,0) (0,0,0) 1 {MATERIAL}")
        return hostile.outcome(lambda: read(path), "a.txt")

    return tried


def read(path):
    scene = load(path)
    arrays = flatten(scene)
    assert all(np.isfinite(array).all() for array in arrays.values())
    return scene


def test_cases(fuzz, tried):
    fuzz("OBJ", lambda random: tried("m.obj", hostile.mutated(random, OBJ, PIECES)))


def made(kind):
    """A small mesh in another format, by the library that reads it."""
    exported = trimesh.creation.icosahedron().export(file_type=kind)
    return exported if isinstance(exported, bytes) else exported.encode()


@pytest.mark.parametrize("kind", ["ply", "stl", "off", "glb"])
def test_cases_of_other_formats(tried, fuzz, kind, monkeypatch):
    """Of bytes, as these formats are read by a library: a tenth of the cases of OBJ."""
    monkeypatch.setattr(hostile, "CASES", hostile.CASES // 10)
    valid = made(kind)
    fuzz(kind.upper(), lambda random: tried(f"m.{kind}", hostile.damaged_bytes(random, valid)))


def gltf(**changes):
    """A glTF of one triangle, with other values at some places."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    told = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"uri": "data:application/octet-stream;base64," + _base64(points + b"\0\1\2\0"), "byteLength": 40}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 3},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0] * 3, "max": [1] * 3},
            {"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"},
        ],
    }
    return json.dumps({**told, **changes})


def _base64(data):
    import base64

    return base64.b64encode(data).decode()


def test_the_gltf_is_good(tried):
    assert len(tried("m.gltf", gltf()).objects[0].triangles) == 1


ZEROS = [
    {"componentType": 5126, "count": 10**9, "type": "VEC3"},
    {"componentType": 5125, "count": 3 * 10**9, "type": "SCALAR"},
]
MANY = 50_000  # nodes in a file of a megabyte
STL = b"solid".ljust(80) + struct.pack("<I", 2**32 - 1) + bytes(500)
PLY = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
PLY += "element face {}\nproperty list uchar int vertex_indices\nend_header\n"
BAD = {
    "nothing": ("m.obj", "", "cannot be read|no triangles"),
    "NUL bytes": ("m.obj", b"\0" * 1000, "cannot be read|no triangles"),
    "UTF-16": ("m.obj", TETRAHEDRON.encode("utf-16"), "cannot be read|no triangles"),
    "an index too large": ("m.obj", TETRAHEDRON + "f 1 2 999999999\n", "vertices that it does not have|cannot be read"),
    "an index of 10^12": ("m.obj", TETRAHEDRON + "f 1 2 1000000000000\n", "that it does not have|cannot be read"),
    "an index of 5000 digits": ("m.obj", TETRAHEDRON + f"f 1 2 {'1' * 5000}\n", "cannot be read"),
    "no number": ("m.obj", TETRAHEDRON.replace("0 1 0", "0 nan 0"), "not finite"),
    "infinity": ("m.obj", TETRAHEDRON.replace("0 1 0", "0 inf 0"), "not finite"),
    "1e308": ("m.obj", TETRAHEDRON.replace("0 1 0", "0 1e308 0"), "farther than"),
    "PLY of 10^12 vertices": ("m.ply", PLY.format("ascii", 10**12, 1) + "0 0 0\n", "cannot be read|no triangles"),
    "PLY of 10^9 faces": ("m.ply", PLY.format("binary_little_endian", 3, 10**9) + "0", "cannot be read|no triangles"),
    "STL of 2^32 faces": ("m.stl", STL, "cannot be read|no triangles"),
    "OFF of 10^12 vertices": ("m.off", "OFF\n1000000000000 1000000000000 0\n0 0 0\n", "cannot be read|no triangles"),
    "glTF of zeros without bytes": ("m.gltf", gltf(accessors=ZEROS), "declares far more"),
    "glTF nested": ("m.gltf", "[" * 100_000, "cannot be read"),
    "glTF of another file": ("m.gltf", gltf(buffers=[{"uri": "../../etc/passwd", "byteLength": 40}]), "cannot be read"),
    "a GLB that promises": ("m.glb", b"glTF" + struct.pack("<5I", 2, 2**32 - 1, 2**32 - 1, 0x4E4F534A, 0), "cannot be"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad(tried, name):
    file, content, match = BAD[name]

    def run():
        found = tried(file, content)
        if isinstance(found, UserError):
            raise found
        return found

    hostile.refused(run, "a.txt:2:6", match=match)


STRANGE = {
    "glTF in a ring": ("m.gltf", gltf(nodes=[{"mesh": 0, "children": [1]}, {"children": [0]}])),
    "denormals": ("m.obj", TETRAHEDRON + "v 5e-324 0 0\nf 5 2 3\n"),
    "nodes without end": ("m.gltf", gltf(nodes=[{"mesh": 0}] * MANY, scenes=[{"nodes": list(range(MANY))}])),
    "a polygon of 100,000 corners": ("m.obj", TETRAHEDRON + "f" + " 1 2 3 4" * 25_000 + "\n"),
}


@pytest.mark.parametrize("name", STRANGE)
def test_strange(tried, name):
    """A result or an error: either will do, within the limits."""
    tried(*STRANGE[name])


def test_a_mesh_many_times_over(tried):
    """A small scene with a small mesh that would be 10^9 triangles: the billion laughs."""
    sheet = io.StringIO()
    side = 120
    for y in range(side):
        sheet.writelines(f"v {x} {y} 0\n" for x in range(side))
    for y in range(side - 1):
        for x in range(1, side):
            corner = y * side + x
            sheet.write(f"f {corner} {corner + 1} {corner + side + 1} {corner + side}\n")
    scene = CAMERA + f"MESH m.obj (0,0,0) (0,0,0) 1 {MATERIAL}" * 12_000
    assert len(scene) < 10**6 and sheet.tell() < 10**6
    found = tried("m.obj", sheet.getvalue(), scene)
    assert isinstance(found, UserError) and "triangles" in str(found), found


@pytest.mark.parametrize(
    "path", ["m.obj\0", '"/dev/zero.obj"', '"../nowhere/m.obj"', "/proc/self/mem", '"."', "a" * 9000]
)
def test_paths(tmp_path, path):
    """A path may lead anywhere, but only to a file, and of a kind that holds a mesh."""
    scene = tmp_path / "a.txt"
    scene.write_bytes(f"{CAMERA}MESH {path} (0,0,0) (0,0,0) 1 {MATERIAL}".encode())
    hostile.refused(lambda: read(scene), "a.txt", match="no such file|unknown kind of mesh|not a text|at most 1000")


def test_nothing_of_a_file_that_is_no_mesh_is_told(tmp_path):
    secret = tmp_path.parent / "secret"
    secret.write_text("password: 12345\n")
    (tmp_path / "m.obj").symlink_to(secret)
    (tmp_path / "a.txt").write_text(f"{CAMERA}MESH m.obj (0,0,0) (0,0,0) 1 {MATERIAL}")
    assert "12345" not in hostile.refused(lambda: read(tmp_path / "a.txt"), "a.txt")


def test_a_pipe_is_no_file(tmp_path):
    import os

    os.mkfifo(tmp_path / "m.obj")
    (tmp_path / "a.txt").write_text(f"{CAMERA}MESH m.obj (0,0,0) (0,0,0) 1 {MATERIAL}")
    hostile.refused(lambda: read(tmp_path / "a.txt"), "a.txt", match="no such file")


def test_a_mesh_is_read_once(tmp_path, monkeypatch):
    """However often a scene names it."""
    (tmp_path / "m.obj").write_text(TETRAHEDRON)
    files, loaded = mesh.Files(tmp_path), []
    monkeypatch.setattr(mesh, "_load", lambda *told, load=mesh._load: loaded.append(told) or load(*told))
    for _ in range(3):
        files.placed("m.obj", (0, 0, 0), (0, 0, 0), 1)
    assert len(loaded) == 1
