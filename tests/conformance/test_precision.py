"""What float32 and fast-math do to a picture: rare and large errors, which mirrors multiply.

The bounds are a factor of three and more around what was measured elsewhere, with other code, on 48 spheres alike: at
depth 10 between perfect mirrors float32 leaves 1.8 % of the pixels off by more than 1/255, fast-math in float64 errs by
1.2e-7 at most, and half of the pixels are right to 3e-8.
"""

import numpy as np
import pytest

from harness.renderer.parameters import default_epsilon
from harness.scene.generate.lattice import lattice

SIDE = 96


@pytest.fixture
def error(bench, serial):
    """A function that gives the error of each pixel, of its worst channel, against strict float64."""

    if bench.known[serial].simulated:
        pytest.skip("the simulator's arithmetic is not that of a GPU")

    def find(material, depth, **method):
        size = {"width": SIDE, "height": SIDE, "depth": depth}
        found = bench.picture(serial, lattice(material), **size, **method)
        epsilon = default_epsilon(method.get("precision", "float64"))  # else that is what would be compared
        right = bench.picture(serial, lattice(material), **size, epsilon=epsilon)
        return np.abs(found.astype(np.float64) - right).max(axis=-1)

    return find


def bad(error):
    return np.mean(error > 1 / 255)


def test_float32_is_right_where_nothing_mirrors(error):
    off = error("matte", 0, precision="float32")
    assert off.max() < 1e-4 and 1e-9 < np.median(off[off > 0]) < 1e-7


def test_float32_errs_rarely_and_much_between_mirrors(error):
    shallow, deep = (error("perfect", depth, precision="float32") for depth in (1, 10))
    assert bad(shallow) < 0.001
    assert 0.018 / 5 < bad(deep) < 0.018 * 3
    assert deep.max() > 0.1 and np.median(deep[deep > 0]) < 1e-7


def test_fast_math_in_float64_errs_by_what_mirrors_make_of_rounding(error):
    shallow, deep = (error("perfect", depth, floating_point="fast") for depth in (1, 10))
    assert 0 < shallow.max() < 1e-12
    assert 1e-9 < deep.max() < 1e-5
