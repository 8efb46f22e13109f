"""S6: how small and how large a scene may be."""

import pytest

from harness.stress.geometry.scales import ROWS
from harness.stress.row import ROUNDOFF

BY_NAME = {row.name: row for row in ROWS}
SEED = 20201107
PRECISIONS = ("float32", "float64")
# As far from the limit as the digits of a number reach, which are lost below the smallest that has all of them.
BEFORE, BEYOND = 0.85, 1.25


def share_wrong(strain, *arguments, **methods):
    """Of the answers; of all where the renderer or its contract gives the job up: it divides by 0, or answers NaN."""
    try:
        finding = strain(*arguments, **methods)
    except AssertionError as error:
        print(error)
        return 1.0
    return finding.failures / finding.count


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", BY_NAME)
def test_squares_stay_in_range_up_to_the_limit(strain, serial, name, precision):
    level = BEFORE * BY_NAME[name].limit(ROUNDOFF[precision], {})
    assert strain(serial, name, level, precision, SEED).failures == 0


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", BY_NAME)
def test_and_leave_it_beyond(strain, serial, name, precision):
    level = BEYOND * BY_NAME[name].limit(ROUNDOFF[precision], {})
    assert share_wrong(strain, serial, name, level, precision, SEED) > 0.3


@pytest.mark.parametrize("method", ["textbook", "wide"])
@pytest.mark.parametrize("name", ["scale-down", "scale-up"])
def test_no_form_of_the_sphere_reaches_farther(strain, serial, name, method):
    for level, wrong in ((0.4, False), (0.7, True)):
        assert (share_wrong(strain, serial, name, level, "float64", SEED, sphere=method) > 0.3) == wrong
