"""Which values of a parameter are tried by `make nightly` alone."""

import pytest


def by_night(values, *late, ids=str):
    """`values` as parameters with these ids, those whose id is among `late` marked nightly."""
    assert set(late) <= {ids(value) for value in values}, late
    return [pytest.param(value, id=ids(value), marks=[pytest.mark.nightly] * (ids(value) in late)) for value in values]
