"""How a method is named in a chart, and which methods one chart can show."""

import itertools

import pytest
from made_up_errors import ASKED, FACTS, OF_SCENE, by_name

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
    own = FACTS | {"experiment": ASKED | {"reference": {"against": "centres", "depth": "own"}}}
    assert len(method.views(load(told, name="own", **own))) == 9
    old = [{**one, "error": {key: value for key, value in one["error"].items() if key != "against"}} for one in told]
    assert len(method.views(load(old, name="old", **FACTS | {"experiment": ASKED | {"reference": None}}))) == 9
    assert len({seen.label for seen in with_depth}) == 5
    for seen in with_depth:
        assert len({bool(cell.parameters["feelers"]) for cell in seen.cells}) == 1


OF_THE_SCENE = FACTS | {"experiment": ASKED | {"reference": None}}


def test_all_pictures_of_a_scene_have_one_truth(load, cell):
    """One sample a pixel anywhere in it, area samplers, soft and hard shadows, any depth and arithmetic: one view. Not
    with another size, region, lens, or without shadows.
    """
    ways = [
        {}, {"sample_x": 0.0, "sample_y": 0.25}, {"sampler": "jittered", "samples": 4}, {"sampler": "uniform"},
        {"sampler": "adaptive"}, {"feelers": 4}, {"glossy_rays": 2}, {"depth": 3}, {"epsilon": 1e-4, "offset": "fixed"},
        {"precision": "float32", "epsilon": 1e-6}, {"cutoff": 0.01}, {"seed": 7}, {"sliver": 1e-3},
    ]  # fmt: skip
    others = [{"width": 64, "region": "0,0,64,512"}, {"region": "0,0,9,9"}, {"lens_radius": 0.5}, {"shadows": 0}]
    told = [told for way in (*ways, *others) for told in cell("cpp", [1], 0.1, **way)]
    for one in told:
        one["error"] = OF_SCENE
    seen = method.views(load(told, **OF_THE_SCENE))
    assert sorted(len(one.cells) for one in seen) == [1, 1, 1, 1, len(ways)]
    (chart,) = pareto.charts(load(told, name="again", **OF_THE_SCENE))
    assert chart.view.label == "mirrors" and chart.axis == "error: RMSE, linear RGB"
    assert (chart.resolution, chart.sampled) == (pareto.DOUBT * OF_SCENE["uncertainty"], True)
    assert len({point.name for point in chart.points}) == len(ways) - 1, "of a sliver nothing is named"
    assert "cpp, one sample, at 0.0, 0.25, hard shadows, mirrors, depth 10" in {point.name for point in chart.points}


@pytest.mark.parametrize(
    ("changes", "needs", "expected"),
    [
        ({}, [], True),
        ({"sampler": "one"}, [], False),
        ({"depth": 8}, [], True),
        ({"depth": 7}, [], False),
        ({"feelers": 0}, ["soft"], False),
        ({"glossy_rays": 0}, ["glossy"], False),
    ],
)
def test_a_picture_that_leaves_out_some_of_the_scene_is_biased(load, cell, changes, needs, expected):
    """One sample a pixel, hard shadows, mirrors, or less than half the depth of the truth, 16."""
    own = {"sampler": "jittered", "samples": 2, "depth": 10, **changes}
    told = [*cell("cpp", [1], 0.1, **own), *cell("numpy", [1], 0.1, sampler="jittered", samples=9, feelers=1)]
    for one in told:
        one["error"] = OF_SCENE
    told[1]["needs"] = needs
    run = load(told, **OF_THE_SCENE)
    assert method.unbiased(run, run.cells[0]) is expected
