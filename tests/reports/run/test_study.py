"""Which cells repeat a case of the study."""

from types import SimpleNamespace

from reports.run import study


def cell(scene="scenes/comparison.txt", swept=(), pixels=512 * 512, **more):
    parameters = {**study.VARIABLES, **more}
    return SimpleNamespace(scene=scene, swept=dict.fromkeys(swept), parameters=parameters, pixels=pixels)


def test_a_heading_has_the_study_s_figure_only_where_a_cell_repeats_its_case():
    others = [cell(scene="mine.txt"), cell(depth=3), cell(swept=["objects"]), cell(pixels=9)]
    assert study.heading(others, "Pictures", "figure 4.1") == "Pictures"
    for case in (cell(), cell(pixels=1)):
        assert study.heading([*others, case], "Pictures", "figure 4.1") == "Pictures (the study's figure 4.1)"
