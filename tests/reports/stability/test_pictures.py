"""Which pictures show what a failure looks like: where the naive way breaks first and the robust one holds."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from reports.chart.embedded import Embedded
from reports.paper import style
from reports.run import results
from reports.stability import pictures as stability_pictures
from reports.stability import stability
from reports.summary import glance

FACTS = {
    "code": "S7", "title": "Acne", "stress": "scale", "failure": "dark points", "error": "", "logarithmic": True,
    "method": "offset", "aligned": "", "source": "a book",
}  # fmt: skip
UNKNOWN = dict.fromkeys(("error_median", "error_p99", "error_max", "expected", "limit"))
GREY = np.full((12, 12, 3), 0.5)


@pytest.fixture
def stressed(record, make_run):
    """A function that gives a run of one row: failures of 100 by level, for each offset."""

    def make(pictures=GREY, **failures):
        told, files = [], {}
        for offset, counts in failures.items():
            for level, failed in counts.items():
                point = {"stress": "acne", "level": level, "precision": "float32", "offset": offset}
                file = f"pictures/{offset}-{level:g}.npy"
                files[file] = pictures
                counted = {"row": "acne", "level": level, "count": 100, "failures": failed, **UNKNOWN}
                told.append(
                    record(
                        "cpp", cell=f"{offset}-{level}", point=point, scene="stress/acne.txt", stability=counted,
                        parameters=record("")["parameters"] | {"precision": "float32", "offset": offset},
                        picture={"file": file}, unranked="exhibit: put under stress", series=None,
                        agreement=None,
                    )
                )  # fmt: skip
        return results.load(make_run(told, files=files, stability={"acne": FACTS}))

    return make


@pytest.fixture
def shown(stressed, tmp_path, monkeypatch):
    """A function that gives the panels of the row, and the section."""

    def show(pictures=GREY, **failures):
        monkeypatch.setattr(style, "save", lambda figure, path: plt.close(figure))
        run = stressed(pictures, **failures)
        (row,) = stability.rows(run)
        return stability_pictures.choose(run, row), stability_pictures.write(run, tmp_path)

    return show


def test_the_first_level_where_a_tenth_is_wrong(shown):
    panels, text = shown(none={1: 2, 10: 30, 100: 60}, bounded={1: 0, 10: 0, 100: 0})
    assert [(panel.curve.way.name, panel.point.level) for panel in panels] == [("none", 10), ("bounded", 10)]
    assert "none 30 of 100 wrong; bounded 0 of 100 wrong" in text and "stability-picture-acne" in text


def test_a_level_where_every_naive_way_fails(shown):
    """Not the first where one does: a picture without a failure is shown of no way that fails further on."""
    naive = {"none": {1: 30, 10: 30, 100: 60, 1000: 60}, "fixed": {1: 0, 10: 5, 100: 30, 1000: 90}}
    panels, _ = shown(**naive, bounded=dict.fromkeys((1, 10, 100, 1000), 0))
    assert [(panel.curve.way.name, panel.point.level) for panel in panels] == [
        ("none", 100), ("fixed", 100), ("bounded", 100)
    ]  # fmt: skip


def test_the_worst_level_if_none_is_so_wrong(shown):
    panels, _ = shown(none={1: 2, 10: 5, 100: 4}, bounded={1: 0, 10: 0, 100: 0})
    assert panels[0].point.level == 10


@pytest.mark.parametrize(
    "failures",
    [
        {"none": {1: 0, 10: 0}, "bounded": {1: 0, 10: 0}},
        {"none": {1: 50, 10: 50}, "bounded": {1: 1, 10: 2}},
        {"bounded": {1: 0, 10: 0}},
    ],
    ids=["nothing fails", "the robust way fails too", "there is no naive way"],
)
def test_nothing_to_show(shown, failures):
    panels, text = shown(**failures)
    assert panels == [] and text == ""


def test_a_picture_of_a_few_pixels_shows_nothing(shown):
    panels, _ = shown(pictures=GREY[:4], none={1: 50}, bounded={1: 0})
    assert panels == []


def test_pixels_that_are_no_numbers_are_magenta(shown):
    broken = GREY.copy()
    broken[3, 4, 1] = np.nan
    panels, _ = shown(pictures=broken, none={1: 50}, bounded={1: 0})
    assert panels[0].picture[3, 4].tolist() == [255, 0, 255]
    assert panels[0].picture[0, 0].tolist() == [188, 188, 188]


def test_the_first_screen_shows_the_failure_beside_what_holds(stressed):
    pictures = Embedded(100_000)
    shown = glance.failure(stressed(none={1: 2, 10: 30}, fixed={1: 0, 10: 60}, bounded={1: 0, 10: 0}), pictures)
    assert [name for _, name in shown["pictures"]] == ["fixed: 60 of 100 wrong", "bounded: 0 of 100 wrong"]
    assert all(key in pictures.images for key, _ in shown["pictures"])
    assert shown["about"] == "Acne: cpp, float32, scale 10."


def test_the_first_screen_shows_no_picture_where_nothing_fails_visibly(stressed):
    assert glance.failure(stressed(none={1: 2, 10: 5}, bounded={1: 0, 10: 0}), Embedded(100_000)) is None
