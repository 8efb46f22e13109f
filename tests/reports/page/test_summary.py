"""The summary in words: what it says of masks."""

import pytest

from reports.page import summary


@pytest.mark.parametrize(("shares", "said"), [((0.1, None), None), ((0.11, 0.02), "11 %"), ((0.05, 0.4), "40 %")])
def test_a_mask_above_a_tenth_is_said(load, record, shares, said):
    """Of the largest, with the places; not of cells without a reference."""
    records = [record(name) for name in ("python", "numpy")]
    for one, share in zip(records, shares, strict=True):
        one["agreement"] = {"unavailable": "no"} if share is None else one["agreement"] | {"mask_fraction": share}
    text = summary.write(load(records))
    assert ("mask of ill-conditioned pixels" in text) == (said is not None)
    assert said is None or f"up to {said}: " in text
