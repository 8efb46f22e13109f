"""The bound of a cut-off (CUT-3)."""

import numpy as np
import pytest

from harness.judge import bound
from harness.scene import text
from harness.scene.flatten import flatten

CAMERA = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,6)\n"


def arrays(source):
    return flatten(text.read(CAMERA + source))


def test_the_background_alone():
    scene = arrays("BACKGROUND (1,1,1)\n")
    np.testing.assert_array_equal(bound.radiance(scene, 5), [1, 1, 1])


def test_a_mirror_that_shines_adds_up_by_the_orders_that_are_left():
    """k_s = 0.5 and local light of at most 1 x 0.2 + 0.7 (1 + 0.5), by hand."""
    scene = arrays("AMBIENT (1,1,1)\nLIGHT (1,2,3) (1,1,1) 0\nSPHERE (0,0,-2) 1 (1,1,1) 0.5 9 (0,0,0) 9 1\n")
    scene["ambient"], scene["lights"][:, 3:6] = np.full(3, 0.2), 0.7
    local = 0.2 + 0.7 * 1.5
    for depth in (1, 2, 3, 8):
        expected = local * sum(0.5**k for k in range(depth))  # below an eye ray there are `depth` orders
        np.testing.assert_allclose(bound.radiance(scene, depth), expected, rtol=1e-14)


def test_nothing_is_below_an_eye_ray_of_depth_0():
    np.testing.assert_array_equal(bound.radiance(arrays("BACKGROUND (1,1,1)\n"), 0), 0)


@pytest.mark.parametrize("lights", [0, 1, 3])
def test_no_ray_is_brighter(bench, known, lights):
    """Pictures of random scenes are eye rays, so no pixel exceeds the radiance of one order more."""
    rng = np.random.default_rng(lights)
    print("seed", lights)
    lines = ["AMBIENT (0.4,0.5,0.6)", "BACKGROUND (0.3,0.9,0.2)"]
    for _ in range(lights):
        x, y, z = rng.uniform(-9, 9, 3)
        lines.append(f"LIGHT ({x},{y},{z}) (1,0.9,0.8) 0")
    for _ in range(9):
        (x, y), z, r = rng.uniform(-1, 1, 2), rng.uniform(-3, -1), rng.uniform(0.3, 0.8)
        red, green, blue, k_s = rng.uniform(0, 1, 4)
        lines.append(f"SPHERE ({x},{y},{z}) {r} ({red},{green},{blue}) {k_s} 20 (1,1,1) 2.2 1")
    source = CAMERA + "\n".join(lines) + "\n"
    name = "cpp" if known["cpp"].unavailable is None else "numba"
    picture = bench.picture(name, source, width=40, height=40, depth=4)
    assert (picture.max(axis=(0, 1)) <= bound.radiance(arrays("\n".join(lines) + "\n"), 5)).all()
