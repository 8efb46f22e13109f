"""The generator matrices of the Sobol' sequence (SOB-2)."""

import numpy as np
import pytest
from scipy.stats import qmc

from harness.renderer import sobol


def points(count):
    """Points (count, 64) as words of 32 bits, the first digit in the lowest bit."""
    found = np.zeros((count, sobol.DIMENSIONS), np.uint32)
    for bit in range(count.bit_length() - 1):
        has = np.arange(count) >> bit & 1 == 1
        found[has] ^= sobol.matrices()[:, bit]
    return found


def fractions(words):
    return np.array([[int(f"{word:032b}"[::-1], 2) / 2**32 for word in row] for row in words.tolist()])


def test_they_are_those_of_scipy():
    """Which takes the numbers of Joe and Kuo too: the same points, in another order."""
    ours, theirs = fractions(points(256)), qmc.Sobol(sobol.DIMENSIONS, scramble=False, bits=32).random(256)
    assert sorted(map(tuple, ours)) == sorted(map(tuple, theirs))


def test_high_bits_are_those_of_scipy():
    """Point 2^k is entry k alone; in SciPy's order of Gray codes it is number 2^(k + 1) - 1."""
    for bit in (7, 19, 29):
        theirs = qmc.Sobol(sobol.DIMENSIONS, scramble=False, bits=32)
        theirs.fast_forward(2 ** (bit + 1) - 1)
        np.testing.assert_array_equal(fractions(sobol.matrices()[:, bit][None]), theirs.random(1))


@pytest.mark.parametrize("dimension", [0, 2, 30, 62])
def test_each_dimension_has_one_point_in_each_interval(dimension):
    for count in (16, 128):
        for k in (0, 1):
            cells = np.floor(fractions(points(count)[:, [dimension + k]]) * count).astype(int)
            assert sorted(cells.ravel()) == list(range(count))


def test_the_first_two_have_one_point_in_each_elementary_interval():
    """A (0, m, 2)-net: of every shape."""
    m = 8
    places = fractions(points(2**m)[:, :2])
    for across in range(m + 1):
        cells = {(int(x * 2**across), int(y * 2 ** (m - across))) for x, y in places}
        assert len(cells) == 2**m
