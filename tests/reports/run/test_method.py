"""How a method is named in a chart, and which methods one chart can show."""

import itertools

from made_up_errors import ASKED, FACTS, by_name

from reports.accuracy import pareto
from reports.run import method


def test_names_say_what_is_not_as_by_default(load, cell):
    told = [
        *cell("cpp", [1], 0.1, sampler="jittered", samples=8, precision="float32"),
        *cell("cpp", [1], 0.1, cutoff=2.0**-10, depth=4),
        *cell("cpp", [1], 0.1, cutoff=0.003),
        *cell("cpp", [1], 0.1, sampler="adaptive", adaptive_threshold=0.02, sphere="textbook"),
        *cell("numba", [1], 0.1, floating_point="fast", walk="stack", samples=4),
    ]
    areas, centres = pareto.charts(load(told, **FACTS))
    assert list(by_name(areas)) == ["cpp, float32, jittered 8 × 8", "cpp, textbook spheres, adaptive, threshold 0.02"]
    assert areas.view.label.endswith("areas of pixels") and centres.view.label.endswith("centres of pixels")
    assert list(by_name(centres)) == [
        "cpp, cut-off 2⁻¹⁰, depth 4",
        "cpp, cut-off 0.003",
        "numba, fast floating point, stack walk",
    ]


def test_a_view_has_one_truth(load, cell):
    told = [
        told
        for depth, feelers, side in itertools.product((3, 10), (0, 4, 9), (64, 128))
        for told in cell(
            "cpp", [1], 0.1, depth=depth, feelers=feelers, width=side, height=side, region=f"0,0,{side},{side}"
        )
    ]
    told += [*cell("cpp", [1], 0.1, scene="scenes/b.txt"), *cell("cpp", [1], 0.1, scene="scenes/b.txt", seed=3)]
    with_depth = method.views(load(told, **FACTS))
    assert sorted(len(seen.cells) for seen in with_depth) == [2, 2, 2, 4, 4]
    own = {**FACTS, "experiment": ASKED | {"reference": None}}
    assert len(method.views(load(told, name="own", **own))) == 9
    assert len({seen.label for seen in with_depth}) == 5
    for seen in with_depth:
        assert len({bool(cell.parameters["feelers"]) for cell in seen.cells}) == 1
