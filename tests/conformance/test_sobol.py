"""The sampler `sobol`: the very points of SPEC.md (SOB-1 to SOB-4, SAM-7), and what they must converge to."""

import math

import draw
import numpy as np
import pytest
from random_scenes import words
from stage import camera, close, reflectance, rough_mirror, square, turned

WHITE = "BACKGROUND (1,1,1)\n"
MATTE = "0 1 (0,0,0) 4 1\n"
SIDE = 7


@pytest.fixture
def rng():
    seed = int(np.random.default_rng().integers(2**32))
    print("seed", seed)
    return np.random.default_rng(seed)


@pytest.mark.parametrize(
    ("point", "numbers"),
    [
        ((1234, 0, 0, 5, 42), (0x5D1E49, 0xE047AE)),
        ((262143, 37, 10, 56, 7), (0x33DB4D, 0x9EB4F4)),
        ((9, 2, 62, 2**32 - 1, 2**32 - 1), (0xA0DEE7, 0xDC9C5D)),
    ],
)
def test_the_vectors_of_the_specification(point, numbers):
    """Of a second writing of the rules, which all renderers are held against below."""
    assert tuple(draw.sobol(*point) * 2**24) == numbers


def half_plane(rng):
    """Scene text, and whether places (n, 2) in a picture of SIDE x SIDE, in pixels, are in its white part."""
    slope, shift = rng.uniform(-1, 1), rng.uniform(-0.1, 0.1)
    below = [(-9, -99), (9, -99), (9, 9 * slope + shift), (-9, -9 * slope + shift)]
    corners = " ".join(words((x, y, 0)) for x, y in below)
    source = f"CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\n{WHITE}POLYGON 4 {corners} (0,0,0) {MATTE}"
    return source, lambda places: 1 - 2 * places[:, 1] / SIDE > slope * (2 * places[:, 0] / SIDE - 1) + shift


@pytest.mark.parametrize("vector", ["off", "on"])
@pytest.mark.parametrize("count", [1, 6, 16])
def test_places_are_those_of_the_specification(bench, serial, vector, count, rng):
    source, white = half_plane(rng)
    moved, seed = rng.uniform(0, 1, 2), int(rng.integers(2**32))
    expected = np.zeros((SIDE, SIDE))
    for j in range(SIDE):
        for i in range(SIDE):
            drawn = np.array([draw.sobol(j * SIDE + i, 0, 0, s, seed) for s in range(count)])
            expected[j, i] = np.mean(white(np.array([i, j]) + drawn + moved - 0.5))
    job = {"width": SIDE, "height": SIDE, "sampler": "sobol", "spp": count, "seed": seed, "vector": vector}
    exact = (serial, vector) == ("numba", "on")  # whose lanes have kernels of what the job needs alone
    result = bench.result(serial, source, exact, **job, sample_x=moved[0], sample_y=moved[1])
    close(result.array[..., 1], expected)
    assert result.said.rays["primary"] == SIDE * SIDE * count


def edge_through_a_lens(radius, focal, behind, edge):
    """All rays go to one point at `focal`; white where they end left of an edge `behind` the lens."""
    source = "CAMERA (0,0,0) (1e-9,0,0) (0,1e-9,0) (0,0,2)\n" + WHITE
    corners = [(edge, -99), (99, -99), (99, 99), (edge, 99)]
    source += f"POLYGON 4 {' '.join(words((x, y, 2 - behind)) for x, y in corners)} (0,0,0) {MATTE}"
    return source, {"lens_radius": radius, "focal_distance": focal}


def test_places_on_the_lens_are_those_of_the_specification(bench, serial, rng):
    count, seed, radius, focal, behind, edge = 23, int(rng.integers(2**32)), 0.4, 2.0, 6.0, rng.uniform(-0.3, 0.3)
    source, lens = edge_through_a_lens(radius, focal, behind, edge)
    drawn = [draw.sobol(0, 0, 2, s, seed) for s in range(count)]
    x = np.array([radius * math.sqrt(u[0]) * math.cos(2 * math.pi * u[1]) for u in drawn])
    expected = np.mean(x * (1 - behind / focal) < edge)
    job = {"width": 1, "height": 1, "sampler": "sobol", "spp": count, "seed": seed}
    assert 0 < expected < 1
    close(bench.picture(serial, source, **lens, **job), expected)


def lit_floor(turn, lights, radius, between=""):
    source = camera(turn, (0.3, 0.2, 4), 1e-13, towards=(-0.3, -0.2, -4))
    source += between + square(turn, (0, 0, 0), (2, 0, 0), (0, 2, 0), f"(1,1,1) {MATTE}")
    return source + "".join(f"LIGHT {words(turn @ light)} (1,1,1) {radius!r}\n" for light in lights)


def light_from(turn, light, radius, us):
    """The mean of n·l over points of a light (SOF-2)."""
    points = [light + radius * (turn.T @ draw.on_sphere(u)) for u in us]
    return np.mean([point[2] / np.linalg.norm(point) for point in points])


@pytest.mark.parametrize(("count", "feelers"), [(5, 1), (3, 4)])
def test_feelers_of_all_samples_are_one_set(bench, serial, count, feelers, rng):
    """SOB-1: of each light its own dimensions; those beyond 64 are random numbers (RND-3)."""
    turn, seed, radius = turned(rng), int(rng.integers(2**32)), 0.7
    lights = [np.array([*rng.uniform(-1, 1, 2), rng.uniform(2, 4)]) for _ in range(33)]
    expected = 0.0
    for number, light in enumerate(lights):
        purpose = 2 + 2 * number
        if purpose < 64:
            us = [draw.sobol(0, 0, purpose, i, seed) for i in range(count * feelers)]
        else:
            us = [draw.uniforms(0, s, 0, 1 + number * feelers + f, seed) for s in range(count) for f in range(feelers)]
        expected += light_from(turn, light, radius, us)
    job = {"width": 1, "height": 1, "depth": 0, "shadows": True, "feelers": feelers, "seed": seed}
    source = lit_floor(turn, lights, radius)
    result = bench.result(serial, source, **job, sampler="sobol", spp=count)
    close(result.array, expected)
    assert result.said.rays["shadow"] == count * feelers * len(lights)


def test_feelers_of_a_reflection_have_dimensions_of_their_own(bench, serial, rng):
    """Seen in a mirror above the floor: order 1, path 1."""
    turn, seed, radius, count = np.eye(3), int(rng.integers(2**32)), 0.5, 6
    light = np.array([0.5, 0.4, 3.0])
    source = f"CAMERA (1.2,0,2) (1e-13,0,0) (0,1e-13,0) (0,0,-1)\nLIGHT {words(light)} (1,1,1) {radius}\n"
    source += square(turn, (1, 0, 9), (1, 0, 0), (0, -1, 0), "(0,0,0) 0.8 1e6 (0,0,0) 9 1\n")  # without a highlight
    source += square(turn, (0, 0, 0), (0.9, 0, 0), (0, 2, 0), f"(1,1,1) {MATTE}")
    source += square(turn, (1.2, 0, 0), (0.29, 0, 0), (0, 2, 0), f"(1,1,1) {MATTE}")
    light_there = light - np.array([1.2, 0, 0])
    us = [draw.sobol(0, 1, 2 + 2, s, seed) for s in range(count)]
    expected = 0.8 * reflectance(3.0, 1.0) * light_from(turn, light_there, radius, us)
    job = {"width": 1, "height": 1, "depth": 1, "shadows": True, "feelers": 1, "seed": seed}
    close(bench.picture(serial, source, **job, sampler="sobol", spp=count), expected)


@pytest.mark.parametrize(("count", "rays"), [(9, 1), (4, 3)])
def test_glossy_rays_of_all_samples_are_one_set(bench, serial, count, rays, rng):
    turn, seed, exponent = turned(rng), int(rng.integers(2**32)), float(rng.uniform(1, 30))
    source, r, normal = rough_mirror(turn, exponent, 40)
    side = turn.T @ r
    across = np.array([-side[2], 0, side[0]])
    source += square(turn, 5 * side + 1e4 * across, 1e4 * across, (0, 1e4, 0), f"(0,0,0) {MATTE}")
    lobes = [draw.lobe(r, normal, exponent, draw.sobol(0, 0, 2, i, seed)) for i in range(count * rays)]
    expected = np.mean([direction @ (turn @ across) < 0 for direction, _ in lobes])
    job = {"width": 1, "height": 1, "depth": 1, "glossy_rays": rays, "seed": seed, "sampler": "sobol", "spp": count}
    assert 0 < expected < 1
    close(bench.picture(serial, source, **job), 0.8 * reflectance(3.0, math.cos(math.radians(40))) * expected)


ACROSS = 32  # pixels of a picture's side: each has a scramble of its own


def z_of(picture, expected):
    """By how many of its standard errors the mean of a picture's pixels is off."""
    pixels = picture[..., 0].ravel()
    assert pixels.std() > 0
    return (pixels.mean() - expected) / (pixels.std() / math.sqrt(pixels.size))


@pytest.mark.parametrize("count", [1, 4, 7])
def test_the_mean_over_scrambles_is_right(bench, count, rng):
    """A lens's disc left of an edge, a light of some size, a lobe within a cone: closed forms, by 1,024 pixels each."""
    job = {"width": ACROSS, "height": ACROSS, "sampler": "sobol", "spp": count, "seed": int(rng.integers(2**32))}
    radius, focal, behind = 0.4, 2.0, 6.0
    place = rng.uniform(-0.8, 0.8)  # of the edge, in radii
    source, lens = edge_through_a_lens(radius, focal, behind, place * radius * (behind / focal - 1))
    share = 0.5 + (math.asin(place) + place * math.sqrt(1 - place**2)) / math.pi
    assert abs(z_of(bench.picture("cpp", source, **job, **lens), share)) < 4

    light, radius, turn = np.array([1.0, 2.0, 3.0]), 1.2, turned(rng)
    soft = {"depth": 0, "shadows": True, "feelers": 3}
    distance = np.linalg.norm(light)
    expected = light[2] / distance * (1 - radius**2 / (3 * distance**2))
    assert abs(z_of(bench.picture("cpp", lit_floor(turn, [light], radius), **job, **soft), expected)) < 4

    exponent, angle = 5, math.radians(35)
    source, r, _ = rough_mirror(turn, exponent, 10)
    source = source.replace(WHITE, "AMBIENT (1,1,1)\n")
    source += f"SPHERE {words(50 * r)} {50 * math.sin(angle)!r} (1,1,1) {MATTE}"
    share = 0.8 * reflectance(3.0, math.cos(math.radians(10))) * (1 - math.cos(angle) ** (exponent + 1))
    assert abs(z_of(bench.picture("cpp", source, **job, depth=1, glossy_rays=1), share)) < 4


@pytest.mark.parametrize(("count", "times"), [(16, 1.5), (64, 2)])
def test_errors_are_smaller_than_those_of_independent_numbers(bench, count, times, rng):
    """The edge through a lens, to which places in the pixel do nothing."""
    source, lens = edge_through_a_lens(0.4, 2.0, 6.0, rng.uniform(-0.5, 0.5))
    job = {"width": ACROSS, "height": ACROSS, "seed": int(rng.integers(2**32)), **lens}
    jittered = bench.picture("cpp", source, **job, sampler="jittered", samples=math.isqrt(count))[..., 0].std()
    assert bench.picture("cpp", source, **job, sampler="sobol", spp=count)[..., 0].std() < jittered / times
