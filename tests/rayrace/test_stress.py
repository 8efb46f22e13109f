"""`rayrace stress`: one row of the catalogue of failures."""

import json

import pytest

from harness import stress


def test_rows_are_listed(rayrace, tmp_path):
    done = rayrace("stress", "--json", cwd=tmp_path, code=0)
    assert list(json.loads(done.stdout)) == list(stress.rows())
    table = rayrace("stress", cwd=tmp_path, code=0).stdout
    assert all(name in table for name in stress.rows())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("acne-scal",), "error: acne-scal: no such row of the catalogue; did you mean acne-scale?"),
        (("leak", "-r", "cp"), 'error: no renderer "cp"; did you mean "cpp"?'),
        (("slabs", "-r", "numpy"), "error: slabs cannot run: numpy: the row is not for them (where of stability.toml)"),
        (("leak", "-r", "numpy", "--precision", "float16"), 'stability.toml: stress: leak has no precision "float16"'),
        (("flat-ellipsoid", "-r", "numpy", "-r", "povray", "--precision", "float32", "-o", "."), "exists already"),
    ],
)
def test_wrong_use(rayrace, tmp_path, words, message):
    assert message in rayrace("stress", *words, cwd=tmp_path, code=2).stderr
    assert not list(tmp_path.iterdir()), "no folder is left"


def test_a_row_has_its_table_and_its_chart(rayrace, tmp_path):
    """By numpy, which has nothing to compile: the textbook's formula breaks, the robust one does not."""
    words = "stress", "far-sphere", "-r", "numpy", "--precision", "float32", "-o", "run"
    told = json.loads(rayrace(*words, "--json", cwd=tmp_path, code=0).stdout)
    assert told["row"] == "far-sphere"
    by_method = {curve["method"]: [point["share"] for point in curve["points"]] for curve in told["curves"]}
    assert {curve["precision"] for curve in told["curves"]} == {"float32"}
    assert max(by_method["textbook"]) > 0.3 and by_method["robust"][0] == 0
    assert max(by_method["robust"][: len(stress.rows()["far-sphere"].levels) // 2]) == 0
    assert (tmp_path / "run" / "report" / "stability-far-sphere.png").stat().st_size > 10_000
