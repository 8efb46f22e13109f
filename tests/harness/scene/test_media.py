"""Bounding boxes, what solids hold, and the ranks of MED-2."""

import itertools
from dataclasses import replace

import cpu_time
import numpy as np
import pytest

from harness.errors import UserError
from harness.scene import text
from harness.scene.bounds import bounds
from harness.scene.flatten import flatten
from harness.scene.media import _meeting, holds, media
from harness.scene.model import Box, Csg, Ellipsoid, Mesh, Operator, Polygon, Sphere

CAMERA = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,100)\n"
MATT = " (1,1,1) 1 1 (0,0,0) 1e6 1\n"
GLASS = " (1,1,1) 1 1 (1,1,1) 2.25 1\n"
MURKY = " (1,1,1) 0 1 (0.5,0.5,0.5) 1 1\n"


def ranks(content, camera=CAMERA):
    return media(text.read(camera + content))


def frame(rng):
    return tuple(tuple(map(float, row)) for row in rng.normal(0, 1, (3, 3)))


def vector(rng, size=1.0):
    return tuple(map(float, rng.normal(0, size, 3)))


@pytest.mark.parametrize("seed", range(10))
def test_bounds_touch_what_is_in_them(seed):
    """Every bound is reached by some point of the shape, and passed by none."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    directions = np.vstack([directions, np.eye(3), -np.eye(3)])
    corners = np.array(list(itertools.product((0, 1), repeat=3)))
    origin, axes, radius = vector(rng), frame(rng), float(rng.uniform(0.1, 3))
    m = np.array(axes)
    reached = np.vstack([directions, (m / np.linalg.norm(m, axis=0)).T, -(m / np.linalg.norm(m, axis=0)).T])
    points = rng.normal(size=(5, 3))
    for shape, some in [
        (Sphere(None, origin, radius), origin + radius * directions),
        (Box(None, origin, axes), origin + corners @ m),
        (Ellipsoid(None, origin, axes), origin + reached @ m),
        (Polygon(None, tuple(map(tuple, points))), points),
        (Mesh(None, points, np.array([[0, 1, 2], [2, 3, 4]]), False), points),
    ]:
        ((low, high),) = bounds([shape])
        assert low == pytest.approx(some.min(axis=0), abs=1e-12)
        assert high == pytest.approx(some.max(axis=0), abs=1e-12)


def test_bounds_of_csg():
    a, b, c = Sphere(None, (0, 0, 0), 1.0), Sphere(None, (1, 0, 0), 1.0), Sphere(None, (9, 0, 0), 1.0)
    either, both, other = Operator.OR, Operator.AND, Operator.NOT
    infinite = [[-np.inf] * 3, [np.inf] * 3]
    for code, expected in [
        ((a,), [[-1, -1, -1], [1, 1, 1]]),
        ((a, b, either), [[-1, -1, -1], [2, 1, 1]]),
        ((a, b, both), [[0, -1, -1], [1, 1, 1]]),
        ((a, other), infinite),
        ((a, b, other, both), [[-1, -1, -1], [1, 1, 1]]),
        ((a, b, other, either), infinite),
        ((a, b, either, other), infinite),
        ((a, c, both), [[np.inf] * 3, [-np.inf] * 3]),
        ((a, c, both, b, either), [[0, -1, -1], [2, 1, 1]]),
        ((a, c, both, other), infinite),
    ]:
        assert bounds([Csg(None, code)])[0].tolist() == expected


@pytest.mark.parametrize("seed", range(10))
def test_solids_hold_points_from_within(seed):
    """Points made inside and outside by the shape's own parameters."""
    rng = np.random.default_rng(seed)
    centre, axes = np.array(vector(rng, 10)), np.array(frame(rng))
    sphere, box = Sphere(None, tuple(centre), 0.7), Box(None, tuple(centre), tuple(map(tuple, axes)))
    ellipsoid = Ellipsoid(None, tuple(centre), tuple(map(tuple, axes)))
    for _ in range(50):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        for size in (0, 0.5, 0.999999, 1.000001, 2):
            assert holds(sphere, centre + 0.7 * size * direction) == (size < 1)
            assert holds(ellipsoid, centre + size * direction @ axes) == (size < 1)
        place = rng.uniform(0.001, 0.999, 3)
        assert holds(box, centre + place @ axes)
        place[rng.integers(3)] = rng.choice([-0.001, 1.001, 5])
        assert not holds(box, centre + place @ axes)
    assert not holds(Sphere(None, (0, 0, 0), 1.0), (0, 0, 1))


@pytest.mark.parametrize("seed", range(20))
def test_ranks(seed):
    """Random shapes, against every pair of boxes compared one by one and a stable sort by volume."""
    rng = np.random.default_rng(seed)
    lines = []
    for _ in range(40):
        x, y, z = rng.uniform(-10, 10, 3).round(1)
        size = rng.choice([0.3, 1.0, 2.5])
        material = [MATT, GLASS, MURKY][rng.choice(3, p=[0.5, 0.4, 0.1])]
        # Boxes are cubes that fill their own box, so that volumes are often the same as a sphere's.
        shape = [
            f"SPHERE ({x},{y},{z}) {size}",
            f"BOX ({x},{y},{z}) ({2 * size},0,0) (0,{2 * size},0) (0,0,{2 * size})",
            f"POLYGON 3 ({x},{y},{z}) ({x + size},{y},{z}) ({x},{y + size},{z + 1})",
            f"NOT SPHERE ({x},{y},{z}) 9 END",
        ][rng.choice(4, p=[0.4, 0.4, 0.19, 0.01])]
        lines.append(shape + material)
    x, y, z = rng.uniform(-5, 5, 3).round(1)
    scene = text.read(f"CAMERA ({x},{y},{z - 1}) (1,0,0) (0,1,0) (0,0,1)\n" + "".join(lines))
    boxes = bounds(scene.objects)
    expected = []
    for i, thing in enumerate(scene.objects):
        if isinstance(thing, Polygon) or thing.material.attenuation == (0, 0, 0):
            continue
        inside = holds(thing, (x, y, z))
        meets = any(
            all(boxes[i][0][k] <= other[1][k] + 1e-9 and other[0][k] <= boxes[i][1][k] + 1e-9 for k in range(3))
            for j, other in enumerate(boxes)
            if j != i
        )
        if inside or (meets and thing.material.k_s > 0):
            side = 2 * thing.radius if isinstance(thing, Sphere) else np.inf
            side = thing.edges[0][0] if isinstance(thing, Box) else side
            expected.append((-round(side**3, 6), i, inside))
    assert media(scene) == [(i, inside) for _, i, inside in sorted(expected)]


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("SPHERE (0,0,0) 1" + GLASS, []),
        ("SPHERE (0,0,0) 1" + GLASS + "SPHERE (5,0,0) 1" + GLASS, []),
        ("SPHERE (0,0,0) 1" + GLASS + "SPHERE (2,0,0) 1" + MATT, [0]),  # they touch
        ("SPHERE (0,0,0) 1" + GLASS + "SPHERE (2.000001,0,0) 1" + MATT, []),
        ("SPHERE (0,0,0) 1" + GLASS + "POLYGON 3 (-9,-1,-9) (9,-1,-9) (0,-1,9)" + MATT, [0]),
        ("SPHERE (0.1,0,0) 0.1" + GLASS + "SPHERE (0.3,0,0) 0.1" + GLASS, [0, 1]),  # 0.2 and 0.19999999999999998
        ("SPHERE (0,0,0) 1" + GLASS + "SPHERE (0,0,0) 2" + GLASS, [1, 0]),
        ("SPHERE (0,0,0) 2" + GLASS + "SPHERE (0,0,0) 1" + GLASS, [0, 1]),
        ("SPHERE (0,0,0) 1" + GLASS + "SPHERE (0.1,0.7,0.3) 1" + GLASS, [0, 1]),  # as large: in order
        ("SPHERE (0.1,0.7,0.3) 1" + GLASS + "SPHERE (0,0,0) 1" + GLASS, [0, 1]),
        ("SPHERE (0,0,0) 1" + MURKY + "SPHERE (0,0,0) 2" + GLASS, [1]),
        ("SPHERE (0,0,0) 1" + GLASS + "NOT SPHERE (0,0,0) 9 END" + GLASS, [1, 0]),  # (0, 0, 100) is in NOT
        ("SPHERE (0,0,0) 1" + GLASS + "AND SPHERE (0,0,0) 1 SPHERE (5,0,0) 1 END" + GLASS, []),  # of nothing
        ("POLYGON 3 (0,0,0) (1,0,0) (0,1,0)" + GLASS + "SPHERE (0,0,0) 1" + MATT, []),
    ],
)
def test_who_is_ranked(content, expected):
    assert [i for i, _ in ranks(content)] == expected


def test_the_eye_is_in_what_holds_it():
    camera = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,1)\n"
    content = "SPHERE (0,0,0) 3" + GLASS + "BOX (-1,-1,-1) (2,0,0) (0,2,0) (0,0,3)" + MURKY
    content += "SPHERE (0,0,0) 0.5" + GLASS + "SPHERE (0,0,1) 0.25" + MATT
    content += "AND SPHERE (0,0,0) 2 NOT SPHERE (0,0,1) 0.1 END END" + GLASS
    assert ranks(content, camera) == [(0, True), (4, False), (1, True), (2, False)]
    assert flatten(text.read(camera + content))["media"].tolist() == [[0, 0, 1], [4, 0, 0], [1, 1, 1], [2, 0, 0]]
    assert ranks("SPHERE (0,0,0) 3" + GLASS, camera) == [(0, True)]  # alone, and ranked for the eye


def test_no_more_than_a_set_can_hold():
    line = "SPHERE ({},0,0) 0.5" + GLASS
    assert len(ranks("".join(line.format(i) for i in range(63)))) == 63
    with pytest.raises(UserError) as caught:
        ranks("".join(line.format(i) for i in range(64)))
    why = "scene.txt:65: more than 63 clear solids touch other objects or contain the eye"
    assert str(caught.value).startswith(why)
    apart = "".join(line.format(1.1 * i) for i in range(500))
    assert ranks(apart) == []


@pytest.mark.parametrize("seed", range(20))
def test_which_of_many_meet(seed):
    """More than are compared at once, on all axes and on some, on a lattice whose boxes touch, and in one place."""
    print("seed", seed)
    draw = np.random.default_rng(seed)
    count = draw.integers(100, 600)
    low = draw.uniform(-2, 2, (count, 3)) * draw.choice([1, 1, 10, 0], 3)
    low = low.round(1) if seed % 3 == 0 else low
    boxes = np.stack([low, low + draw.uniform(0, 0.3, (count, 3))], axis=1)
    boxes[:, 1] = np.where(seed % 3, boxes[:, 1], low + 0.2)
    chosen = np.flatnonzero(draw.random(count) < draw.random())
    overlap = [((boxes[:, 0] <= box[1]) & (box[0] <= boxes[:, 1])).all(axis=1).sum() > 1 for box in boxes]
    found = list(_meeting(boxes, chosen))
    assert sorted(found) == [i for i in chosen if overlap[i]]


@pytest.mark.alone
def test_many_objects_take_little_time():
    scene = text.read(CAMERA + "SPHERE (0,0,0) 0.4" + GLASS)
    (glass,) = scene.objects
    many = tuple(
        replace(glass, centre=(float(i), float(j), float(k))) for i in range(20) for j in range(20) for k in range(20)
    )
    found, took = cpu_time.seconds(lambda: media(replace(scene, objects=many)))
    assert found == [] and took < 10
