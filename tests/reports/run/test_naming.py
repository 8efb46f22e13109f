"""Names by what varies: nothing is said of what all have, and no two places have one name."""

import pytest

from reports.run import naming


@pytest.fixture
def cells(load, record):
    """cells(*parameters): a run with a cell of cpp for each."""

    def make(*points, **facts):
        told = [
            record("cpp", cell=f"c{n}", point=point, series=None, picture=None,
                   parameters=record("")["parameters"] | {"vector": "off", "accel": "auto"} | point)
            for n, point in enumerate(points)
        ]  # fmt: skip
        return load(told, **facts)

    return make


def test_methods_and_places_apart(cells):
    run = cells(
        {"objects": 1, "precision": "float64", "vector": "off", "depth": 3},
        {"objects": 12, "precision": "float32", "vector": "on", "depth": 3},
        {"objects": 12, "precision": "float64", "vector": "on", "depth": 3},
    )
    names = naming.short(run.cells)
    assert [names.full(cell) for cell in run.cells] == ["cpp", "cpp, lanes, float32", "cpp, lanes"]
    assert [names.where[cell] for cell in run.cells] == ["1 object", "12 objects", "12 objects"]
    assert names.shared == ["depth 3"]
    assert [naming.called(run, place) for place in run.places] == [
        "comparison, 1 object", "comparison, 12 objects, lanes, float32", "comparison, 12 objects, lanes",
    ]  # fmt: skip
    alone = naming.short(run.cells[1:2])
    assert alone.full(run.cells[1]) == "cpp" and alone.shared == ["12 objects", "depth 3", "lanes", "float32"]


def test_what_a_table_has_as_a_column_is_in_no_name(cells):
    run = cells({"accel": "none", "side": 8}, {"accel": "bvh", "side": 8})
    assert [naming.short(run.cells).full(cell) for cell in run.cells] == ["cpp, no hierarchy", "cpp, hierarchy"]
    names = naming.short(run.cells, silent=("accel", "side"))
    assert [names.full(cell) for cell in run.cells] == ["cpp", "cpp"] and names.shared == []


def test_no_two_places_have_one_name(cells):
    """A value that no name has: the places are named in full."""
    run = cells({"least_frame": 0.1}, {"least_frame": 0.2})
    assert [naming.called(run, place) for place in run.places] == [
        "comparison, least_frame = 0.1", "comparison, least_frame = 0.2",
    ]  # fmt: skip


def test_values_in_words():
    words = [
        ("region", "one pixel"),
        ("region", "all"),
        ("side", 64),
        ("lights", 1),
        ("case", "glass"),
        ("lens_radius", 0),
    ]
    assert [naming.spoken(*word) for word in words] == [
        "one pixel", "all pixels", "64 × 64", "1 light", "glass", "lens radius 0",
    ]  # fmt: skip
