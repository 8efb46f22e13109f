"""Transmission, media and attenuation against closed forms, in float64 (MED, REF, TRA, ATT)."""

import math

import numpy as np
import pytest
from random_scenes import words
from stage import camera, close, linear, reflectance, square, turned

WHITE = "BACKGROUND (1,1,1)\n"
CLEAR = "(1,1,1)"


def glass(eps_r=2.25, mu_r=1.0, attenuation=CLEAR):
    return f"(0,0,0) 1 10 {attenuation} {eps_r} {mu_r}\n"


@pytest.fixture(params=[5, 6])
def turn(request):
    print("seed", request.param)
    return turned(np.random.default_rng(request.param))


@pytest.mark.parametrize("impact", [0.0, 0.37, 0.9, 0.99, 0.999])
@pytest.mark.parametrize("depth", [1, 2, 5, 10])
def test_furnace(bench, serial, turn, impact, depth):
    """A lossless ball in a white room sends back all but what the depth cuts off: 1 - (1 - R) R^(d-1)."""
    r = reflectance(1.5, math.sqrt(1 - impact**2))
    across = turn @ [impact, 0, 0]
    scene = camera(turn, (0, 0, 4), 1e-9) + WHITE + f"SPHERE {words(-across)} 1 {glass()}"
    close(bench.picture(serial, scene, width=1, height=1, depth=depth), 1 - (1 - r) * r ** (depth - 1))


@pytest.mark.parametrize("degrees", [0, 31, 64, 88])
@pytest.mark.parametrize("mu_r", [1.0, 1.7])
def test_reflected_and_transmitted_share_the_light(bench, serial, turn, degrees, mu_r):
    """In a white room depth 1 at a plane of glass gives R, and a mirror of k_s = 1/2 half of it (REF-2 to REF-4)."""
    angle = math.radians(degrees)
    way = np.array([math.sin(angle), 0, -math.cos(angle)])
    edges = [turn @ edge for edge in np.array([[40, 0, 0], [0, 40, 0], [0, 0, -9.0]])]
    box = f"BOX {words(turn @ [-20, -20, 0])} {' '.join(map(words, edges))} "
    view = camera(turn, -3 * way, 1e-9, towards=way) + WHITE
    eps_r = 2.25 / mu_r  # the same index 1.5 whatever mu_r
    n, m, c = 1 / 1.5, 1 / mu_r, math.cos(angle)
    s = math.sqrt(1 - n * n * (1 - c * c))
    r = (((n * c - m * s) / (n * c + m * s)) ** 2 + ((m * c - n * s) / (m * c + n * s)) ** 2) / 2
    close(bench.picture(serial, view + box + glass(eps_r, mu_r), width=1, height=1, depth=1), r)
    half = f"(0,0,0) 0.5 10 {CLEAR} {eps_r} {mu_r}\n"
    close(bench.picture(serial, view + box + half, width=1, height=1, depth=1), r / 2)


@pytest.mark.parametrize("degrees", [0, 25, 61])
def test_beer_lambert_through_a_slab(bench, serial, turn, degrees):
    """a^(L / cos θ') through a slab of thickness L, and the share that two faces let through (ATT-1)."""
    angle, thickness, depth = math.radians(degrees), 0.7, 2
    way = np.array([math.sin(angle), 0, -math.cos(angle)])
    edges = [turn @ edge for edge in np.array([[400, 0, 0], [0, 400, 0], [0, 0, -thickness]])]
    scene = camera(turn, -3 * way, 1e-9, towards=way) + WHITE
    scene += f"BOX {words(turn @ [-200, -200, 0])} {' '.join(map(words, edges))} {glass(attenuation='(0.9,0.4,0.05)')}"
    r = reflectance(1.5, math.cos(angle))
    inside = thickness / math.sqrt(1 - (math.sin(angle) / 1.5) ** 2)
    passed = np.array([0.9, 0.4, 0.05]) ** inside
    # order 2 is the last: the ray through both faces, and that mirrored inside, which ends in the glass
    close(bench.picture(serial, scene, width=1, height=1, depth=depth), r + (1 - r) ** 2 * passed)


def test_air_attenuates_what_is_seen_through_it(bench, serial, turn):
    scene = camera(turn, (0.2, 0.1, 5), 1e-9, towards=(-0.2, -0.1, -5)) + "AIR 1 1 (0.8,0.5,0.99)\nAMBIENT (1,1,1)\n"
    scene += square(turn, (0, 0, 0), (9, 0, 0), (0, 9, 0), "(0.6,0.7,0.8) 0 1 (0,0,0) 1 1")
    distance = math.hypot(0.2, 0.1, 5)
    expected = linear(0.6, 0.7, 0.8) * np.array([0.8, 0.5, 0.99]) ** distance
    close(bench.picture(serial, scene, width=1, height=1, depth=0), expected)


ROOM = (
    "AMBIENT (0.5,0.6,0.7)\nBACKGROUND (0.3,0.1,0.2)\n"
    "SPHERE (-1.9,0.3,-4) 1.7 (0.9,0.4,0.2) 0 20 (0,0,0) 9 1\n"
    "BOX (0.4,-1.6,-5.1) (1.3,0.2,0.1) (-0.2,1.4,0.3) (0.1,-0.2,1.2) (0.1,0.8,0.5) 0 20 (0,0,0) 4 1\n"
)
VIEW = "CAMERA (0.1,0.2,0) (1.1,0,0) (0,1.1,0) (0,0,2)\n"


@pytest.mark.parametrize("air", ["AIR 1 1 (1,1,1)\n", "AIR 1.7 1.3 (1,1,1)\n"])
def test_a_ball_of_the_air_s_own_index_is_not_there(bench, serial, air):
    """No ray is bent, trapped or lost by it, whatever the index of AIR (S16)."""
    eps_r, mu_r = air.split()[1:3]
    with_ball = VIEW + ROOM + air + f"SPHERE (0.2,0.1,-1.2) 0.9 {glass(eps_r, mu_r)}"
    pictures = [
        bench.picture(serial, source, width=24, height=24, depth=depth)
        for source, depth in ((with_ball, 9), (VIEW + ROOM + air, 0))
    ]
    close(pictures[0], pictures[1])


def test_what_is_nested_does_not_depend_on_the_order_of_the_file(bench, serial):
    """A glass ball in a ball of water, either first; water in water is only water (MED-2)."""
    water, ball = f"SPHERE (0,0.1,-2.5) 1.6 {glass(1.77)}", f"SPHERE (0.3,0,-2.4) 0.7 {glass(2.25)}"
    jobs = {"width": 20, "height": 20, "depth": 5}
    first = bench.picture(serial, VIEW + ROOM + water + ball, **jobs)
    close(bench.picture(serial, VIEW + ROOM + ball + water, **jobs), first)
    alone = bench.picture(serial, VIEW + ROOM + water, **jobs)
    assert np.abs(first - alone).max() > 0.01
    same = f"SPHERE (0.3,0,-2.4) 0.7 {glass(1.77)}"
    # its two faces take two orders of rays and bend none; what the depth cuts off is below 1e-15
    jobs["region"] = (8, 8, 12, 12)
    centre = bench.picture(serial, VIEW + WHITE + water + same, **jobs | {"depth": 34})
    close(centre, bench.picture(serial, VIEW + WHITE + water, **jobs | {"depth": 20}))


def test_glass_in_water_bends_by_the_ratio_of_the_two(bench, serial, turn):
    """The central ray through a box of water and one of glass in it: R of water/glass, not of air/glass (MED-3)."""
    scene = camera(turn, (0, 0, 9), 1e-9) + WHITE
    for half, eps_r in ((3.0, 1.77), (1.0, 2.25)):
        edges = [turn @ edge for edge in 2 * half * np.eye(3)]
        scene += f"BOX {words(turn @ np.full(3, -half))} {' '.join(map(words, edges))} {glass(eps_r)}"
    outer, inner = reflectance(math.sqrt(1.77), 1.0), reflectance(math.sqrt(2.25 / 1.77), 1.0)
    # to order 2: R, and into the water to the glass; the light mirrored there gets out at order 3
    picture = [bench.picture(serial, scene, width=1, height=1, depth=depth)[0, 0, 0] for depth in (1, 3)]
    assert abs(picture[0] - outer) < 1e-12
    assert abs(picture[1] - (outer + (1 - outer) ** 2 * inner)) < 1e-12


def test_an_eye_in_the_water_sees_as_if_air_were_water(bench, serial):
    """Everything lies in one ball of water, the eye too: the same picture as with AIR of that index."""
    ball = f"SPHERE (0.3,0.2,-1.4) 0.8 {glass(2.25)}"
    room = ""
    for axis, (low, high) in enumerate(((-7, 8), (-3, 5), (-6, 9))):  # closed, all within the water
        for k, place in enumerate((low, high)):
            arms = [tuple(row) for row in np.delete(30 * np.eye(3), axis, axis=0)]
            colour = words((0.2 + 0.3 * axis, 0.9 - 0.4 * k, 0.5))
            room += square(np.eye(3), place * np.eye(3)[axis], *arms, f"{colour} 0 1 (0,0,0) 1 1")
    lights = "AMBIENT (0.5,0.6,0.7)\n"
    jobs = {"width": 20, "height": 20, "depth": 3}
    in_water = VIEW + lights + ball + room + f"SPHERE (0,0,0) 500 {glass(1.77)}"
    in_air = VIEW + lights + ball + room + "AIR 1.77 1 (1,1,1)\n"
    pictures = [bench.picture(serial, source, **jobs) for source in (in_water, in_air)]
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("degrees", [30, 41, 42, 43, 70])
def test_total_reflection_from_inside(bench, serial, turn, degrees):
    """The eye in a block of glass, the face beyond under an angle: R, and 1 past 41.8 degrees (REF-2)."""
    angle = math.radians(degrees)
    way = np.array([math.sin(angle), 0, math.cos(angle)])
    edges = [turn @ edge for edge in np.diag([400.0, 400.0, 400.0])]
    scene = camera(turn, -2 * way, 1e-9, towards=way) + WHITE
    scene += f"BOX {words(turn @ [-200, -200, -400])} {' '.join(map(words, edges))} {glass()}"
    # order 1: what is transmitted sees the white room; what is mirrored goes on in the glass and ends there
    expected = 1 - reflectance(1 / 1.5, math.cos(angle))
    close(bench.picture(serial, scene, width=1, height=1, depth=1), expected)


def test_a_clear_pane_bends_nothing(bench, serial, turn):
    """A polygon bounds no medium: straight on, with R of one face lost (MED-4)."""
    scene = camera(turn, (0.3, 0.2, 4), 1e-9, towards=(-0.3, -0.2, -4)) + "AMBIENT (1,1,1)\n"
    scene += square(turn, (0, 0, 0), (3, 0, 0), (0, 3, 0), glass())
    scene += square(turn, (0, 0, -2), (9, 0, 0), (0, 9, 0), "(0.6,0.7,0.8) 0 1 (0,0,0) 1 1")
    cosine = 4 / math.hypot(0.3, 0.2, 4)
    expected = (1 - reflectance(1.5, cosine)) * linear(0.6, 0.7, 0.8)
    close(bench.picture(serial, scene, width=1, height=1, depth=1), expected)


def test_opaque_lets_nothing_through(bench, serial, turn):
    """(0, 0, 0) is a mark: no transmitted ray is counted, whatever the index (MED-1)."""
    scene = camera(turn, (0, 0, 4), 0.1) + WHITE + f"SPHERE (0,0,0) 1 {glass(attenuation='(0,0,0)')}"
    result = bench.result(serial, scene, width=3, height=3, depth=4)
    assert result.said.rays["transmitted"] == 0
    assert result.array.max() < 0.2


def test_depth_25_of_glass(bench, serial):
    """33 million rows would not fit; d + 1 do (WLK-1)."""
    scene = camera(np.eye(3), (0, 0, 4), 0.6) + WHITE + f"SPHERE (0,0,0) 1 {glass()}"
    picture = bench.picture(serial, scene, width=2, height=2, depth=25)
    np.testing.assert_allclose(picture, 1, rtol=0, atol=1e-9)
