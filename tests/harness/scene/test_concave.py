"""Concave polygons of NFF as meshes: triangles that cover them exactly, and outlines that bound no polygon."""

import time
from collections import Counter

import numpy as np
import outlines
import pytest

from harness.errors import UserError
from harness.scene import check, concave, media, nff
from harness.scene.model import Mesh, Polygon

HEAD = "v\nfrom 0 0 8\nat 0 0 0\nup 0 1 0\nangle 90\nhither 1\nresolution 9 9\nf 1 0.5 0.25 0.8 0.3 17 0.5 1.5\n"


def doubled(rng, vertices):
    """With some vertices two or three times in turn."""
    return np.repeat(vertices, rng.choice([1, 1, 1, 2, 3], len(vertices)), axis=0)


def midpoints(vertices):
    """With one more vertex on each side."""
    return np.stack([vertices, (vertices + np.roll(vertices, -1, 0)) / 2], axis=1).reshape(-1, 3)


def read(vertices, keyword="p"):
    (found,) = nff.read(HEAD + outlines.polygon(vertices, keyword)).objects
    return found


def covers(mesh, vertices, outline, scale):
    """The triangles have the outline's sides as their border, the polygon's area and normal, and do not overlap."""
    a, b, c = (mesh.vertices[corner] for corner in mesh.triangles.T)
    normals = np.cross(b - a, c - a)
    arms = vertices - vertices[0]
    whole = np.cross(arms[:-1], arms[1:]).sum(axis=0)
    unit = whole / np.linalg.norm(whole)
    areas = normals @ unit
    assert (areas > 0).all() or (areas < 0).all()
    assert abs(areas).sum() == pytest.approx(np.linalg.norm(whole), rel=1e-9)
    edges = Counter((i, j) for t in mesh.triangles.tolist() for i, j in zip(t, t[1:] + t[:1], strict=True))
    assert set(edges.values()) == {1}
    border = [edge for edge in edges if edge[::-1] not in edges]
    sides = {frozenset(edge) for edge in border}
    places = {tuple(v): i for i, v in enumerate(np.round(mesh.vertices / scale, 7).tolist())}
    numbers = [places[tuple(v)] for v in np.round(vertices / scale, 7).tolist()]
    assert sides == {frozenset(edge) for edge in zip(numbers, numbers[1:] + numbers[:1], strict=True)}
    assert len(border) == len(vertices) and len(mesh.triangles) == len(vertices) - 2
    assert not mesh.closed and not media.solid(mesh)


@pytest.mark.parametrize("kind", outlines.KINDS)
@pytest.mark.parametrize("seed", range(6))
def test_the_triangles_cover_the_polygon(kind, seed):
    rng = np.random.default_rng(seed)
    scale, far = 10.0 ** rng.uniform(-6, 6), rng.choice([0, 1, 100])
    print("seed", seed, "scale", scale, "far", far)
    outline = outlines.KINDS[kind](rng, int(rng.integers(16, 200)))
    vertices, place, _ = outlines.placed(rng, outline, scale, far)
    for these in (vertices, midpoints(vertices), np.roll(vertices, int(rng.integers(len(vertices))), 0)):
        mesh = read(doubled(rng, these), rng.choice(["p", "pp"]))
        assert isinstance(mesh, Mesh) and mesh.line == 9
        local = Mesh(None, mesh.vertices - place, mesh.triangles, closed=False)
        covers(local, these - place, outline, scale)


@pytest.mark.parametrize("seed", range(4))
def test_six_digits_are_flat_all_the_same(seed):
    """Written with six digits a vertex is off the plane; all triangles have the polygon's normal (POL-1)."""
    rng = np.random.default_rng(seed)
    print("seed", seed)
    vertices, *_ = outlines.placed(rng, outlines.gear(rng, 144), 1, 0)
    rounded = np.round(vertices, 6)
    arms = rounded - rounded[0]
    normal = check.unit(np.cross(arms[:-1], arms[1:]).sum(axis=0).tolist())
    assert np.abs(arms @ normal).max() > 1e-8
    mesh = read(rounded)
    a, b, c = (mesh.vertices[corner] for corner in mesh.triangles.T)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    assert np.abs(np.abs(normals @ normal) - 1).max() < 1e-12
    assert np.linalg.norm(np.cross(normals, normal), axis=1).max() < 1e-10


def test_points_on_straight_sides_and_repeated_ones():
    """A staircase on a grid, whose points lie in line by the dozen; and convex polygons with repeated points."""
    steps = [(x, y, 0.0) for i in range(6) for x, y in ((i, i), (i + 1, i))]
    steps += [(6, 6, 0), (3, 6, 0), (0, 6, 0), (0, 3, 0)]
    mesh = read(np.array(steps, float))
    assert len(mesh.triangles) == len(steps) - 2
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    for again in ([1, 2, 1, 1], [3, 1, 1, 2], [2, 2, 2, 2]):
        found = read(np.vstack([np.repeat(square, again, axis=0), square[:1]]))
        assert isinstance(found, Polygon) and sorted(found.vertices) == sorted(map(tuple, square.tolist()))


@pytest.mark.parametrize("seed", range(8))
def test_outlines_that_cross_or_touch_themselves(seed):
    rng = np.random.default_rng(seed)
    print("seed", seed)
    star = outlines.star(rng, 40)
    crossing = star.copy()
    crossing[[5, 25]] = crossing[[25, 5]]
    bridge = np.vstack([star[:10], 0.1 * outlines.star(rng, 7)[::-1], star[9:]])
    bridge[16] = bridge[10]
    twice = np.vstack([outlines.gear(rng, 40), 0.5 * outlines.gear(rng, 40)])
    touching = star.copy()
    touching[7] = touching[27]
    spike = np.insert(star, 9, [star[8] * 1.5, star[8]], axis=0)
    for outline in (crossing, bridge, touching, spike, twice, rng.random((60, 2))):
        vertices, *_ = outlines.placed(rng, outline, 10.0 ** rng.uniform(-6, 6), 0)
        with pytest.raises(UserError, match=r"the polygon (crosses|touches) itself") as caught:
            read(vertices)
        assert 10 <= caught.value.line < 10 + len(vertices)


def test_reading_is_not_quadratic():
    """Eight times the gears, or the teeth, take nowhere near 64 times as long."""

    def seconds(text):
        start = time.process_time()
        nff.read(text)
        return time.process_time() - start

    seconds(outlines.gears(1))  # loads the library
    for few, many in ((outlines.gears(8), outlines.gears(64)), (outlines.gears(1, 300), outlines.gears(1, 2400))):
        ratio = min(seconds(many) for _ in range(3)) / min(seconds(few) for _ in range(3))
        print("8 times as much takes", ratio, "times as long")
        assert ratio < 24


def test_the_same_triangles_every_time():
    vertices, *_ = outlines.placed(np.random.default_rng(1), outlines.spiral(np.random.default_rng(1), 300), 1, 1)
    first, second = (concave.triangulate(vertices) for _ in range(2))
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))
