"""Which values of a parameter are tried by `make nightly` alone."""

import pytest

REASON = "other values of this test show the same by day"


def by_night(values, *late, ids=str, reason=REASON):
    """`values` (of several parameters: tuples) with these ids, those whose id is among `late` marked nightly."""
    values = [value if isinstance(value, tuple) else (value,) for value in values]
    told = [ids(value[0] if len(value) == 1 else value) for value in values]
    assert set(late) <= set(told), late
    assert reason != REASON or set(late) < set(told), "all are late"
    marks = [[pytest.mark.nightly(reason)] * (name in late) for name in told]
    return [pytest.param(*value, id=name, marks=mark) for value, name, mark in zip(values, told, marks, strict=True)]
