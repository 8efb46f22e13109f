"""The whole report: same bytes twice, nothing missing in silence, nothing ranked that must not be, names escaped."""

import csv
import re

import report_tables

from reports.page import report
from reports.run import results
from reports.times import times_figure


def rows(text, heading):
    """The rows of the first table below a heading, as dicts by column."""
    return report_tables.tables(text.split(f"## {heading}", 1)[1])[0]


def test_twice_the_same_bytes(make_run, tmp_path, record, bad):
    run = make_run([record(name, n) for name in ("cpp", "numba") for n in range(3)] + [bad("numpy", "failed", "no")])
    for name in ("a", "b"):
        report.write(run, tmp_path / name)
    files = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert {path.split(".")[-1] for path in files} == {"html", "md", "csv", "json", "pdf", "png", "svg", "tex"}
    assert files == sorted(path.name for path in (tmp_path / "b").iterdir())
    for name in files:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


def test_rows_without_a_time_have_a_reason_and_no_rank(report_text, record, bad):
    text = report_text(
        [
            record("cpp", frames=(1, 0.5)),
            bad("numba", "failed", "exit 1: it broke"),
            bad("numpy", "unavailable", "no module numpy"),
            record("python", frames=(1, 0.001), status="wrong picture", reason="3 pixels off"),
            bad("cuda", "timeout", "killed after 9 s"),
        ]
    )
    assert "only cpp is ranked" in text
    found = {row["renderer"]: row for row in rows(text, "Times")}
    reasons = {
        "numba": "failed: exit 1: it broke",
        "numpy": "unavailable: no module numpy",
        "python": "wrong picture: 3 pixels off",
        "cuda": "timeout: killed after 9 s",
    }
    for variant, reason in reasons.items():
        assert found[variant]["steady frame"] == "unavailable"
        assert found[variant]["time ÷ cpp"] == "unavailable"
        assert found[variant]["status"] == reason
        assert f"- {variant}: {reason}" in text.split("Not ranked:")[1].split("## Machine")[0]
    assert found["python"]["largest error"] == "0.75"


def test_no_time_without_an_error(report_text, record):
    text = report_text(
        [
            record("cpp"),
            record("numba", agreement={"unavailable": "no other renderer"}, error={"unavailable": "no truth"}),
            record("numpy", agreement=None),
        ]
    )
    for heading in ("Times", "Start-up"):
        for row in rows(text, heading):
            assert row["largest error"] and row["RMSE"] and row["beyond 1/255 (%)"]
    found = {row["renderer"]: row for row in rows(text, "Times")}
    assert found["numba"]["RMSE"] == "unavailable: no truth"
    assert found["numba"]["agrees"] == "unavailable: no other renderer" and found["cpp"]["agrees"] == "✓ (mask 25 %)"
    assert found["numba"]["time ÷ cpp"].startswith("unavailable: not ranked: its picture was not judged")
    assert "only cpp is ranked" in text
    for line in text.splitlines():
        if "a frame, RMSE" in line:
            assert "RMSE 0.062, largest error 0.75, 25 % of pixels beyond 1/255, agreement ✓ (mask 25 %)" in line


# Of a picture that agrees with its reference, as others make the same mistakes, and is far from the truth.
FAR = {"rmse": 0.011, "max": 1.25, "bad_pixels": 0.0033}
NEAR = {"max_outside": 2e-4, "max_inside": 3e-4, "rmse": 1e-5, "bad_pixels": 0.0, "mask_fraction": 0.02}


def test_beside_a_time_stands_the_distance_from_the_truth_and_not_from_the_reference(report_text, record, make_run):
    """In every table with times, in the summary, and in the chart of times."""
    own = {"agreement": record("")["agreement"] | NEAR, "error": record("")["error"] | FAR}
    told = [record(name, n, **own) for name in ("cpp", "numba") for n in range(5)]
    text = report_text(told)
    line = next(line for line in text.splitlines() if "a frame, RMSE" in line)
    assert (
        "RMSE 0.011, largest error 1.25, 0.33 % of pixels beyond 1/255" in line and "agreement ✓ (mask 2.0 %)" in line
    )
    assert not re.search("0\\.0002|0\\.0003|2e-4|3e-4|1e-05", text), "how far it is from its reference is told nowhere"
    for heading in ("Times", "Start-up"):
        for row in rows(text, heading):
            assert (row["RMSE"], row["largest error"], row["beyond 1/255 (%)"]) == ("0.011", "1.25", "0.33")
            assert row.get("agrees", "✓ (mask 2.0 %)") == "✓ (mask 2.0 %)"
    figure = times_figure.draw(results.load(make_run(told, name="drawn")), told[0]["scene"])
    beside = [text.get_text() for text in figure.axes[0].texts]
    assert beside == [*["0.011", "1.25", "0.33 %", "✓"] * 2, "RMSE", "largest", "beyond 1/255", "agrees"]


def test_an_axis_of_times_spans_a_factor_of_two_at_least(make_run, record):
    """A single cell's interval of a per mille is not drawn from edge to edge."""
    told = [record("cpp", n, frames=(0.5, 0.1 + n * 1e-5, 0.1 + n * 1e-5)) for n in range(5)]
    (axes,) = times_figure.draw(results.load(make_run(told)), told[0]["scene"]).axes
    low, high = axes.get_xlim()
    assert high / low >= 2 * (1 - 1e-12) and low < 0.1 < high


def test_no_cell_of_a_table_is_blank_or_a_bare_zero(report_text, tmp_path, record):
    nothing = {"peak_bytes": 1e6, "render_peak_bytes": None, "peak_virtual_bytes": None, "method": "wait4"}
    alone = {"unavailable": "nobody else makes it"}
    silent = record(
        "quiet", frames=(0.1,), rays=None, used=None, versions=None, series=None, measurer=None,
        memory=nothing | {"floor_bytes": 8e6}, agreement=alone, error=alone,
    )  # fmt: skip
    text = report_text([silent])
    for line in text.splitlines():
        if line.startswith("|"):
            cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
            assert "" not in cells and "0" not in cells and "nan" not in line.lower(), line
    (row,) = rows(text, "Times")
    assert row["steady frame"] == "unavailable: no steady frames" and "nothing is ranked" in text
    assert "unavailable: nobody else makes it" in (row["RMSE"], row["agrees"])
    assert "wait4, floor 8.00 MB" in text
    for path in (tmp_path / "report").glob("*.csv"):
        with open(path, newline="") as file:
            for row in csv.DictReader(file):
                assert row.get("value") != "" and (row.get("value") != "NaN" or row["note"]), row


def test_names_of_others_are_escaped(report_text, record, bad):
    evil = "a|b<script>alert(1)</script>*c*"
    told = record(evil, warnings=[f"odd {evil}"], scene=f"{evil}.txt", point={"region": evil})
    files = {"picture": {"file": "pictures/evil.npy"}, "series": "series/evil.csv"}
    failed = bad("cpp", "failed", evil, scene=f"{evil}.txt", point={"region": evil})
    text = report_text([told | files, failed], title=evil, command=["rayrace", evil])
    assert "<script>" not in text
    assert "a\\|b&lt;script&gt;" in text
    times = text.split("## Times")[1].split("## Times, drawn")[0]
    assert len({len(re.split(r"(?<!\\)\|", line)) for line in times.splitlines() if line.startswith("|")}) == 1
    assert not re.search(r"(?<!\\)\*c\*", text)


def test_one_process_has_no_interval(report_text, record):
    text = report_text([record("cpp", frames=(1, 0.5)), record("numba", frames=(1, 1.0))])
    row = rows(text, "Times")[1]
    assert row["steady frame"] == "1.00 s (no interval, n = 1)"
    assert row["time ÷ cpp"] == "2.00 (no interval, n = 1)"
    assert "**cpp** has the lowest median, not resolved from numba" in text


def test_a_run_that_was_cut_off_shows_what_was_not_run(make_run, load, record):
    folder = make_run([record("cpp"), record("numba")])
    lines = (folder / "repetitions.jsonl").read_text().splitlines(keepends=True)
    (folder / "repetitions.jsonl").write_text(lines[0] + lines[1][:40])
    found = {cell.variant: cell.verdict for cell in results.load(folder).cells}
    assert found == {"cpp": "ok", "numba": "not run: the run ended before it"}
    report.write(folder, folder / "report")
    assert "not run: the run ended before it" in (folder / "report" / "report.md").read_text()


def test_a_run_without_cpp_is_measured_against_the_first_ranked(report_text, record, bad):
    text = report_text([bad("numpy", "failed", "no"), record("numba"), record("python")])
    assert "time ÷ numba" in text


def test_warnings_are_told_once_for_each_kind(report_text, record):
    said = [record("cpp", n, warnings=[f"CPU time: wait4 says 0.{n} s"]) for n in range(3)]
    text = report_text(said)
    assert "- cpp: CPU time: wait4 says 0.0 s, and 2 more like it (comparison)" in text


def test_a_process_that_did_not_get_its_core_is_doubtful(report_text, record):
    starved = record("numba", cpu={"user_s": 0.5, "system_s": 0.1, "series_s": 0.6})  # of 2 s
    text = report_text([record("cpp"), starved]).split("## Measurement warnings")[1].split("## Machine")[0]
    assert "- numba: used 30 % of one core" in text and "cpp" not in text


def test_one_pixel_and_broken_pictures_do_not_stop_it(make_run, tmp_path, record):
    import numpy as np

    pixel = record("")["parameters"] | {"region": "2,2,3,3"}
    point = {"region": "one pixel"}
    wrong = record("numba", status="wrong picture", reason="1 pixels are not finite", point={"region": "all"})
    wrong["agreement"] = dict.fromkeys(wrong["agreement"]) | {"reference": "judge", "wrong": "1 pixels are not finite"}
    run = make_run([record("cpp", point=point, parameters=pixel), record("cpp", point={"region": "all"}), wrong])
    picture = np.zeros((4, 4, 3))
    picture[0, 0] = np.nan
    np.save(run / "pictures" / "numba.npy", picture)
    report.write(run, tmp_path / "out")
    text = (tmp_path / "out" / "report.md").read_text()
    assert "a single pixel is not drawn" in text
    assert (tmp_path / "out" / "pictures-1-comparison-region-all.png").exists()


def test_tables_for_a_paper(make_run, tmp_path, record, bad):
    """LaTeX with the rows of the Markdown, whatever characters are in them."""
    run = make_run([record("cpp_1", n) for n in range(5)] + [bad("numba", "failed", "100 % of $x & {y} #1")])
    report.write(run, tmp_path / "out")
    text = (tmp_path / "out" / next(path.name for path in (tmp_path / "out").glob("times-0*.tex"))).read_text()
    bodies = [part.partition("\\bottomrule")[0] for part in text.split("\\midrule")[1:]]
    assert bodies and [body.count("\\\\\n") for body in bodies] == [2] * len(bodies)
    assert "cpp\\_1" in text and "100 \\% of \\$x \\& \\{y\\} \\#1" in text
    assert (tmp_path / "out" / "machine.tex").exists()
