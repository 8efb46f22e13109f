"""Walls of polygons that share edges let no ray pass between them (POL-2), in any renderer, in lanes too."""

import numpy as np
import pytest
from random_scenes import MATERIAL, words
from stage import turned

from harness.renderer import registry
from harness.scene import nff
from harness.stress.geometry.cracks import faces

SEED = 20261128
GLOW = "AMBIENT (0.9,0.9,0.9)\nBACKGROUND (1,1,1)\n"
STAGE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\n"
VIEW = "v\nfrom 0 0 9\nat 0 0 0\nup 0 1 0\nangle 40\nhither 1\nresolution 9 9\n"
GOLDEN = (1 + 5**0.5) / 2


@pytest.fixture(
    params=[
        name
        for name, entry in registry.entries().items()
        if "on" in entry.methods.get("vector", ()) and entry.variant.threads == 1
    ]
)
def laned(request):
    return request.param


def icosahedron():
    corners = [(0.0, a, b * GOLDEN) for a in (-1, 1) for b in (-1, 1)]
    vertices = np.array([np.roll(corner, turn) for turn in range(3) for corner in corners])
    near = np.linalg.norm(vertices[:, None] - vertices, axis=2) < 2.1
    loops = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[i, k]
    ]
    return vertices, loops


def prism(sides=17):
    """Two polygons of many sides, and a wall of quadrilaterals."""
    turns = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    vertices = np.concatenate([np.hstack([ring, np.full((sides, 1), z)]) for z in (-0.7, 0.9)])
    low = np.arange(sides)
    after = np.roll(low, -1)
    walls = np.stack([low, after, after + sides, low + sides], axis=1)
    return vertices, [low, low + sides, *walls]


def bricks(rows=6, columns=6):
    """Rows of bricks, each half a brick aside of the next: six vertices, two of them inside straight sides."""
    places, loops = {}, []

    def number(x, y):
        return places.setdefault((x, y), len(places))

    for y in range(rows):
        for column in range(columns):
            x = 2 * column + y % 2
            loops.append([number(x + a, y + b) for a, b in ((0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1))])
    vertices = np.array([(x - columns, 1.1 * (y - rows / 2), 0.0) for x, y in places])
    return vertices, loops


def fan_of_slivers(count=40):
    """A disc of thin triangles that meet in one point, each an edge's length wide at its rim."""
    turns = 2 * np.pi * np.arange(count) / count
    vertices = np.vstack([np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1), [[0.1, 0.05, 0]]])
    return vertices, [(i, (i + 1) % count, count) for i in range(count)]


# Of each: the body and a place from which all of its polygons are seen.
BODIES = {
    "icosahedron": (icosahedron, (0.1, 0.2, 0.1)),
    "pentagons and hexagons": (lambda: faces(1), (0.1, 0.05, -0.1)),
    "prism": (prism, (0.1, 0.2, 0.1)),
    "bricks": (bricks, (0.3, 0.4, 2.0)),
    "slivers": (fan_of_slivers, (0.1, 0.4, 0.7)),
}
PLACES = {"near": (1.0, 0.0), "far": (1.0, 300.0), "tiny": (1e-9, 2e-9), "huge": (1e9, 3e9)}  # scale, distance


def placed(rng, name, place):
    """Vertices, loops, edges between two polygons (E, 2), vertices with polygons all around, and an eye."""
    make, eye = BODIES[name]
    scale, away = PLACES[place]
    vertices, loops = make()
    turn, move = turned(rng), rng.normal(size=3)
    move *= away / np.linalg.norm(move)
    sizes = scale * rng.uniform(0.7, 1.4, 3)
    vertices, eye = (sizes * points @ turn.T + move for points in (vertices, np.array(eye)))
    pairs = np.concatenate([np.sort(np.stack([loop, np.roll(loop, -1)], axis=1), axis=1) for loop in loops])
    edges, polygons = np.unique(pairs, axis=0, return_counts=True)
    inner = np.setdiff1d(np.arange(len(vertices)), edges[polygons == 1])
    return vertices, loops, edges[polygons == 2], inner, eye


def text_of(vertices, loops, material=MATERIAL):
    return "".join(f"POLYGON {len(loop)} {' '.join(words(vertices[i]) for i in loop)} {material}\n" for loop in loops)


def aimed(rng, vertices, edges, inner, eye, count):
    """Rays (count, 6) from about `eye` at places on edges, a quarter of them at inner vertices."""
    first, last = vertices[edges[rng.integers(0, len(edges), count)].T]
    share = rng.uniform(0.01, 0.99, (count, 1))
    targets = (1 - share) * first + share * last
    if len(inner):
        targets[::4] = vertices[rng.choice(inner, len(targets[::4]))]
    extent = np.linalg.norm(np.ptp(vertices, axis=0))
    arms = targets - (eye + 0.01 * extent * rng.uniform(-1, 1, (count, 3)))
    return np.hstack([targets - arms, arms / np.linalg.norm(arms, axis=1, keepdims=True)])


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_no_ray_passes_between(bench, serial, body, place, precision):
    rng = np.random.default_rng([SEED, len(body), len(place)])
    print("seed", SEED)
    vertices, *of_body, eye = placed(rng, body, place)
    loops, edges, inner = of_body
    rays = aimed(rng, vertices, edges, inner, eye, bench.by_speed(serial, 300, 20_000))
    hits = bench.hits(serial, STAGE + text_of(vertices, loops), rays, precision)
    passed = np.isinf(hits[:, 0])
    assert not passed.any(), f"{passed.sum()} of {len(rays)} rays pass"


@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("count", [41, 3])
def test_no_ray_passes_between_a_concave_and_a_convex_polygon(bench, serial, count, precision):
    """A concave polygon, which arrives as an open mesh, with the triangles that fill its notches."""
    rng = np.random.default_rng([SEED, count])
    print("seed", SEED)
    turns = 2 * np.pi * np.arange(2 * count) / (2 * count)
    lengths = np.where(np.arange(2 * count) % 2, rng.uniform(0.2, 0.4, 2 * count), 1)
    star = lengths[:, None] * np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    vertices = star * rng.uniform(0.7, 1.4, 3) @ turned(rng).T + rng.normal(size=3)
    places = np.array([[i, i + 1, (i + 2) % (2 * count)] for i in range(0, 2 * count, 2)])
    fill = "f 1 0.5 0.25 0.8 0 17 0 1\n"
    lines = [[*range(2 * count)], *places.tolist()]
    source = (
        VIEW
        + fill
        + "".join(
            f"p {len(line)}\n" + "".join(" ".join(map(repr, vertices[i].tolist())) + "\n" for i in line)
            for line in lines
        )
    )
    scene = nff.read(source)
    assert {type(shape).__name__ for shape in scene.objects} == {"Mesh", "Polygon"}
    edges = np.concatenate([places[:, :2], places[:, 1:]])
    eye = vertices.mean(axis=0) + np.cross(vertices[1] - vertices[0], vertices[2] - vertices[0])
    rays = aimed(rng, vertices, edges, places[:, 1], eye, bench.by_speed(serial, 300, 20_000))
    hits = bench.hits(serial, scene, rays, precision)
    assert np.isfinite(hits[:, 0]).all(), f"{np.isinf(hits[:, 0]).sum()} of {len(rays)} rays pass"


@pytest.mark.parametrize("place", ["near", "far"])
@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_no_pixel_in_lanes_shows_what_is_behind_an_edge(bench, laned, body, place, precision):
    """A picture of one row of pixels looks along an edge; all rays are tried against all polygons."""
    rng = np.random.default_rng([SEED, len(body), len(place)])
    print("seed", SEED)
    vertices, loops, edges, _, eye = placed(rng, body, place)
    shapes = text_of(vertices, loops, "(0.5,0.5,0.5) 0 1 (0,0,0) 1 1")
    for first, last in vertices[edges[rng.permutation(len(edges))[:8]]]:
        middle, aside = (first + last) / 2, (last - first) / 2
        up = np.cross(aside, eye - middle)
        camera = f"CAMERA {' '.join(map(words, (middle, aside, up, eye - middle)))}\n"
        exact = not bench.entry(laned).renderer.manifest.build
        settings = {"width": 2048, "height": 1, "depth": 0, "vector": "on", "accel": "none", "precision": precision}
        result = bench.result(laned, camera + GLOW + shapes, exact=exact, **settings)
        assert result.said.used["methods"]["vector"] == "on"
        bright = result.array[0, :, 0] > 0.9
        assert not bright.any(), f"{bright.sum()} of {len(bright)} pixels show the background"


def test_a_ray_in_the_plane_of_a_polygon_misses(bench, serial):
    """POL-1: along an axis and askew, beside the polygon and through it, in a plane that rounds to itself."""
    square = "POLYGON 4 (-1,-1,0.5) (1,-1,0.5) (1,1,0.5) (-1,1,0.5) " + MATERIAL + "\n"
    starts = [(-3, 0.25, 0.5), (0, 0, 0.5), (-3, -1, 0.5), (3, 0, 0.5), (-3, -2, 0.5)]
    ways = [(1, 0, 0), (0.6, 0.8, 0), (1, 0, 0), (-1, 0, 0), (0.6, 0.8, 0)]
    hits = bench.hits(serial, STAGE + square, np.hstack([starts, ways]))
    assert np.isinf(hits[:, 0]).all()


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_rays_that_start_in_the_plane_of_a_polygon_miss(bench, serial, place, precision):
    """POL-1: from inside of the polygon and beside it, in any direction and along the plane; from off it most hit."""
    rng = np.random.default_rng([SEED, len(place)])
    print("seed", SEED)
    scale, away = PLACES[place]
    turn, move = turned(rng), rng.normal(size=3)
    move *= away / np.linalg.norm(move)
    corners = scale * np.array([(-1, -1, 0), (1, -1, 0), (1.2, 1, 0), (-1, 1, 0)]) @ turn.T + move
    count = bench.by_speed(serial, 100, 2_000)
    weights = rng.dirichlet(np.ones(3), count) + rng.choice((0, 1), (count, 1)) * np.array([-2, 1, 1])
    ways = rng.normal(size=(count, 3)) * [1, 1, 0] @ turn.T + rng.choice((0, 1), (count, 1)) * turn[:, 2]
    inside = weights @ corners[:3]
    scene = STAGE + text_of(corners, [[0, 1, 2, 3]])
    assert np.isinf(bench.hits(serial, scene, np.hstack([inside, ways]), precision)[:, 0]).all()
    start = (rng.dirichlet(np.ones(3), count) @ corners[:3]) + scale * turn[:, 2]
    hits = bench.hits(serial, scene, np.hstack([start, rng.normal(0, 0.1, (count, 3)) - turn[:, 2]]), precision)
    assert np.isfinite(hits[:, 0]).mean() > 0.5


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_grazing_rays_hit_a_polygon_where_it_is(bench, serial, precision):
    """Rays at a slope of some u: where one hits, its t is between those of the vertices, but for rounding (POL-1)."""
    rng = np.random.default_rng(SEED)
    print("seed", SEED)
    turn, move = turned(rng), rng.normal(size=3)
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]) @ turn.T + move
    count = bench.by_speed(serial, 300, 20_000)
    slope = (1e-7 if precision == "float32" else 1e-16) * rng.uniform(-9, 9, count)
    targets = np.stack([*rng.uniform(-0.9, 0.9, (2, count)), 0 * slope], axis=1)
    angles = rng.uniform(0, 2 * np.pi, count)
    ways = np.stack([np.cos(angles), np.sin(angles), slope], axis=1)
    rays = np.hstack([(targets - 5 * ways) @ turn.T + move, ways @ turn.T])
    hits = bench.hits(serial, STAGE + text_of(corners, [[0, 1, 2, 3]]), rays, precision)
    hit = hits[:, 0] < np.inf
    assert 0.02 < hit.mean() < 0.98
    hits, starts, ways = hits[hit], rays[hit, :3], rays[hit, 3:]
    along = np.abs(ways).argmax(axis=1)[:, np.newaxis]
    ahead = np.take_along_axis(corners[np.newaxis] - starts[:, np.newaxis], along[..., np.newaxis], axis=2)[..., 0]
    ends = ahead / np.take_along_axis(ways, along, axis=1) * np.linalg.norm(ways, axis=1)[:, np.newaxis]
    assert (hits[:, 0] > ends.min(axis=1) - 1e-5).all() and (hits[:, 0] < ends.max(axis=1) + 1e-5).all()
