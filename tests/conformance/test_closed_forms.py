"""Scenes whose picture is known on paper, for every renderer in float64."""

import math

import numpy as np
import pytest
import seeds
from stage import OPAQUE, camera, close, linear, square, turned, words


@pytest.fixture(params=[1, 2])
def turn(request):
    print("seed", request.param)
    return turned(np.random.default_rng(request.param))


def test_background(bench, variant):
    picture = bench.picture(
        variant, "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,1)\nBACKGROUND (0.2,0.5,0.9)\n", width=5, height=3
    )
    assert picture.shape == (3, 5, 3)
    close(picture, linear(0.2, 0.5, 0.9))


def test_ambient_alone_is_flat(bench, variant, turn):
    source = camera(turn, (0, 0, 5), 0.1) + "AMBIENT (0.3,0.4,0.5)\n"
    source += f"SPHERE {words(turn @ [0, 0, 0])} 2 (0.9,0.5,0.1) 0.5 10 {OPAQUE} 4 1\n"
    picture = bench.picture(variant, source, width=4, height=4, depth=0)
    close(picture, linear(0.3, 0.4, 0.5) * linear(0.9, 0.5, 0.1))


@pytest.mark.parametrize("degrees", [0, 37, 89, 91, 180])
def test_diffuse_is_the_cosine(bench, serial, turn, degrees):
    """A point of a plane lit under an angle: k_d cos θ (LOC-3); nothing from behind."""
    angle = math.radians(degrees)
    light = np.array([7 * math.sin(angle), 0, 7 * math.cos(angle)])
    source = camera(turn, (0.3, 0.2, 4), 0.001, towards=(-0.3, -0.2, -4))
    source += square(turn, (0, 0, 0), (2, 0, 0), (0, 2, 0), f"(0.8,0.6,0.4) 0 10 {OPAQUE} 4 1")
    source += f"LIGHT {words(turn @ light)} (0.5,0.7,0.9) 0\n"
    picture = bench.picture(serial, source, width=1, height=1, depth=0)
    close(picture, linear(0.8, 0.6, 0.4) * linear(0.5, 0.7, 0.9) * max(0.0, math.cos(angle)))


@pytest.mark.parametrize("exponent", [0, 1, 5.5, 400])
@pytest.mark.parametrize("off", [0, 10, 100])
def test_phong_is_the_power_of_the_cosine(bench, serial, exponent, off):
    """The eye `off` degrees away from the mirrored light: k_s cos^m (LOC-4), nothing past 90."""
    turn = turned(np.random.default_rng(3))
    tilt = math.radians(40)  # light 40 degrees from the normal, so its mirror image is at -40
    seen = math.radians(-40 + off)
    light = 9 * np.array([math.sin(tilt), 0, math.cos(tilt)])
    eye = 3 * np.array([math.sin(seen), 0, math.cos(seen)])
    source = camera(turn, eye, 1e-9, towards=-eye)
    source += square(turn, (0, 0, 0), (2, 0, 0), (0, 2, 0), f"(0,0,0) 0.6 {exponent} {OPAQUE} 4 1")
    source += f"LIGHT {words(turn @ light)} (1,0.8,0.6) 0\n"
    picture = bench.picture(serial, source, width=1, height=1, depth=0)
    cosine = math.cos(math.radians(off))
    expected = 0.6 * cosine**exponent if cosine > 0 else 0
    # the power magnifies a rounded cosine m times
    np.testing.assert_allclose(picture[0, 0], expected * linear(1, 0.8, 0.6), rtol=0, atol=1e-12 * max(1, exponent))


def test_shadow_of_a_disc_like_shape(bench, variant, turn):
    """A blocker between floor and light: lit outside its projection, ambient inside, and no acne anywhere (OFF-1)."""
    floor = f"(0.8,0.8,0.8) 0 1 {OPAQUE} 4 1"
    source = camera(turn, (0.01, 0.02, 6), 0.5) + "AMBIENT (0.5,0.5,0.5)\n"
    source += square(turn, (0, 0, 0), (5, 0, 0), (0, 5, 0), floor)
    source += square(turn, (0.5, 0, 9), (2, 0, 0), (0, 2, 0), floor)  # behind the eye, before the light
    source += f"LIGHT {words(turn @ [0, 0, 18])} (1,1,1) 0\n"
    size = 24
    with_shadows = bench.picture(variant, source, width=size, height=size, depth=0, shadows=True)
    without = bench.picture(variant, source, width=size, height=size, depth=0)
    ambient = linear(0.5, 0.5, 0.5) * linear(0.8, 0.8, 0.8)
    # screen point (X, Y) sees the floor at the eye plus 6 times the direction; halfway to the light it is at half that
    z = np.array([0, 0, -1.0])
    x = np.cross(z, (0.31, 0.83, 0.47))
    x /= np.linalg.norm(x)
    y = np.cross(x, z)
    for j in range(size):
        for i in range(size):
            across, down = 2 * (i + 0.5) / size - 1, 1 - 2 * (j + 0.5) / size
            point = np.array([0.01, 0.02, 0]) + 6 * 0.5 * (across * x + down * y)
            crossing = point / 2
            margin = max(abs(crossing[0] - 0.5), abs(crossing[1])) - 2
            if abs(margin) < 1e-6:
                continue
            close(with_shadows[j, i], ambient if margin < 0 else without[j, i])
            assert (without[j, i] > ambient).all()


def test_what_is_behind_the_light_casts_no_shadow(bench, variant, turn):
    """HIT-5: a feeler ends at the light."""
    source = camera(turn, (0.1, 0.2, 6), 0.1)
    matt = f"(0.8,0.8,0.8) 0 1 {OPAQUE} 4 1"
    source += square(turn, (0, 0, 0), (5, 0, 0), (0, 5, 0), matt)
    source += square(turn, (0, 0, 20), (50, 0, 0), (0, 50, 0), matt)
    for x in (-1.5, 1.1):
        source += f"LIGHT {words(turn @ [x, 0.3, 19])} (1,1,1) 0\n"
    jobs = {"width": 6, "height": 6, "depth": 0}
    without = bench.picture(variant, source, **jobs)
    assert (without > 0.1).all()
    np.testing.assert_array_equal(bench.picture(variant, source, shadows=True, **jobs), without)


@pytest.mark.parametrize("depth", [0, 1, 2, 7, 30])
def test_two_facing_mirrors_sum_a_geometric_series(bench, serial, turn, depth):
    """Normal incidence between parallel mirrors: a k_d Σ (k_s R)^i, R = ((N - M)/(N + M))² (REF-2, REF-4, REF-5)."""
    eps, mu, k_s = 5.3, 1.7, 0.9
    material = f"(0.6,0.7,0.8) {k_s} 10 {OPAQUE} {eps} {mu}"
    source = camera(turn, (0.1, 0.2, 0.3), 1e-9) + "AMBIENT (0.5,0.6,0.7)\nAIR 1.2 1.1 (1,1,1)\n"
    source += square(turn, (0, 0, -1), (3, 0, 0), (0, 3, 0), material)
    source += square(turn, (0, 0, 2), (3, 0, 0), (0, 3, 0), material)
    result = bench.result(serial, source, width=1, height=1, depth=depth)
    n, m = math.sqrt(1.2 * 1.1 / (eps * mu)), 1.1 / mu
    weight = k_s * ((n - m) / (n + m)) ** 2
    series = sum(weight**order for order in range(depth + 1))
    close(result.array, linear(0.5, 0.6, 0.7) * linear(0.6, 0.7, 0.8) * series)
    assert result.said.rays["reflected"] == depth


@pytest.mark.parametrize("degrees", [5, 56.309932474020215, 80])
def test_fresnel_at_an_angle(bench, serial, degrees):
    """A mirror of n = 1.5 shows an ambient wall: R from the sines and tangents of Fresnel's own form."""
    turn = turned(np.random.default_rng(5))
    angle = math.radians(degrees)
    eye = 2 * np.array([math.sin(angle), 0, math.cos(angle)])
    source = camera(turn, eye, 1e-9, towards=-eye) + "AMBIENT (1,1,1)\n"
    source += square(turn, (0, 0, 0), (1, 0, 0), (0, 1, 0), f"(0,0,0) 0.8 1 {OPAQUE} 2.25 1")
    away = np.array([-math.sin(angle), 0, math.cos(angle)])
    source += square(turn, 5 * away, (0, 4, 0), np.cross((0, 4, 0), away), f"(0.5,0.6,0.7) 0 1 {OPAQUE} 4 1")
    picture = bench.picture(serial, source, width=1, height=1, depth=1)
    refracted = math.asin(math.sin(angle) / 1.5)
    perpendicular = (math.sin(angle - refracted) / math.sin(angle + refracted)) ** 2
    parallel = (math.tan(angle - refracted) / math.tan(angle + refracted)) ** 2
    close(picture, 0.8 * (perpendicular + parallel) / 2 * linear(0.5, 0.6, 0.7))


def test_total_internal_reflection(bench, serial, turn):
    """Inside a box of n = 1.5, rays that meet its faces at 45 degrees are past the critical angle: R = 1 at each."""
    k_s, depth = 0.7, 6
    source = camera(turn, (0.13, 0.05, -0.21), 1e-9, towards=(1, 0, 1)) + "AMBIENT (0.5,0.5,0.5)\n"
    corner, edges = turn @ [-1, -1, -1], [turn @ edge for edge in ([2, 0, 0], [0, 2, 0], [0, 0, 2])]
    source += f"BOX {words(corner)} {' '.join(map(words, edges))}\n(0.9,0.8,0.7) {k_s} 1 {OPAQUE} 2.25 1\n"
    picture = bench.picture(serial, source, width=1, height=1, depth=depth)
    series = sum(k_s**order for order in range(depth + 1))
    close(picture, linear(0.5, 0.5, 0.5) * linear(0.9, 0.8, 0.7) * series)


def test_a_dull_mirror_traces_no_ray(bench, serial):
    """A weight k_s R of 0 ends the path (REF-4): matched media have R = 0."""
    source = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,4)\nAMBIENT (1,1,1)\n"
    for k_s, eps in ((0, 1e6), (1, 1)):
        scene = source + f"POLYGON 3 (-9,-9,-1) (9,-9,-1) (0,9,-1) (0.5,0.5,0.5) {k_s} 1 {OPAQUE} {eps} 1\n"
        result = bench.result(serial, scene, width=3, height=3, depth=5)
        assert result.said.rays["reflected"] == 0


@pytest.mark.parametrize("vector", ["off", "on"])
def test_matched_media_mirror_nothing_when_arithmetic_is_fast(bench, variant, vector):
    """REF-2 asks whether n and mu are equal: the quotient of equals by a fast reciprocal need not be 1."""
    entry = bench.entry(variant)
    lanes = "on" in entry.methods.get("vector", ()) and entry.renderer.manifest.build  # Numba's are strict
    if "fast" not in entry.methods.get("floating_point", ()) or (vector == "on" and not lanes):
        pytest.skip(f"{variant} has no such method")
    if entry.simulated:
        pytest.skip("the simulator of a GPU is strict")
    rng = np.random.default_rng(seeds.numbers("matched media"))
    for eps, mu in rng.uniform(1, 3, (10, 2)):
        source = "CAMERA (0,0,0) (0.5,0,0) (0,0.5,0) (0,0,4)\nAMBIENT (1,1,1)\n"
        for radius in (40, 5, 4, 3):  # the eye is in the first; three times, glass begins in glass
            source += f"SPHERE (0,0,-5) {radius} (0.5,0.5,0.5) 0.8 1 (1,1,1) {eps} {mu}\n"
        job = {"width": 16, "height": 16, "depth": 3, "precision": "float32", "vector": vector}
        result = bench.result(variant, source, floating_point="fast", **job)
        print(f"seed {seeds.seed()}: {eps} {mu}: {result.said.rays}")
        assert result.said.rays["transmitted"] == 3 * 16 * 16
        assert result.said.rays["reflected"] == 0


def test_scale_does_not_matter(bench, serial):
    """The same scene in units from 1e-6 to 1e6: the same picture, for OFF-1 has no length in it."""
    pictures = []
    for scale in (1.0, 1e-6, 1e6):

        def at(*vector, scale=scale):
            return words(scale * np.array(vector))

        source = f"CAMERA {at(0.3, 0.1, 0)} {at(1, 0, 0)} {at(0, 1, 0)} {at(0.2, 0.4, 3)}\nAMBIENT (0.3,0.3,0.3)\n"
        source += f"LIGHT {at(3, 7, 5)} (1,1,1) 0\n"
        for centre, radius in (((0, 0, -2), 1), ((1.2, 0.7, -0.5), 0.4), ((-1.1, -0.3, -1), 0.6)):
            source += f"SPHERE {at(*centre)} {radius * scale} (0.6,0.5,0.4) 0.8 20 {OPAQUE} 1e6 1\n"
        source += (
            f"BOX {at(-3, -2, -4)} {at(6, 0.1, 0)} {at(0.1, 0.5, 0)} {at(0, 0.1, 5)} (0.3,0.5,0.6) 0.5 9 {OPAQUE} 9 1\n"
        )
        pictures.append(bench.picture(serial, source, width=40, height=40, depth=3, shadows=True))
    for picture in pictures[1:]:
        different = np.abs(picture - pictures[0]).max(axis=-1) > 1e-6
        assert different.mean() <= 2 / 1600, "more than edge pixels change with the unit of length"


def test_a_far_eye_sees_no_acne(bench, serial):
    """HIT-4: the point is moved onto the surface, so a large t leaves no error that a shadow feeler would trip over."""
    source = "CAMERA (0,0,0) (0.7,0,0) (0,0.7,0) (0,0,1e6)\nSPHERE (0,0,0) 1 (0.8,0.8,0.8) 0 1 (0,0,0) 4 1\n"
    source += "LIGHT (3e5,2e5,9e6) (1,1,1) 0\n"
    lit = bench.picture(serial, source, width=40, height=40, depth=0)
    shadowed = bench.picture(serial, source, width=40, height=40, depth=0, shadows=True)
    np.testing.assert_array_equal(lit, shadowed)
