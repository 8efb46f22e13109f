"""What a figure shows, whatever draws it; and `rayrace report --check`."""

import json

import matplotlib.pyplot as plt
import numpy as np
import pytest

from reports.page import report, several
from reports.paper import drawn, style


def chart(shift=0.0, title="t", colour="red", size=(4, 3)):
    with style.styled():
        figure, axes = plt.subplots(figsize=size)
        axes.plot([1, 2, 3], [1, 4 + shift, 9], color=colour)
        axes.bar([1, 2], [3, 4], color=colour)
        axes.scatter([1, 2], [2, 3], c=colour)
        axes.imshow(np.arange(6.0).reshape(2, 3), extent=(0, 3, 0, 9), aspect="auto")
        axes.set_title(title)
        return figure


def test_data_and_texts_count_and_looks_do_not():
    right = drawn.fingerprint(chart())
    assert right == drawn.fingerprint(chart()) == drawn.fingerprint(chart(colour="blue", size=(9, 5)))
    assert right == drawn.fingerprint(chart(shift=1e-12))
    others = {drawn.fingerprint(chart(shift=1e-3)), drawn.fingerprint(chart(title="u"))}
    assert len(others) == 2 and right not in others


def test_the_sidecar(tmp_path):
    style.save(chart(), tmp_path / "a")
    assert {path.name for path in tmp_path.iterdir()} == {"a.png", "a.svg", "a.pdf", "a.json"}
    told = json.loads((tmp_path / "a.json").read_text())
    assert told["data_sha256"] == drawn.fingerprint(chart()) and told["command"] == "rayrace report RUN"
    assert {"matplotlib", "rayrace"} <= set(told["versions"])


@pytest.fixture
def run(make_run, record):
    return make_run([record(name, n) for name in ("cpp", "numba") for n in range(3)])


def test_check(run, tmp_path):
    out = tmp_path / "out"
    report.write(run, out)
    assert several.check([run], out) == []
    figure = next(path for path in sorted(out.glob("times-*.json")))
    figure.write_text(figure.read_text().replace('"data_sha256": "', '"data_sha256": "0'))
    table = next(path for path in sorted(out.glob("memory-*.csv")))
    table.write_text(table.read_text().replace("cpp", "ccp", 1))
    (out / "machine.csv").unlink()
    said = several.check([run], out)
    assert said == ["machine.csv is new", f"{table.name} has other data", f"{figure.stem} has other data"]


def test_other_rows_are_told(run, tmp_path, make_run, record):
    report.write(run, tmp_path / "out")
    more = make_run([record(name, n, frames=(1, 0.4)) for name in ("cpp", "numba") for n in range(3)], name="more")
    assert any(line.startswith("times-0") for line in several.check([more], tmp_path / "out"))


def test_nothing_to_check(run, tmp_path):
    with pytest.raises(Exception, match=r"holds no report; make one with: rayrace report .* -o "):
        several.check([run], tmp_path / "nothing")
