"""CSG solids against point membership, closed forms and each other (CSG-1 to CSG-7)."""

import itertools

import numpy as np
import pytest
from random_scenes import random_rays, words
from stage import turned
from tessellate import ball, block, obj

MATTE = "(0.7,0.5,0.3) 0.3 20 (0,0,0) 9 1"
GLASS = "(0,0,0) 1 20 (1,1,1) 2.25 1"
STAGE = """CAMERA (0.05,0.1,0) (1.1,0,0) (0,1.1,0) (0.2,0.1,4)
LIGHT (3.1,4.2,5.3) (0.8,0.7,0.6) 0
AMBIENT (0.2,0.3,0.2)
BACKGROUND (0.3,0.5,0.7)
"""


class Part:
    """A part in scene text, and which points (N, 3) it holds."""

    def __init__(self, text, holds):
        self.text, self.holds = text, holds


def sphere(centre, radius):
    return Part(f"SPHERE {words(centre)} {radius!r}", lambda p: ((p - centre) ** 2).sum(axis=1) < radius**2)


def frame(kind, origin, axes, test):
    inverse = np.linalg.inv(axes.T)
    text = f"{kind} {words(origin)} {' '.join(map(words, axes))}"
    return Part(text, lambda p: test((p - origin) @ inverse.T))


def box(origin, axes):
    return frame("BOX", origin, axes, lambda q: ((q > 0) & (q < 1)).all(axis=1))


def ellipsoid(origin, axes):
    return frame("ELLIPSOID", origin, axes, lambda q: (q**2).sum(axis=1) < 1)


def joined(word, *parts):
    fold = {"OR": np.logical_or, "AND": np.logical_and}[word]
    return Part(
        f"{word}\n" + "\n".join(part.text for part in parts) + "\nEND",
        lambda p: fold.reduce([part.holds(p) for part in parts]),
    )


def negated(part):
    return Part(f"NOT {part.text} END", lambda p: ~part.holds(p))


def random_part(rng):
    centre = rng.uniform(-1, 1, 3)
    kind = rng.integers(3)
    if kind == 0:
        return sphere(centre, float(rng.uniform(0.4, 1.2)))
    axes = turned(rng) * rng.uniform(0.4, 1.6, (3, 1)) + rng.normal(0, 0.1, (3, 3))
    return box(centre - axes.sum(axis=0) / 2, axes) if kind == 1 else ellipsoid(centre, axes)


def random_tree(rng, levels):
    if levels == 0 or rng.random() < 0.15:
        return random_part(rng)
    kind = rng.integers(4)
    if kind == 3:
        return negated(random_tree(rng, levels - 1))
    parts = [random_tree(rng, levels - 1) for _ in range(rng.integers(2, 4))]
    return joined("AND" if kind == 2 else "OR", *parts)


@pytest.mark.parametrize("seed", [s for s in range(40, 52) if s != 49])  # 49 fills all space
def test_first_hits_are_where_membership_changes(bench, serial, seed):
    """Any nesting: before the hit the ray is on one side, after it on the other; the normal points out."""
    print("seed", seed)
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, 3)
    scene = STAGE + tree.text + "\n" + MATTE + "\n"
    rays = random_rays(rng, 400, far=4.0)
    hits = bench.hits(serial, scene, rays)
    origins, directions = rays[:, :3], rays[:, 3:] / np.linalg.norm(rays[:, 3:], axis=1, keepdims=True)
    far = np.minimum(hits[:, 0], 30.0)
    starts = tree.holds(origins)
    for share in np.linspace(1e-7, 1 - 1e-7, 60):
        same = tree.holds(origins + (far * share)[:, None] * directions) == starts
        assert same.all(), f"a boundary was missed by {np.flatnonzero(~same)[:5]}"
    hit = np.isfinite(hits[:, 0])
    assert hit.sum() > 20
    after = tree.holds(origins[hit] + (hits[hit, :1] + 1e-7) * directions[hit])
    changed = after != starts[hit]
    assert changed.mean() > 0.99, "a hit without a change"  # two faces within 1e-7 of each other may hide one
    normals = hits[hit, 4:7]
    sides = np.einsum("ij,ij->i", normals, directions[hit])
    assert ((sides > 0) == starts[hit])[changed].all()
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, rtol=0, atol=1e-14)


@pytest.mark.parametrize("accel", ["none", "bvh"])
def test_stepping_finds_the_same_in_general_position(bench, serial, tmp_path, accel):
    """CSG-7 for nested solids, NOT and meshes, from outside and inside: hits as by intervals, and as Python steps."""
    if "stepping" not in bench.entry(serial).methods.get("csg", ()):
        pytest.skip(f"{serial} has no csg stepping")
    path = tmp_path / "ball.obj"
    path.write_text(obj(*ball(1)))
    cut = f'AND MESH "{path}" (0.2,-0.1,0.3) (20,30,40) 1.2 NOT SPHERE (0.8,0.7,0.9) 0.8 END END'
    for seed in (40, 43, 47, 48, "mesh"):
        rng = np.random.default_rng(90 if seed == "mesh" else seed)
        solid = cut if seed == "mesh" else random_tree(rng, 3).text
        rays = random_rays(rng, 400, far=4.0)
        rays[:100, :3] /= 8
        scene = f"{STAGE}{solid} {MATTE}\nSPHERE (3,0,0) 0.5 {MATTE}\n"
        found, by_intervals, by_python = (
            bench.hits(name, scene, rays, csg=csg, accel=accel)
            for name, csg in ((serial, "stepping"), (serial, "intervals"), ("python", "stepping"))
        )
        hit = np.isfinite(found[:, 0])
        print(seed, hit.mean(), np.abs(found[hit] - by_intervals[hit]).max())
        np.testing.assert_allclose(found, by_intervals, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found, by_python, rtol=0, atol=1e-12)


def test_an_and_of_many_parts_is_stepped_through(bench, serial):
    """The ray enters one part after the other, and leaves some before it is in all; from inside it leaves at once."""
    if "stepping" not in bench.entry(serial).methods.get("csg", ()):
        pytest.skip(f"{serial} has no csg stepping")
    solid = "AND SPHERE (0,0,0) 2 SPHERE (0.5,0,0) 1.8 BOX (-1,-1,-1) (2,0,0) (0,2,0) (0,0,2) SPHERE (0,0,0.5) 1.2 END"
    rays = [[0.1, 0.2, z, 0, 0, -1] for z in (5, 0)] + [[1.9, 0.1, 5, 0, 0, -1], [0.1, 0.2, -5, 0, 0, -1]]
    found = bench.hits(serial, f"{STAGE}{solid} {MATTE}\n", rays, csg="stepping")
    lowest = 0.5 - np.sqrt(1.2**2 - 0.05)
    np.testing.assert_allclose(found[:, 0], [4, -lowest, np.inf, np.inf], rtol=0, atol=1e-12)
    np.testing.assert_allclose(found[0, 4:7], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(found[1, 4:7], np.array([0.1, 0.2, lowest - 0.5]) / 1.2, atol=1e-12)


def test_de_morgan(bench, serial):
    """NOT (a AND b) = NOT a OR NOT b, hit for hit; and twice NOT is nothing."""
    rng = np.random.default_rng(60)
    print("seed 60")
    rays = random_rays(rng, 400)
    a, b = random_part(rng), random_part(rng)
    pairs = [
        (negated(joined("AND", a, b)), joined("OR", negated(a), negated(b))),
        (negated(negated(joined("OR", a, b))), joined("OR", a, b)),
    ]
    for left, right in pairs:
        hits = [bench.hits(serial, STAGE + side.text + "\n" + MATTE + "\n", rays) for side in (left, right)]
        np.testing.assert_array_equal(hits[0], hits[1])


def test_one_part_is_the_shape_itself(bench, serial):
    rng = np.random.default_rng(61)
    print("seed 61")
    rays = random_rays(rng, 300)
    for _ in range(3):
        part = random_part(rng)
        alone = bench.hits(serial, STAGE + part.text + " " + MATTE + "\n", rays)
        solid = bench.hits(serial, STAGE + joined("OR", part, part).text + " " + MATTE + "\n", rays)
        np.testing.assert_allclose(solid, alone, rtol=0, atol=1e-12)


def test_glass_of_overlapping_parts_has_no_inner_faces(bench, serial):
    """A ray along the axis of two overlapping balls: two faces, so 1 - (1 - R) R^(d-1) in a white room."""
    scene = "CAMERA (0.003,0.004,9) (1e-9,0,0) (0,1e-9,0) (0,0,1)\nBACKGROUND (1,1,1)\n"
    scene += "OR SPHERE (0.003,0.004,0) 1 SPHERE (0.003,0.004,-1.3) 0.8 BOX (-2,-2,-1) (4,0,0) (0,4,0) (0,0,1.1) END\n"
    scene += GLASS + "\n"
    for depth in (1, 3, 6):
        picture = bench.picture(serial, scene, width=1, height=1, depth=depth)
        r = (0.5 / 2.5) ** 2
        np.testing.assert_allclose(picture, 1 - (1 - r) * r ** (depth - 1), rtol=0, atol=1e-12)


@pytest.mark.parametrize("shift", [0.0, 100.0, 1e4])
@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_faces_in_one_place_leave_no_gap_and_no_sliver(bench, serial, shift, precision):
    """Two boxes that share a rotated face: OR has no face there, AND is empty (CSG-4, S13)."""
    rng = np.random.default_rng(70)
    print("seed 70")
    axes = turned(rng) * 1.5
    origin = np.full(3, shift) + rng.normal(size=3)
    low, high = box(origin, axes), box(origin + axes[2], axes)
    share = rng.uniform(0.05, 0.95, (400, 2))
    aim = origin + share @ axes[:2] + axes[2]
    directions = axes[2] + rng.normal(0, 0.4, (400, 3))
    rays = np.hstack([aim - 0.5 * directions, directions])  # begins in one box and ends in the other
    union = bench.hits(serial, STAGE + joined("OR", low, high).text + " " + MATTE + "\n", rays, precision)
    common = bench.hits(serial, STAGE + joined("AND", low, high).text + " " + MATTE + "\n", rays, precision)
    length = np.linalg.norm(directions, axis=1)
    assert (np.abs(union[:, 0] - 0.5 * length) > 1e-3 * length).all(), "a gap within the OR"
    assert np.isinf(common[:, 0]).all(), "a sliver of the AND"


@pytest.mark.parametrize(("steps", "is_there"), [(4, False), (32, True)])
def test_a_thin_part_is_lost_by_the_distance_of_its_hit(bench, serial, steps, is_there):
    """Boxes all around, 2^20 away from where the rays start: faces up to 8 steps of float64 apart are one (CSG-4)."""
    far, thick, boxes, rays = 2.0**20, steps * 2.0**-32, "", []
    for axis, sign in itertools.product(range(3), (-1, 1)):
        corner, edges = np.full(3, -0.5), np.eye(3)
        corner[axis], edges[axis, axis] = sign * far, sign * thick
        boxes += "BOX " + " ".join(map(words, (corner, *edges))) + " "
        rays.append([0, 0, 0, *(sign * np.eye(3)[axis])])
    found = bench.hits(serial, f"{STAGE}OR {boxes} END {MATTE}\n", rays)
    assert (found[:, 0] == (far if is_there else np.inf)).all(), found[:, 0]


def test_tiny_parts_are_there(bench, serial):
    """Each 2^-51 thick, where nothing is farther than 2^-45 from the origin: their own size decides (CSG-4)."""
    tiny, parts, rays = 2.0**-52, "", []
    for x, kind in enumerate(("SPHERE", "ELLIPSOID", "BOX")):
        centre, axes = np.array([32.0 * tiny * x, 0, 0]), tiny * np.eye(3)
        if kind == "BOX":
            parts += f"BOX {words(centre - tiny)} {' '.join(map(words, 2 * axes))} "
        else:
            parts += f"{kind} {words(centre)} " + (repr(tiny) if kind == "SPHERE" else " ".join(map(words, axes))) + " "
        rays.append([centre[0], 0, 4 * tiny, 0, 0, -1])
    found = bench.hits(serial, f"{STAGE}OR {parts} END {MATTE}\n", rays)
    np.testing.assert_allclose(found[:, 0], 3 * tiny, rtol=1e-12)


def test_a_mesh_is_a_part_like_a_box(bench, serial, tmp_path):
    """A block of triangles less a ball, against the BOX less the ball; rays through its edges too."""
    path = tmp_path / "block.obj"
    path.write_text(obj(*block()))
    rng = np.random.default_rng(80)
    print("seed 80")
    rays = random_rays(rng, 400)
    rays[:200, :3] += 0.5
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    rays[::7, 3:] = corners[rng.integers(0, 8, len(rays[::7]))] - rays[::7, :3]  # at a corner exactly
    less = "NOT SPHERE (1,0.9,0.8) 0.7 END END " + MATTE + "\n"
    parts = f'AND MESH "{path}" (0,0,0) (0,0,0) 1 ', "AND BOX (0,0,0) (1,0,0) (0,1,0) (0,0,1) "
    mesh, solid = (bench.hits(serial, STAGE + part + less, rays) for part in parts)
    sure = np.ones(len(rays), bool)
    sure[::7] = False  # at a corner either answer is right: hit there, or pass by
    np.testing.assert_allclose(mesh[sure], solid[sure], rtol=0, atol=1e-12)
    hit = np.isfinite(mesh[::7, 0])
    points = mesh[::7, 1:4][hit]
    assert ((points > -1e-9) & (points < 1 + 1e-9)).all(), "a ray through a corner went on inside for ever"


def test_rays_past_a_solid_of_meshes_alone(bench, serial, tmp_path):
    """No line crosses any triangle: there are no boundaries at all."""
    path = tmp_path / "block.obj"
    path.write_text(obj(*block()))
    scene = STAGE + f'AND MESH "{path}" (0,0,0) (0,0,0) 1 MESH "{path}" (0.5,0.5,0.5) (0,0,0) 1 END {MATTE}\n'
    hits = bench.hits(serial, scene, [[5, 5, 5, 0, 0, 1], [-3, 0, 9, 0, 1, 0]])
    assert np.isinf(hits[:, 0]).all()


def test_a_ray_that_is_no_number_crosses_no_mesh(bench, serial, tmp_path):
    """NUM-5 in CSG-2: beyond the critical angle the bare formula sends rays of NaN, which hit nothing (REF-6)."""
    path = tmp_path / "ball.obj"
    path.write_text(obj(*ball(2)))
    glass = "(0,0,0) 1 20 (1,1,1) 2.25 1"
    scene = STAGE + f'AND MESH "{path}" (0,0,0) (10,20,30) 1 NOT SPHERE (0.7,0.6,0.8) 0.8 END END {glass}\n'
    jobs = {"width": 16, "height": 12, "depth": 3, "fresnel": "unclamped"}
    if "unclamped" not in bench.entry(serial).methods.get("fresnel", ()):
        pytest.skip(f"{serial} has no fresnel unclamped")
    result, right = (bench.result(name, scene, **jobs) for name in (serial, "python"))
    assert right.said.rays["non_finite"] > 0 and result.said.rays == right.said.rays


@pytest.mark.parametrize("accel", ["none", "bvh"])
def test_faces_of_a_mesh_at_one_distance_are_in_its_order(bench, serial, tmp_path, accel):
    """Rays through edges between a face that is entered and one that is left there: of equal t, the first counts.

    The faces meet at odd angles, so that the normal tells which it was. Python keeps the order that the mesh has.
    """
    path = tmp_path / "block.obj"
    rng = np.random.default_rng(81)
    print("seed 81")
    vertices, triangles = block()
    path.write_text(obj(vertices, triangles[rng.permutation(len(triangles))]))
    along = rng.integers(1, 16, (300, 1)) / 16
    ends = vertices[[[0, 4], [1, 5], [0, 1], [4, 5]]][rng.integers(0, 4, 300)]
    targets = (1 - along) * ends[:, 0] + along * ends[:, 1]
    rays = np.hstack([targets + rng.integers(-8, 9, (300, 3)) / 4, np.zeros((300, 3))])
    rays[:, 3:] = targets - rays[:, :3]
    rays = rays[np.abs(rays[:, 3:]).max(axis=1) > 0]
    rays[:, 3:] /= np.linalg.norm(rays[:, 3:], axis=1, keepdims=True)  # which all take as it is (NUM-4)
    solid = f'AND MESH "{path}" (0,0,0) (0,0,0) 1 BOX (-9,-9,-9) (18,0,0) (0,18,0) (0,0,18) END {MATTE}\n'
    methods = {"merge": "none", "accel": accel}
    if "none" not in bench.entry(serial).methods.get("merge", ()):
        pytest.skip(f"{serial} has no merge none")
    hits, right = (bench.hits(name, STAGE + solid, rays, **methods) for name in (serial, "python"))
    np.testing.assert_array_equal(hits, right)


def test_pictures_of_solids_agree_with_their_parts(bench, serial):
    """Opaque parts that do not touch are the same joined or apart, shadows and mirrors included."""
    parts = "SPHERE (-0.6,0.2,0.1) 0.5", "BOX (0.2,-0.6,-0.3) (0.7,0.1,0) (-0.1,0.8,0.1) (0,-0.1,0.7)"
    apart = "".join(f"{part} {MATTE}\n" for part in parts)
    together = f"OR {' '.join(parts)} END {MATTE}\n"
    jobs = {"width": 24, "height": 24, "depth": 3, "shadows": True}
    results = [bench.result(serial, STAGE + shapes, **jobs) for shapes in (apart, together)]
    np.testing.assert_allclose(results[0].array, results[1].array, rtol=0, atol=1e-12)
    assert results[0].said.rays == results[1].said.rays


def test_a_line_may_cross_a_mesh_often(bench, serial, tmp_path):
    """Through a comb of 50 teeth, the first of them cut away: all 100 boundaries have to be known (CSG-6)."""
    rng = np.random.default_rng(64)
    turn, teeth, pitch = turned(rng), 50, 0.3
    vertices, triangles = (np.asarray(part) for part in block())
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    tooth = (vertices - (low + high) / 2) / (high - low) * (1, 1, 0.1)
    comb = np.concatenate([tooth - (0, 0, pitch * k) for k in range(teeth)]) @ turn.T
    (tmp_path / "comb.obj").write_text(obj(comb, np.concatenate([triangles + len(vertices) * k for k in range(teeth)])))
    gone = 43
    edges = " ".join(words(turn @ edge) for edge in np.diag([4.0, 4.0, pitch * gone + 3]))
    corner = words(turn @ [-2, -2, -pitch * (gone - 0.5)])
    scene = f'CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,1)\nAND MESH "{tmp_path / "comb.obj"}" (0,0,0) (0,0,0) 1\n'
    scene += f"NOT BOX {corner} {edges} END END (1,1,1) 0 1 (0,0,0) 1 1\n"
    starts = np.column_stack([rng.uniform(-0.3, 0.3, (20, 2)), np.full(20, 2.0)])
    rays = np.hstack([starts @ turn.T, np.tile(turn @ [0, 0, -1], (20, 1))])
    t = bench.hits(serial, scene, rays)[:, 0]
    if serial.startswith(("opencl", "cuda", "numba-cuda")):
        assert np.isnan(t).all()
    else:
        np.testing.assert_allclose(t, 2 + pitch * gone - 0.05, rtol=0, atol=1e-12)
