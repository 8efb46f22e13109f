"""The place of a figure over the life of processes."""

from types import SimpleNamespace

from reports.paper import timeline


def cells(*places):
    """places: (name, pixels, number of variants)."""
    return [SimpleNamespace(place=name, pixels=pixels) for name, pixels, count in places for _ in range(count)]


def test_of_the_largest_places_the_one_with_most_variants_then_the_first():
    assert timeline.largest_place(cells(("small", 4, 9), ("all", 16, 6), ("lanes", 16, 4))) == "all"
    assert timeline.largest_place(cells(("lanes", 16, 4), ("all", 16, 6))) == "all"
    assert timeline.largest_place(cells(("first", 16, 2), ("second", 16, 2))) == "first"
