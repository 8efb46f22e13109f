"""SPH-3: where the roots of the quadratic equation lose the sphere that the robust form hits, and where they do not."""

from functools import cache

import mpmath as mp
import numpy as np
import pytest
from random_scenes import MATERIAL, random_material, random_scene, random_stage

mp.mp.dps = 50
SEED = 20201107
RAYS = 300
SOURCE = f"CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\nSPHERE (0,0,0) 1 {MATERIAL}\n"
GRAZING = 1e-2  # rays nearer than this to the rim are not judged
FAR = {"float32": 4e3, "float64": 1e8}  # a sphere of radius 1 is lost from D = u^-1/2 on
NEAR = {"float32": 1e2, "float64": 1e6}
METHODS = ("textbook", "stable")


@cache
def far_case(distance, precision):
    """Rays (R, 6), numbers of the precision, from `distance` in random directions, and 1 - (impact/radius)² of each.

    Impact parameters are uniform in 0 to 1.5.
    """
    rng = np.random.default_rng([SEED, int(distance)])
    away = rng.normal(size=(RAYS, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    side = np.cross(away, rng.normal(size=(RAYS, 3)))
    side *= rng.uniform(0, 1.5, (RAYS, 1)) / np.linalg.norm(side, axis=1, keepdims=True)
    rays = np.hstack([away * distance, side - away * distance]).astype(precision).astype(np.float64)
    return rays, [1 - impact_squared(*(mp.matrix(part.tolist()) for part in (ray[:3], ray[3:]))) for ray in rays]


def impact_squared(origin, direction):
    """Squared distance of a line from (0, 0, 0), in 50 digits."""
    along = mp.fdot(origin, direction)
    return mp.fdot(origin, origin) - along * along / mp.fdot(direction, direction)


def wrong_fraction(bench, variant, method, distance, precision):
    """Share of rays that hit where they should miss or miss where they should hit, by 50 digits."""
    print("seed", [SEED, int(distance)])
    rays, margins = far_case(distance, precision)
    hits = bench.hits(variant, SOURCE, rays, precision=precision, sphere=method)
    judged = [
        (margin > 0) != np.isfinite(hit[0]) for hit, margin in zip(hits, margins, strict=True) if abs(margin) > GRAZING
    ]
    assert len(judged) > 0.9 * RAYS and 0.5 < np.mean([margin > 0 for margin in margins]) < 0.8
    print(f"{variant}, {method}, {precision}, {distance:g} away: {np.mean(judged):.3f} wrong")
    return np.mean(judged)


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_robust_hits_from_afar(bench, serial, precision):
    assert wrong_fraction(bench, serial, "robust", FAR[precision], precision) == 0


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("method", METHODS)
def test_the_discriminant_loses_a_far_sphere(bench, serial, method, precision):
    assert wrong_fraction(bench, serial, method, FAR[precision], precision) > 0.1


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("method", ("robust", *METHODS))
def test_every_method_hits_from_near(bench, serial, method, precision):
    assert wrong_fraction(bench, serial, method, NEAR[precision], precision) == 0


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("method", METHODS)
def test_the_tree_shows_all_that_a_method_hits(bench, serial, method, precision):
    """HIT-6: a method that errs, errs the same way with a tree and without."""
    print("seed", [SEED, int(FAR[precision])])
    rays, _ = far_case(FAR[precision], precision)
    jobs = {"precision": precision, "sphere": method}
    found = [bench.hits(serial, SOURCE, rays, accel=accel, **jobs) for accel in ("none", "bvh")]
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize("method", METHODS)
def test_an_ordinary_picture_is_the_same(bench, serial, method):
    """Mirrors and shadows in general position, from the outside and the inside of spheres."""
    rng = np.random.default_rng(SEED)
    print("seed", SEED)
    source = random_scene(rng, 7, 1, 1, 1, material=random_material, rest=random_stage(rng))
    source += "SPHERE (0.3,0.2,0.1) 1.1 (0.1,0.1,0.1) 0.9 40 (0.9,0.8,1) 2.25 1\n"
    side = bench.by_speed(serial, 12, 32)
    jobs = {"width": side, "height": side, "depth": 3, "shadows": True}
    result = bench.result(serial, source, sphere=method, **jobs)
    robust = bench.result(serial, source, **jobs)
    off = np.abs(result.array - robust.array)
    print(f"{serial}, {method}: off by {off.max():.3g}")
    assert 0 < off.max() <= 1e-9
    assert result.said.rays == robust.said.rays
    assert result.said.used["methods"]["sphere"] == method
