"""Values and errors in words."""

import pytest

from reports.run.words import all_against

CENTRES = "at the centres of pixels"


@pytest.mark.parametrize(
    "texts, told",
    [
        ([], ""),
        (["", ""], ""),
        ([CENTRES, CENTRES, ""], CENTRES),
        ([f"{CENTRES} at depth 3"] * 2, f"{CENTRES} at depth 3"),
        ([f"{CENTRES} at depth {depth}" for depth in (3, 14, 0)], f"{CENTRES} at depths from 0 to 14"),
        (["over the areas of pixels at depth 0", CENTRES], f"over the areas of pixels at depth 0 and {CENTRES}"),
        (["at depth 2", "at depth 5"], "at depths from 2 to 5"),
        (["a at depth 1 and b at depth 2"], "a at depth 1 and b at depth 2"),  # a cell with two
    ],
)
def test_depths_are_named_together(texts, told):
    assert all_against(texts) == told


def test_the_last_word_is_between():
    assert all_against(["a at depth 1", "b"], " or ") == "a at depth 1 or b"
