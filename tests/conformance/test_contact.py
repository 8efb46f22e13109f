"""Clear solids that touch other surfaces: one picture whatever they are cut into, in any order (MED-6 to MED-8)."""

import numpy as np
import pytest
from random_scenes import words
from stage import turned
from touching import FAR, GLASS, MATTE, RED, WATER, cut, parallelepiped, room, shuffled

KINDS = ("box", "sphere", "ellipsoid", "solid", "boxes", "meshes")
MOST = 0.002  # of the pixels
GATE = {"float64": 1e-6, "float32": 1 / 255}


def side(bench, variant):
    return bench.by_speed(variant, 20, 48)


def differ(one, other, gate):
    """The share of pixels that differ by more than `gate`."""
    return float((~(np.abs(one.astype(float) - other).max(axis=2) <= gate)).mean())


@pytest.fixture
def render(bench, serial):
    n = side(bench, serial)

    def picture(lines, **parameters):
        text = lines if isinstance(lines, str) else "\n".join(lines) + "\n"
        return bench.picture(serial, text, **{"width": n, "height": n, "depth": 6, "shadows": True, **parameters})

    return picture


@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_body_cut_in_two_looks_whole(render, kind, precision, tmp_path):
    seed = 2311, KINDS.index(kind)
    print("seed", seed)
    rng = np.random.default_rng(seed)
    lines, whole, parts = cut(rng, kind, tmp_path)
    expected = render(shuffled(rng, lines + whole), precision=precision)
    assert differ(render(shuffled(rng, lines + parts), precision=precision), expected, GATE[precision]) <= MOST


@pytest.mark.parametrize("kind", ["boxes", "solid"])
def test_the_order_of_the_file_changes_nothing(render, kind, tmp_path):
    rng = np.random.default_rng(77)
    lines, _, parts = cut(rng, kind, tmp_path)
    water = parts[1].replace(GLASS, WATER)
    first = render(shuffled(rng, [*lines, parts[0], water]))
    for _ in range(3):
        assert differ(render(shuffled(rng, [*lines, parts[0], water])), first, 1e-9) <= MOST


@pytest.mark.parametrize("depth", [0, 1, 2, 9])
def test_no_order_is_spent_on_a_cut(render, depth, tmp_path):
    rng = np.random.default_rng(5)
    lines, whole, parts = cut(rng, "boxes", tmp_path)
    assert differ(render(lines + parts, depth=depth), render(lines + whole, depth=depth), 1e-6) <= MOST


def test_without_the_rule_the_cut_shows(render, tmp_path):
    """`merge` none takes every face by itself, and loses the second of two."""
    rng = np.random.default_rng(5)
    lines, whole, parts = cut(rng, "boxes", tmp_path)
    assert differ(render(lines + parts, merge="none"), render(lines + whole, merge="none"), 1e-6) > 0.02


@pytest.mark.parametrize("sunk", ["box", "ball"])
def test_glass_on_a_floor_shows_the_floor(render, sunk):
    """As if it were sunk in it by next to nothing."""
    rng = np.random.default_rng(8)
    a, _, c = turned(rng)
    a, c = (np.array([x, 0, z]) / np.hypot(x, z) for x, _, z in (a, c))

    def scene(deep):
        if sunk == "ball":
            return [*room(rng, -1.1), f"SPHERE (0.1,{-0.1 - deep},0.2) 1 {GLASS}"]
        thing = parallelepiped([-0.8, -1.1 - deep, -0.3], (1.3 * a, [0, 1.6, 0], 1.1 * c))
        return [*room(rng, -1.1), f"{thing} {GLASS}"]

    state = rng.bit_generator.state
    on = render(scene(0.0))
    rng.bit_generator.state = state
    into = render(scene(1e-9))
    assert differ(on, into, 1e-5) <= 2 * MOST


def test_a_ball_in_a_shell_without_a_gap(render):
    """Of the shell's glass it is one ball; of water it is as a ball of water in a ball of glass."""
    lines = room(np.random.default_rng(3))
    place = "(0.1,0.2,0.1)"
    shell = f"AND SPHERE {place} 1.1 NOT SPHERE {place} 0.6 END END {GLASS}"
    ball = f"SPHERE {place} 1.1 {GLASS}"
    whole = render([*lines, ball])
    assert differ(render([*lines, f"SPHERE {place} 0.6 {GLASS}", shell]), whole, 1e-6) <= MOST
    nested = render([*lines, ball, f"SPHERE {place} 0.6 {WATER}"])
    assert differ(render([*lines, shell, f"SPHERE {place} 0.6 {WATER}"]), nested, 1e-6) <= MOST
    assert differ(whole, nested, 1e-3) > 0.05


def test_feelers_pass_a_cut(render):
    """A light and what it shines on, in a body of two pieces."""
    lines = [*room(np.random.default_rng(4)), "LIGHT (0.4,0.5,0.3) (1,1,1) 0", f"SPHERE (-0.5,-0.3,0.2) 0.3 {MATTE}"]
    rng = np.random.default_rng(6)
    a, b, c = turned(rng)
    body, start = "SPHERE (0,0,0) 1.1", -FAR * (b + c) + 0.05 * a
    half = parallelepiped(start, (2 * FAR * a, 2 * FAR * b, 2 * FAR * c))
    parts = [f"AND {body} {half} END {GLASS}", f"AND {body} NOT {half} END END {GLASS}"]
    whole = render([*lines, f"{body} {GLASS}"])
    assert differ(render([*lines, *parts]), whole, 1e-6) <= MOST
    assert differ(render([*lines, f"{body} {GLASS}"], shadows=False), whole, 1e-3) > MOST


def test_an_opaque_sheet_between_two_glasses(render):
    """It precedes both; of a body cut there, with the sheet, either half shows it from its side."""
    lines = room(np.random.default_rng(9))
    a, b, c = 1.2 * turned(np.random.default_rng(10))
    boxes = [parallelepiped(start, (a, 2 * b, 2 * c)) for start in (-a - b - c, -b - c)]
    corners = " ".join(words(x) for x in (-b - c, b - c, b + c, c - b))
    sheet = f"POLYGON 4 {corners} {MATTE}"
    parts = [*(f"{box} {GLASS}" for box in boxes), sheet]
    first = render([*lines, *parts])
    sunk = " ".join(words(x + 1e-9 * a) for x in (-b - c, b - c, b + c, c - b))
    whole = f"{parallelepiped(-a - b - c, (2 * a, 2 * b, 2 * c))} {GLASS}"
    assert differ(first, render([*lines, whole, f"POLYGON 4 {sunk} {MATTE}"]), 1e-5) <= 2 * MOST
    assert differ(render(shuffled(np.random.default_rng(2), [*lines, *parts])), first, 1e-9) <= MOST


@pytest.mark.parametrize("under", ["box", "ball", "mirror"])
def test_a_picture_on_a_wall_is_seen(render, under):
    """Opaque on opaque: the smaller precedes, in any order, as if it were in front by next to nothing."""
    rng = np.random.default_rng(14)
    lines, (a, b, c) = room(rng), turned(rng)
    while c[2] < 0.5:  # its front is seen
        a, b, c = turned(rng)
    mirror = MATTE.replace("0.1 20", "0.7 20")
    if under == "ball":
        things = [f"SPHERE (0,0,0) 1 {MATTE}", f"AND SPHERE (0,0,0) 1 {parallelepiped(-0.5 * a, (a, b, c))} END {RED}"]
        front = [things[0], things[1].replace("(0,0,0) 1", "(0,0,0) 1.000000001", 1)]
    else:
        wall = f"{parallelepiped(-a - b - c, (2 * a, 2 * b, c))} {mirror if under == 'mirror' else MATTE}"
        corners = [x * a + y * b for x, y in ((-0.5, -0.4), (0.6, -0.4), (0.6, 0.7), (-0.5, 0.7))]
        things, front = ([wall, f"POLYGON 4 {' '.join(words(p + up * c) for p in corners)} {RED}"] for up in (0, 1e-9))
    first = render([*lines, *things])
    assert differ(first, render([*lines, *front]), 1e-5) <= 2 * MOST
    assert differ(first, render([*lines, things[0]]), 1e-2) > 0.02
    for _ in range(2):
        assert differ(render(shuffled(rng, [*lines, *things])), first, 1e-9) <= MOST


@pytest.mark.parametrize("on", ["polygon", "ball", "box"])
def test_a_light_on_a_surface_shines(render, on):
    """As if it were in front of it by next to nothing, whichever way its feelers come."""
    rng = np.random.default_rng(16)
    lines, a = room(rng, -1.1), turned(rng)[0]
    lamp, up = np.array([0.2, 1.3, 0.4]), np.array([0.1, -0.9, 0.3])
    up /= np.linalg.norm(up)
    a = np.cross(up, a) / np.linalg.norm(np.cross(up, a))
    b = np.cross(up, a)
    things = {
        "polygon": f"POLYGON 3 {' '.join(words(lamp + p) for p in (a, b - a, -b))}",
        "ball": f"SPHERE {words(lamp - 0.4 * up)} 0.4",
        "box": parallelepiped(lamp - 0.5 * a - 0.3 * b - 0.2 * up, (a, b, 0.2 * up)),
    }

    def scene(*places):
        return [*lines, f"{things[on]} {MATTE}", *(f"LIGHT {words(place)} (1,1,1) 0" for place in places)]

    shines = render(scene(lamp))
    near = [lamp + 1e-9 * up] + [lamp - 1e-9 * up] * (on == "polygon")  # which has two sides
    assert differ(shines, render(scene(*near)), 1e-5) <= 0.01  # all but feelers in the plane
    assert differ(shines, render(scene(lamp - 0.01 * up)), 1e-2) > 0.05


@pytest.mark.parametrize("accel", ["none", "bvh"])
@pytest.mark.parametrize("walk", ["stack", "table"])
def test_by_any_search_and_walk(bench, serial, accel, walk, tmp_path):
    rng = np.random.default_rng(12)
    lines, whole, parts = cut(rng, "meshes", tmp_path)
    size = {"width": 12, "height": 12, "shadows": True, "walk": walk, "accel": accel, "depth": 3}
    whole, parts = (bench.picture(serial, "\n".join(lines + some) + "\n", **size) for some in (whole, parts))
    assert differ(parts, whole, 1e-6) <= 1 / 144
