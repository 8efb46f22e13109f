"""`rays` jobs against the truth in 50 digits, from the definitions of the shapes, not from the formulas of SPEC.md."""

from functools import cache

import mpmath as mp
import numpy as np
import pytest
from random_scenes import MATERIAL, random_rays, random_scene, words

from harness.scene import text
from harness.scene.model import Box, Ellipsoid, Polygon, Sphere

mp.mp.dps = 50
T_TOLERANCE = 1e-12  # relative, of t in float64
CONDITION = 1e-3  # rays nearer than this to grazing have no t that float64 could hold to T_TOLERANCE
EDGE = 1e-10  # rays nearer than this to an edge may hit or miss
SEED = 20201107


def vector(values):
    return mp.matrix([mp.mpf(float(x)) for x in values])


def dot(a, b):
    return sum(a[i] * b[i] for i in range(3))


def cross(a, b):
    return mp.matrix([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def unit(a):
    return a / mp.sqrt(dot(a, a))


def quadric(origin, direction, centre, axes):
    """All (t, outward normal) of an ellipsoid, from |M⁻¹(p - c)|² = 1, and 1 - (impact/radius)²."""
    m = mp.matrix(3, 3)
    for column, axis in enumerate(axes):
        for row in range(3):
            m[row, column] = axis[row]
    inverse = m**-1
    f, d = inverse * (origin - centre), inverse * direction
    a, b, c = dot(d, d), 2 * dot(f, d), dot(f, f) - 1
    discriminant = b * b - 4 * a * c
    if discriminant < 0:
        return [], -discriminant / (4 * a)
    found = []
    for sign in (-1, 1):
        t = (-b + sign * mp.sqrt(discriminant)) / (2 * a)
        found.append((t, unit(inverse.T * (f + t * d))))
    return found, discriminant / (4 * a)


def planes(origin, direction, faces):
    """All (t, normal) of convex faces (point, normal, inside edges), and how far from grazing and from an edge."""
    found, margin = [], mp.inf
    for point, normal, edges in faces:
        slope = dot(direction, normal)
        if slope == 0:
            continue
        t = dot(point - origin, normal) / slope
        p = origin + t * direction
        depths = [dot(p - q, inward) for q, inward in edges]
        margin = min(margin, abs(slope), *(abs(depth) * CONDITION / EDGE for depth in depths)) if t > 0 else margin
        if all(depth >= 0 for depth in depths):
            found.append((t, normal))
    return found, margin


def box_faces(corner, edges):
    faces = []
    volume = dot(edges[0], cross(edges[1], edges[2]))
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        normal = unit(cross(edges[b], edges[c])) * mp.sign(volume)
        for point, outward in ((corner, -normal), (corner + edges[a], normal)):
            loop = [point, point + edges[b], point + edges[b] + edges[c], point + edges[c]]
            faces.append((point, outward, inward_edges(loop)))
    return faces


def inward_edges(loop):
    middle = sum(loop[1:], loop[0]) / len(loop)
    edges = []
    for q, after in zip(loop, loop[1:] + loop[:1], strict=True):
        along = unit(after - q)
        arm = middle - q
        edges.append((q, unit(arm - dot(arm, along) * along)))
    return edges


def truth(scene, ray):
    """(t, normal, object) of the first hit with t > 0 or None, and how well conditioned the answer is."""
    origin, direction = vector(ray[:3]), unit(vector(ray[3:]))
    best, condition = None, mp.inf
    for number, thing in enumerate(scene.objects):
        match thing:
            case Sphere():
                r = mp.mpf(thing.radius)
                axes = [mp.matrix([r, 0, 0]), mp.matrix([0, r, 0]), mp.matrix([0, 0, r])]
                found, margin = quadric(origin, direction, vector(thing.centre), axes)
            case Ellipsoid():
                found, margin = quadric(origin, direction, vector(thing.centre), [vector(a) for a in thing.axes])
            case Box():
                found, margin = planes(
                    origin, direction, box_faces(vector(thing.corner), [vector(e) for e in thing.edges])
                )
            case Polygon():
                loop = [vector(v) for v in thing.vertices]
                normal = unit(cross(loop[1] - loop[0], loop[2] - loop[0]))
                found, margin = planes(origin, direction, [(loop[0], normal, inward_edges(loop))])
                found = [(t, -n if dot(n, direction) > 0 else n) for t, n in found]
        condition = min(condition, margin, *(abs(t) for t, _ in found))
        for t, normal in found:
            if t > 0 and (best is None or t < best[0]):
                best = t, normal, number
    return best, condition


@cache
def general_case(kind):
    """Scene text, rays and the truth of each, for one kind of shape or all."""
    rng = np.random.default_rng([SEED, len(kind)])
    counts = dict.fromkeys(("sphere", "box", "polygon", "ellipsoid"), 2) if kind == "all" else {kind: 4}
    source = random_scene(rng, **counts)
    rays = random_rays(rng, 240)
    scene = text.read(source, "scene of the test")
    return source, rays, [truth(scene, ray) for ray in rays]


@pytest.mark.parametrize("kind", ["sphere", "box", "polygon", "ellipsoid", "all"])
def test_first_hits_in_general_position(bench, serial, kind):
    print("seed", [SEED, len(kind)])
    source, rays, truths = general_case(kind)
    hits = bench.hits(serial, source, rays)
    judged = hit_count = 0
    for ray, hit, (expected, condition) in zip(rays, hits, truths, strict=True):
        if condition < CONDITION:
            continue
        judged += 1
        if expected is None:
            assert np.isinf(hit[0]) and hit[7] == -1, f"{ray} should miss, hit {hit}"
            continue
        hit_count += 1
        t, normal, number = expected
        assert hit[7] == number, f"{ray}: object {hit[7]}, expected {number}"
        assert abs(hit[0] - t) <= T_TOLERANCE * t, f"{ray}: t {hit[0]!r}, expected {mp.nstr(t, 20)}"
        point = vector(ray[:3]) + t * unit(vector(ray[3:]))
        size = max(1, max(abs(x) for x in point))
        assert max(abs(mp.mpf(float(hit[1 + i])) - point[i]) for i in range(3)) <= 1e-12 * size
        assert max(abs(mp.mpf(float(hit[4 + i])) - normal[i]) for i in range(3)) <= 1e-11
    assert judged > 150 and hit_count > 40, "the rays do not aim well"


@cache
def far_case(distance):
    """A unit sphere seen from far away, in random directions: impact parameters up to 1.5, half of them at the rim."""
    rng = np.random.default_rng([SEED, int(distance)])
    source = f"CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\nSPHERE (0,0,0) 1 {MATERIAL}\n"
    away = rng.normal(size=(400, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    side = np.cross(away, np.eye(3)[rng.integers(0, 3, 400)])  # the rim is met near an axis too
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    impact = np.concatenate([rng.uniform(0, 1.5, (200, 1)), rng.uniform(0.93, 0.9995, (200, 1))])
    rays = np.hstack([away * distance, side * impact - away * distance])
    scene = text.read(source, "scene of the test")
    return source, rays, [truth(scene, ray) for ray in rays]


@pytest.mark.parametrize("distance", [1e2, 1e4, 1e6])
def test_far_sphere(bench, serial, distance):
    """The discriminant r² - l·l keeps its digits where b² - 4ac has lost them (SPH-1): |dt| grows as u D, not u D²."""
    print("seed", [SEED, int(distance)])
    source, rays, truths = far_case(distance)
    hits = bench.hits(serial, source, rays)
    wrong = 0
    for ray, hit, (expected, condition) in zip(rays, hits, truths, strict=True):
        if condition < CONDITION:
            continue
        wrong += (expected is None) != np.isinf(hit[0])
        if expected is not None and np.isfinite(hit[0]):
            assert abs(hit[0] - expected[0]) <= 2e-14 * distance, f"{ray}: {hit[0]}"
    assert wrong == 0


def test_box_with_rays_along_its_axes(bench, serial):
    """Zero components of both signs make 0 · inf in a slab test that divides first (BOX-1)."""
    source = f"CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\nBOX (-1,-1,-1) (2,0,0) (0,2,0) (0,0,2) {MATERIAL}\n"
    rays, expected = [], []
    for axis in range(3):
        for sign in (1.0, -1.0):
            for zero in (0.0, -0.0):
                for offset in (0.25, 1.0, -1.0, 1.5):  # inside, on two faces' planes, outside
                    origin, direction = [0.3, 0.3, 0.3], [zero] * 3
                    origin[axis], origin[(axis + 1) % 3] = -3 * sign, offset
                    direction[axis] = sign
                    rays.append(origin + direction)
                    expected.append(2.0 if abs(offset) <= 1 else np.inf)  # the box is closed
    hits = bench.hits(serial, source, rays)
    np.testing.assert_array_equal(hits[:, 0], expected)


def test_a_ray_into_a_corner_meets_the_first_axis(bench, serial):
    """BOX-1: on ties the first axis stays, entering and leaving."""
    source = f"CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\nBOX (-1,-1,-1) (2,0,0) (0,2,0) (0,0,2) {MATERIAL}\n"
    rays = [[3, 3, 3, -1, -1, -1], [0, 0, 0, 1, 1, 1], [0.5, 3, 3, 0, -1, -1], [0.5, 0, 0, 0, -1, -1]]
    hits = bench.hits(serial, source, rays)
    np.testing.assert_array_equal(hits[:, 4:7], [[1, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0]])


@pytest.mark.parametrize("vertices", [3, 4, 5, 8])
def test_rays_beside_the_edges_of_a_polygon(bench, serial, vertices):
    """POL-2, aimed: 1e-9 to either side of each edge, and past each vertex."""
    print("seed", [SEED, vertices])
    rng = np.random.default_rng([SEED, vertices])
    x, y = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
    middle = rng.normal(size=3)
    angles = np.sort(rng.uniform(0, 2 * np.pi / vertices, vertices) + 2 * np.pi * np.arange(vertices) / vertices)
    loop = [middle + 1.7 * (np.cos(a) * x + np.sin(a) * y) for a in angles]
    source = f"CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\nPOLYGON {vertices} {' '.join(map(words, loop))} {MATERIAL}\n"
    rays, expected = [], []
    for q, after in zip(loop, loop[1:] + loop[:1], strict=True):
        along = (after - q) / np.linalg.norm(after - q)
        inward = np.cross(np.cross(x, y), along)
        for share in (0.001, 0.3, 0.77, 0.999):
            for side in (1e-9, -1e-9):
                target = q + share * (after - q) + side * inward
                origin = target + np.cross(x, y) * rng.choice([-3.0, 3.0]) + rng.normal(0, 0.7, 3)
                rays.append([*origin, *(target - origin)])
                expected.append(side > 0)
        beyond = q + 1e-9 * (q - middle)
        rays.append([*(beyond + 4 * np.cross(x, y)), *(-4 * np.cross(x, y))])
        expected.append(False)
    hits = bench.hits(serial, source, rays)
    np.testing.assert_array_equal(np.isfinite(hits[:, 0]), expected)


def test_the_first_of_equal_hits_wins(bench, serial):
    """HIT-2: two spheres in one place, and a box face in the plane of a polygon."""
    twin = f"SPHERE (0.1,0.2,0) 1 {MATERIAL}\n"
    shapes = [
        (twin + twin, [0.1, 0.2, 5, 0, 0, -1], 0),
        (
            f"POLYGON 3 (-9,-9,1) (9,-9,1) (0,9,1) {MATERIAL}\nBOX (-1,-1,-1) (2,0,0) (0,2,0) (0,0,2) {MATERIAL}\n",
            [0.1, 0.2, 5, 0, 0, -1],
            1,
        ),
    ]
    for source, ray, winner in shapes:
        hits = bench.hits(serial, "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\n" + source, [ray])
        assert hits[0, 7] == winner


def test_a_hit_behind_the_origin_does_not_count(bench, serial):
    source = random_scene(np.random.default_rng(SEED), sphere=1, box=1, polygon=1, ellipsoid=1, spread=0.3)
    rays = [[0.1, 0.2, 50, 0.01, 0.02, 1], [0.1, 0.2, -50, 0.01, 0.02, -1], [70, 1, 1, 3, 0.1, 0.1]]
    assert np.isinf(bench.hits(serial, source, rays)[:, 0]).all()


def test_no_objects(bench, serial):
    hits = bench.hits(serial, "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\n", [[0, 0, 0, 1, 2, 3]])
    np.testing.assert_array_equal(hits, [[np.inf, 0, 0, 0, 0, 0, 0, -1]])


def test_no_rays(bench, serial):
    assert bench.hits(serial, f"CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\nSPHERE (0,0,0) 1 {MATERIAL}\n", []).shape == (
        0,
        8,
    )
