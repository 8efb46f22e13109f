"""Meshes from files: what is read, how it is placed, when it is closed and which way is out."""

import subprocess
import sys

import numpy as np
import pytest

from harness.errors import UserError
from harness.scene import load, surface
from harness.scene.mesh import mesh

CAMERA = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,2)\n"
MATERIAL = "(1,1,1) 0 1 (0,0,0) 1e6 1\n"
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
SIDES = np.array(
    [
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
    ]
)  # fmt: skip


def grid(rows, columns, mend=lambda i, j: (i, j)):
    """Triangles of a closed grid of rows x columns vertices; `mend` says who is behind the last row."""
    triangles = []
    for i in range(rows):
        for j in range(columns):
            ring = [mend(i, j), mend(i + 1, j), mend(i + 1, j + 1), mend(i, j + 1)]
            a, b, c, d = (p % rows * columns + q % columns for p, q in ring)
            triangles += [(a, b, c), (a, c, d)]
    return np.array(triangles)


def torus(rows=9, columns=7, large=2.0, small=0.6):
    around, along = np.meshgrid(np.arange(rows) / rows, np.arange(columns) / columns, indexing="ij")
    around, along = 2 * np.pi * around.ravel(), 2 * np.pi * along.ravel()
    flat = large + small * np.cos(along)
    vertices = np.stack([flat * np.cos(around), flat * np.sin(around), small * np.sin(along)], axis=1)
    return vertices, grid(rows, columns)


def volume(vertices, triangles):
    a, b, c = (vertices[corner] for corner in np.asarray(triangles).T)
    return (a * np.cross(b, c)).sum() / 6


def obj(vertices, triangles):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices, float).tolist()]
    return "\n".join(lines + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in np.asarray(triangles).tolist()]) + "\n"


@pytest.fixture
def read(tmp_path):
    """The Mesh of a file with this content: read("a.obj", "..", placing="(0,0,0) (0,0,0) 1")."""

    def read(name, content=None, placing="(0,0,0) (0,0,0) 1"):
        if content is not None:
            (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        (tmp_path / "scene.txt").write_text(f'{CAMERA}\n  MESH "{name}" {placing} {MATERIAL}')
        return load(tmp_path / "scene.txt").objects[0]

    return read


# Files


@pytest.mark.parametrize(
    ("content", "area"),
    [
        (SQUARE + "f 1 2 3 4\n", 1),
        (SQUARE + "f -4 -3 -2 -1\n", 1),
        (SQUARE + "vt 0 0\nvt 1 1\nvn 0 0 1\nmtllib none.mtl\nusemtl a\nf 1/1/1 2/2/1 3/1/1 4/2/1\n", 1),
        (SQUARE + "vn 0 0 1\nf 1//1 2//1 3//1\n", 0.5),
        (SQUARE + "o one\nf 1 2 3\no two\nf 1 3 4\n", 1),
        (SQUARE + "v -1 0.5 0\nf 1 2 3 4 5\n", 1.5),
        (SQUARE + "v -1 0.5 0\nf 1 2 3\nf 1 3 4 5\n", 1.5),
        ((SQUARE + "f 1 2 3 4\n").replace("\n", "\r\n"), 1),
        (("# caf\xe9\n" + SQUARE + "f 1 2 3 4\n").encode("latin-1"), 1),
        (SQUARE + "v 9 9 9\nf 1 2 3 4\nf 1 2 3 4\nf 1 1 2\nf 3 4 1 2\n", 1),
    ],
)
def test_obj(content, area, read):
    found = read("a.obj", content)
    a, b, c = (found.vertices[corner] for corner in found.triangles.T)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == area
    assert not found.closed
    assert found.vertices.dtype == np.float64 and found.triangles.dtype == np.int32
    assert set(found.triangles.ravel()) == set(range(len(found.vertices)))


def test_vertices_are_merged_and_those_of_no_triangle_go(read):
    rows = ["0 0 0", "-0 0 -0.0", "9 9 9", "1 0 0", "1.0 0 0", "0 1 0", "0 0 1", "nan 0 0"]
    sides = ["0 5 3", "1 4 6", "0 6 5", "3 5 6"]
    head = f"ply\nformat ascii 1.0\nelement vertex {len(rows)}\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    head += f"element face {len(sides)}\nproperty list uchar int vertex_indices\nend_header\n"
    found = read("a.ply", head + "\n".join(rows + [f"3 {side}" for side in sides]) + "\n")
    assert found.closed and found.vertices.shape == (4, 3) and found.vertices.max() == 1


@pytest.mark.parametrize("kind", ["obj", "ply", "stl", "off", "glb", "gltf"])
def test_every_kind_of_file(kind, read, tmp_path):
    import trimesh

    vertices, triangles = torus()
    vertices = np.float64(np.float32(vertices))  # what STL and glTF keep
    made = trimesh.Trimesh(vertices, triangles, process=False)
    if kind == "gltf":
        for name, content in made.export(file_type="gltf").items():
            (tmp_path / name).write_bytes(content)
        found = read("model.gltf")
    else:
        made.export(tmp_path / f"a.{kind}")
        found = read(f"a.{kind}")
    assert found.closed and (len(found.vertices), len(found.triangles)) == (len(vertices), len(triangles))
    if kind in ("ply", "stl", "glb", "gltf"):
        assert np.array_equal(np.unique(found.vertices, axis=0), np.unique(vertices, axis=0))
    assert volume(found.vertices, found.triangles) == pytest.approx(volume(vertices, triangles), rel=1e-6)


def test_parts_of_a_gltf_scene_are_moved_to_their_places(read, tmp_path):
    import trimesh

    place = np.eye(4)
    place[:3, 3] = 10, 20, 30
    scene = trimesh.Scene([trimesh.Trimesh(CUBE, SIDES, process=False)])
    scene.add_geometry(trimesh.Trimesh(CUBE, SIDES, process=False), transform=place)
    scene.export(tmp_path / "a.glb")
    found = read("a.glb")
    assert found.closed and len(found.triangles) == 24
    assert found.vertices.max(axis=0).tolist() == [11, 21, 31] and not found.vertices.min(axis=0).any()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("none.obj", None, 'none.obj"; the path is taken from the folder of the scene file'),
        (".", None, 'unknown kind of mesh file "."; supported: .obj, .ply, .stl, .off, .glb, .gltf'),
        ("a.blend", "", 'unknown kind of mesh file "a.blend"; supported: .obj'),
        ("a.obj", "", 'the mesh "a.obj" has no triangles'),
        ("a.obj", SQUARE, 'the mesh "a.obj" has no triangles'),
        ("a.obj", SQUARE + "l 1 2 3\n", 'the mesh "a.obj" has no triangles'),
        ("a.obj", SQUARE + "f 1 1 2\nf 1 2 2\n", "no triangle with an area"),
        ("a.obj", "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n", "no triangle with an area"),
        ("a.obj", SQUARE + "f 1 2 9\n", 'the mesh "a.obj" cannot be read: '),
        ("a.obj", SQUARE.replace("1 1", "nan 1") + "f 1 2 3\n", "line 5: a face has a vertex that is not finite"),
        ("a.obj", SQUARE.replace("1 1", "1e31 1") + "f 1 2 3\n", "a vertex farther than 1e+30 from the origin"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", "line 4: the header of the PLY has no end"),
        ("a.off", "", 'the mesh "a.off" cannot be read: '),
        ("a.glb", b"glTF" + b"\0" * 50, "only GLTF 2 is supported"),
    ],
)
def test_faults(name, content, message, read, capfd):
    with pytest.raises(UserError) as caught:
        read(name, content)
    error = caught.value
    assert (error.file.name, error.line, error.column) == ("scene.txt", 3, 8)
    assert message in str(error) and "\n" not in str(error)
    assert capfd.readouterr() == ("", "")


def test_a_path_is_of_the_scene_file_or_absolute(tmp_path, monkeypatch):
    (tmp_path / "scenes" / "my meshes").mkdir(parents=True)
    (tmp_path / "scenes" / "my meshes" / "a #1 (b).obj").write_text(SQUARE + "f 1 2 3 4\n")
    monkeypatch.chdir(tmp_path)
    scene = tmp_path / "scenes" / "a.txt"
    for path in ('"my meshes/a #1 (b).obj"', f'"{tmp_path}/scenes/my meshes/a #1 (b).obj"'):
        scene.write_text(f"{CAMERA}MESH {path} (0,0,0) (0,0,0) 1 {MATERIAL}")
        assert load("scenes/a.txt").objects[0].path == path.strip('"')
    (tmp_path / "scenes" / "b.obj").write_text(SQUARE + "f 1 2 3\n")
    scene.write_text(f"{CAMERA}MESH b.obj (0,0,0) (0,0,0) 1 {MATERIAL}" + f"MESH b.obj(1,0,0)(0,0,0)1{MATERIAL}" * 2)
    once, again, third = load(scene).objects
    assert once != again == third and hash(again) == hash(third) and once != "b.obj"
    assert np.array_equal(once.vertices + np.array([1, 0, 0]), again.vertices)


def test_scenes_without_a_mesh_load_no_library_for_meshes():
    code = f"import sys; from harness.scene import text, flatten; flatten.flatten(text.read({CAMERA!r})); "
    code += "print([name for name in ('trimesh', 'scipy') if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stderr


# Placing


def test_placing(read):
    """T * Rx * Ry * Rz * S, written out another way: three turns of points, one after the other."""
    rng = np.random.default_rng(5)
    print("seed 5")
    x, y, z = np.radians([31.0, -47.0, 112.0])
    points = rng.normal(size=(3, 3))
    found = read("a.obj", obj(points, [(0, 1, 2)]), "(0.3,-0.2,0.7) (31,-47,112) 1.7")
    expected = []
    for a, b, c in 1.7 * points:
        a, b = a * np.cos(z) - b * np.sin(z), a * np.sin(z) + b * np.cos(z)
        c, a = c * np.cos(y) - a * np.sin(y), c * np.sin(y) + a * np.cos(y)
        b, c = b * np.cos(x) - c * np.sin(x), b * np.sin(x) + c * np.cos(x)
        expected.append((a + 0.3, b - 0.2, c + 0.7))
    for point in expected:
        assert np.abs(found.vertices - point).max(axis=1).min() < 1e-15
    assert (found.position, found.rotation, found.scale) == ((0.3, -0.2, 0.7), (31, -47, 112), 1.7)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("angle", [-450, -270, -180, -90, -45, 0, 30, 45, 90, 135, 180, 225, 270, 360, 1e6])
def test_rotation_about_one_axis(axis, angle):
    degrees = [0.0] * 3
    degrees[axis] = angle
    j, k = (axis + 1) % 3, (axis + 2) % 3
    matrix = mesh.rotate(degrees)
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    expected = np.eye(3)
    expected[[j, j, k, k], [j, k, j, k]] = c, -s, s, c
    assert np.abs(matrix - expected).max() < 2e-12
    if angle % 90 == 0:
        assert set(np.abs(matrix).ravel()) == {0, 1}


def test_a_mesh_too_small_for_its_place_has_no_area(read):
    with pytest.raises(UserError, match="no triangle with an area"):
        read("a.obj", obj(CUBE, SIDES), "(1,1,1) (0,0,0) 1e-17")


# Closed and outward


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("shape", [(CUBE, SIDES), torus()], ids=["cube", "torus"])
def test_any_turn_becomes_outward(seed, shape):
    rng = np.random.default_rng(seed)
    vertices, triangles = shape
    turned = triangles.copy()
    flip = rng.random(len(triangles)) < [0, 0.1, 0.5, 0.9, 1][seed]
    turned[flip] = turned[flip, ::-1]
    vertices = vertices + rng.normal(0, 1e3, 3)
    out = surface.outward(vertices, turned)
    assert volume(vertices - vertices[0], out) == pytest.approx(abs(volume(*shape)), rel=1e-9)
    assert np.array_equal(np.sort(out), np.sort(turned))


def test_open_ones_stay_as_they_are(read):
    for triangles in (SIDES[1:], SIDES[:-1], np.vstack([SIDES, [(0, 7, 3)]]), SIDES[:2]):
        found = read("a.obj", obj(CUBE, triangles))
        assert not found.closed and len(found.triangles) == len(triangles)
    back = np.vstack([SIDES[1:6], SIDES[6:, ::-1]])
    found = read("a.obj", obj(CUBE, back))
    assert not found.closed and np.array_equal(found.vertices[found.triangles], CUBE[back])


def test_surfaces_without_an_inside():
    rng = np.random.default_rng(1)
    rows, columns = 8, 6
    points = rng.normal(size=(rows * columns, 3))
    bottle = grid(rows, columns, lambda i, j: (i, -j) if i == rows else (i, j))
    assert surface._pairs(bottle) is not None  # every edge has two triangles
    assert surface.outward(points, bottle) is None
    assert surface.outward(CUBE, np.array([(0, 1, 2), (2, 1, 0)])) is None  # a sheet, back to back
    book = np.vstack([SIDES, SIDES + 8])  # two cubes that share an edge: it has four triangles
    vertices, numbers = np.unique(np.vstack([CUBE, CUBE + np.array([1, 1, 0])]), axis=0, return_inverse=True)
    assert surface.outward(vertices, numbers.reshape(-1)[book]) is None


def test_a_seam_of_triangles_without_area_stays_closed(read):
    """A side of the cube is cut at a point of an edge that its neighbour does not have but for a flat triangle."""
    vertices = np.vstack([CUBE, [0, 0, 0.5]])
    split = [(0, 8, 3), (8, 1, 3), (0, 1, 8)]  # for (0, 1, 3); the last one has no area
    found = read("a.obj", obj(vertices, np.vstack([split, SIDES[1:]])))
    assert found.closed and len(found.triangles) == 13
    assert volume(found.vertices, found.triangles) == pytest.approx(1, rel=1e-15)


@pytest.mark.parametrize("flipped", [(), (0,), (1,), (2,), (0, 1), (0, 2), (1, 2), (0, 1, 2)])
def test_hollows(flipped):
    """A cube in a hollow of a cube, and one beside; whichever way the file turns them."""
    parts = [(4, -2), (2, -1), (1, -0.5), (1, 10)]
    vertices = np.vstack([CUBE * size + place for size, place in parts])
    triangles = [SIDES + 8 * i for i in range(4)]
    for i in flipped:
        triangles[i] = triangles[i][:, ::-1]
    out = surface.outward(vertices, np.vstack(triangles))
    volumes = [volume(vertices, part) for part in np.split(out, 4)]
    assert volumes == pytest.approx([64, -8, 1, 1], rel=1e-12)
    points = [[-1.5] * 3, [-0.9] * 3, [0.0] * 3, [10.5] * 3, [5.0] * 3]
    assert surface.winding(vertices, out, points) == pytest.approx([1, 0, 1, 1, 0], abs=1e-12)


def test_parts_that_cut_each_other_are_no_hollows():
    """Two cubes; and a cube in the box round a tetrahedron, with some of its corners in it and some out of it."""
    corners = np.array([[0, 0, 0], [8, 0, 0], [0, 8, 0], [0, 0, 8.0]])
    sides = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    for first, cut in ((CUBE * 2, CUBE * 2 + [1, 0.5, 0.25]), (corners, CUBE * 2 + 2)):
        triangles = SIDES if len(first) == 8 else sides
        out = surface.outward(np.vstack([first, cut]), np.vstack([triangles, SIDES[:, ::-1] + len(first)]))
        assert volume(first, out[: len(triangles)]) > 0 and volume(cut, out[len(triangles) :] - len(first)) > 0
    within = CUBE + 1  # and this one is in it
    out = surface.outward(np.vstack([corners, within]), np.vstack([sides, SIDES + 4]))
    assert volume(within, out[4:] - 4) < 0


def test_winding():
    """Of a torus: by the distance of points from its middle ring."""
    rng = np.random.default_rng(3)
    print("seed 3")
    vertices, triangles = torus(80, 60)
    points = rng.uniform([-3, -3, -1], [3, 3, 1], (400, 3))
    off = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 2, points[:, 2])
    clear = abs(off - 0.6) > 0.01
    found = surface.winding(vertices, surface.outward(vertices, triangles), points[clear])
    assert np.abs(found - (off[clear] < 0.6)).max() < 1e-12
