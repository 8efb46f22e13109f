"""Runs in the formats of other tools: read back by the tools where there is one to read them."""

import json
import shutil
import subprocess
import sys

import command_line
import pyarrow
import pyperf
import pytest
from pyarrow import parquet

from harness.errors import UserError
from reports import exporters
from reports.run import results

TIMES = (0.25, 0.26, 0.27, 0.28, 0.29)  # s a frame, of five processes


@pytest.fixture
def cell(record):
    """Records of a cell: one a process, whose steady frames take the given times."""

    def make(variant, times=TIMES, **changes):
        return [record(variant, n, (9.0, time, time), **changes) for n, time in enumerate(times)]

    return make


@pytest.fixture
def mixed(make_run, cell, bad, exhibit, record):
    """A run with a good cell, and one of each kind that takes part in no comparison."""
    alone = [record("one-frame", n, frames=[1.0]) for n in range(5)]
    return make_run([*cell("cpp"), bad("rust", "failed", "exit 1: it broke"), exhibit(), *alone])


def exported(run, form, out):
    """The file of a run as JSON, and what was left out."""
    left_out = exporters.write(run, form, out)
    return json.loads(out.read_text()), left_out


def pyperf_says(*words, code=0):
    done = subprocess.run([sys.executable, "-m", "pyperf", *map(str, words)], capture_output=True, text=True)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize("form", ["pyperf", "hyperfine", "github"])
def test_only_what_is_ranked_and_the_rest_is_told(mixed, form, tmp_path):
    text, left_out = exported(mixed, form, tmp_path / "out.json")
    text = json.dumps(text)
    assert "cpp, comparison" in text and not any(name in text for name in ("rust", "fault", "one-frame"))
    told = "\n".join(left_out)
    assert "rust, comparison: failed: exit 1: it broke" in told and "exhibit: the study's figure 2.9" in told
    assert "one-frame, comparison: no steady" in told and len(left_out) == 3


def test_a_lost_repetition_is_told(make_run, cell, bad, tmp_path):
    run = make_run([*cell("cpp"), bad("cpp", "killed", "out of memory", 5)])
    suite, left_out = exported(run, "pyperf", tmp_path / "a.json")
    assert len(suite["benchmarks"][0]["runs"]) == 5
    assert left_out == ["cpp, comparison: ok, but 1 of 6 processes not: killed: out of memory"]


def test_pyperf_reads_what_was_measured(make_run, cell, tmp_path):
    run = make_run(cell("cpp", frame_renders=[1, 8, 8], scene_version="s", point={"depth": 3}) + cell("numba"))
    exporters.write(run, "pyperf", tmp_path / "a.json")
    suite = pyperf.BenchmarkSuite.load(str(tmp_path / "a.json"))
    assert suite.get_benchmark_names() == ["cpp, comparison, depth = 3", "numba, comparison"]
    about = suite.get_metadata()
    assert (about["hostname"], about["cpu_model_name"], about["cpu_count"]) == ("h", "a processor", 2)
    assert (about["python_implementation"], about["python_version"]) == ("cpython", "3")
    cpp, numba = suite.get_benchmarks()
    assert [run.values for run in cpp.get_runs()] == [(time, time) for time in TIMES]
    assert [run.warmups for run in cpp.get_runs()] == [((1, 9.0),)] * 5
    assert (cpp.get_loops(), numba.get_loops(), cpp.get_nvalue(), cpp.median()) == (8, 1, 10, 0.27)
    about = cpp.get_runs()[1].get_metadata()
    assert (about["mem_max_rss"], about["duration"], about["error_max"]) == (3000000, 2.0, 0.75)
    assert (about["timed"], about["error_rmse"], about["error_bad_pixels"]) == ("steady frames", 0.0625, 0.25)
    assert about["agrees"] == "yes" and "error_against" not in about, "held against the truth of the scene"
    assert (about["renderer_version"], about["scene_version"], about["parameter_depth"]) == ("v", "s", 3)


def test_pyperf_warm_up_frames_are_warm_ups(make_run, record, tmp_path):
    frames = (9.0, 4.0, 3.0, 2.0) + 18 * (1.0,)
    run = make_run([record("cpp", n, frames) for n in range(5)])
    suite, _ = exported(run, "pyperf", tmp_path / "a.json")
    (benchmark,) = suite["benchmarks"]
    assert benchmark["runs"][0]["warmups"] == [[1, 9.0], [1, 4.0], [1, 3.0], [1, 2.0]]
    assert benchmark["runs"][0]["values"] == 18 * [1.0]


def test_pyperf_itself_compares_and_checks(make_run, cell, tmp_path):
    for name, factor in (("a", 1.0), ("b", 2.0)):
        run = make_run(cell("cpp", [factor * time for time in TIMES]) + cell("numba"), name)
        exporters.write(run, "pyperf", tmp_path / f"{name}.json")
    a, b = tmp_path / "a.json", tmp_path / "b.json"
    said = pyperf_says("compare_to", a, b)
    assert "cpp, comparison" in said and "2.00x slower" in said and "not significant" in said
    said = pyperf_says("stats", a)
    assert "Number of run with values: 5" in said and "Number of warmup per run: 1" in said
    assert "Number of value per run: 2" in said and "Median +- MAD:   270 ms +- 10 ms" in said
    assert "Not enough samples" in pyperf_says("check", a)
    steady = make_run(cell("cpp", 5 * [0.25]), "steady")
    exporters.write(steady, "pyperf", tmp_path / "steady.json")
    assert "The benchmark seems to be stable" in pyperf_says("check", tmp_path / "steady.json")


def test_pyperf_has_no_metadata_that_are_not_known(make_run, record, tmp_path):
    environment = {
        "host": "unavailable: no name", "cpu": "", "os": "an OS\nof two lines", "kernel": "1", "architecture": "x",
        "cores": {"logical": None}, "python": "PyPy 3.11", "commit": "unavailable: not in a git checkout",
    }  # fmt: skip
    run = make_run([record("cpp", n, memory=None) for n in range(5)], environment=environment)
    exporters.write(run, "pyperf", tmp_path / "a.json")
    about = pyperf.Benchmark.load(str(tmp_path / "a.json")).get_metadata()
    assert about["platform"] == "an OS of two lines, kernel 1, x" and about["python_implementation"] == "pypy"
    unknown = {"hostname", "cpu_model_name", "cpu_count", "rayrace_commit", "mem_max_rss", "scene_version"}
    assert not unknown & about.keys()


HYPERFINE = {  # its src/benchmark/benchmark_result.rs: the type of each key, and of the items of a list
    "command": str, "mean": float, "stddev": float, "median": float, "user": float, "system": float, "min": float,
    "max": float, "times": [float], "exit_codes": [int], "memory_usage_byte": [int], "parameters": dict,
}  # fmt: skip


def assert_hyperfine(file, keys):
    assert set(file) == {"results"}
    for result in file["results"]:
        assert set(result) == keys
        for key, value in result.items():
            kind = HYPERFINE[key]
            if isinstance(kind, list):
                assert len(value) == len(result["times"]) and all(type(item) is kind[0] for item in value), key
            else:
                assert type(value) is kind, key
        assert all(type(value) is str for value in result.get("parameters", {}).values())


def test_hyperfine_is_of_processes(make_run, record, tmp_path):
    """Wall times 2, 3 and 4 s: mean and median 3, standard deviation 1."""
    run = make_run([record("cpp", n, wall_s=2.0 + n, point={"depth": 3}) for n in range(3)])
    file, _ = exported(run, "hyperfine", tmp_path / "a.json")
    assert_hyperfine(file, set(HYPERFINE))
    assert file["results"] == [
        {
            "command": "cpp, comparison, depth = 3 [whole process]", "mean": 3.0, "stddev": 1.0, "median": 3.0,
            "user": 1.5, "system": 0.5, "min": 2.0, "max": 4.0, "times": [2.0, 3.0, 4.0], "exit_codes": [0, 0, 0],
            "memory_usage_byte": [2000000, 3000000, 4000000], "parameters": {"depth": "3"},
        }
    ]  # fmt: skip


def test_hyperfine_keeps_cold_starts_apart_and_knows_no_zero(make_run, record, tmp_path):
    records = [record("numba", n, cache="cold" if n == 0 else "warm", memory=None, cpu=None) for n in range(3)]
    file, _ = exported(make_run(records), "hyperfine", tmp_path / "a.json")
    cold, warm = file["results"]
    for found, state in ((cold, "cold"), (warm, "warm")):
        assert found["command"] == f"numba ({state} cache), comparison [whole process]"
    assert (len(cold["times"]), cold["stddev"]) == (1, None) and (len(warm["times"]), warm["stddev"]) == (2, 0.0)
    assert cold["user"] is cold["system"] is None and "memory_usage_byte" not in cold and "parameters" not in cold


def test_hyperfine_has_the_frame_if_it_is_asked_for(make_run, record, tmp_path):
    """Processes of 2 s, whose steady frames take 0.25, 0.26 and 0.27 s; with compiled code and without."""
    caches = ["cold", "warm", "warm"]
    run = make_run([record("numba", n, (9.0, t, t), cache=caches[n]) for n, t in enumerate(TIMES[:3])])
    exporters.write(run, "hyperfine", tmp_path / "a.json", what="frame")
    (result,) = json.loads((tmp_path / "a.json").read_text())["results"]
    assert (result["command"], result["times"]) == ("numba, comparison [steady frame]", list(TIMES[:3]))
    assert (result["mean"], result["median"], result["user"]) == (pytest.approx(0.26), 0.26, None)
    assert result["memory_usage_byte"] == [2000000, 3000000, 4000000]


@pytest.mark.skipif(not shutil.which("hyperfine"), reason="no hyperfine here")
def test_hyperfine_itself_writes_the_same_keys_and_types(tmp_path):
    """The schema that our file is held to holds for the program's own too; before 1.19 it told no memory."""
    file = tmp_path / "real.json"
    command = ["hyperfine", "-N", "-r", "2", "-P", "n", "1", "2", "--export-json", file, "sleep 0.0{n}"]
    subprocess.run(command, check=True, capture_output=True)
    real = json.loads(file.read_text())
    assert_hyperfine(real, set(HYPERFINE) - ({"memory_usage_byte"} - set(real["results"][0])))


def test_github_has_a_number_for_each_cell(make_run, cell, tmp_path):
    file, _ = exported(make_run(cell("cpp") + cell("numba", TIMES[:2])), "github", tmp_path / "a.json")
    cpp, numba = file
    assert {key: cpp[key] for key in ("name", "unit", "value", "range")} == {
        "name": "cpp, comparison", "unit": "s", "value": 0.27, "range": "0.25 .. 0.29",
    }  # fmt: skip
    assert "steady frame, median over 5 processes" in cpp["extra"]
    assert (
        "RMSE 0.062, largest error 0.75, 25 % of pixels beyond 1/255; agreement ✓" in cpp["extra"]
        and "renderer v, commit abc" in cpp["extra"]
    )
    assert "range" not in numba and "no interval from 2 processes" in numba["extra"]


def test_parquet_has_every_row_and_null_for_what_is_unknown(mixed, tmp_path):
    exporters.write(mixed, "parquet", tmp_path / "a.parquet")
    table = parquet.read_table(tmp_path / "a.parquet")
    rows = table.to_pylist()
    assert [row["variant"] for row in rows] == 5 * ["cpp"] + ["rust", "numba-cuda-index-fault"] + 5 * ["one-frame"]
    assert rows[0]["steady_s"] == 0.25 and rows[0]["frames_s"] == [9.0, 0.25, 0.25] and rows[0]["parameters.depth"] == 3
    assert rows[0]["outlier"] is False
    rust = rows[5]
    assert (rust["status"], rust["reason"]) == ("failed", "exit 1: it broke")
    assert all(rust[name] is None for name in ("wall_s", "steady_s", "first_s", "peak_bytes", "frames_s", "error_max"))
    for name in ("steady_s", "first_s", "wall_s", "peak_bytes", "error_max"):
        assert table.schema.field(name).type == pyarrow.float64(), name
    assert table.schema.field("repetition").type == pyarrow.int64()
    about = json.loads(table.schema.metadata[b"rayrace run.json"])
    assert table.schema.metadata[b"rayrace export"] == b"a row for each repetition"
    assert about["title"] == "A title" and about["environment"]["cpu"] == "a processor"


def test_parquet_swept_values_of_several_types_are_text(make_run, record, tmp_path):
    points = [{"region": "all"}, {"region": [0, 0, 1, 1]}, {"threads": 2}]
    run = make_run([record(f"v{n}", point=point) for n, point in enumerate(points)])
    exporters.write(run, "parquet", tmp_path / "a.parquet")
    table = parquet.read_table(tmp_path / "a.parquet")
    assert table["point.region"].to_pylist() == ['"all"', "[0, 0, 1, 1]", None]
    assert table["point.threads"].to_pylist() == [None, None, 2]


def test_without_pyarrow_it_says_what_to_install(mixed, tmp_path, monkeypatch):
    loaded = results.load(mixed)  # pandas looks for pyarrow too
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(UserError, match=r"parquet needs pyarrow: .*; pip install 'rayrace\[parquet\]'"):
        exporters.parquet.write(loaded, tmp_path / "a.parquet")


def test_scenes_of_one_stem_are_told_apart(make_run, cell, tmp_path):
    run = make_run([*cell("cpp", scene="a/scene.txt"), *cell("cpp", scene="b/scene.txt", cell="other")])
    exporters.write(run, "pyperf", tmp_path / "a.json")
    names = pyperf.BenchmarkSuite.load(str(tmp_path / "a.json")).get_benchmark_names()
    assert names == ["cpp, a/scene.txt", "cpp, b/scene.txt"]


def test_the_command_line(mixed, tmp_path):
    done = command_line.rayrace("export", mixed, "--format", "github")
    assert [result["name"] for result in json.loads(done.stdout)] == ["cpp, comparison"]
    assert "left out: rust, comparison: failed: exit 1: it broke\n" in done.stderr
    out = tmp_path / "a.json"
    assert command_line.rayrace("export", mixed, "--format", "github", "-o", out).stdout == ""
    assert (
        out.read_text() == done.stdout
        and "exported: the steady frame, the median over processes, and its" in done.stderr
    )
    done = command_line.rayrace("export", mixed, "--format", "hyperfine")
    assert "exported: whole processes, from start to exit, with all frames; --what frame" in done.stderr
    assert [result["mean"] for result in json.loads(done.stdout)["results"]] == [2.0]
    done = command_line.rayrace("export", mixed, "--format", "hyperfine", "--what", "frame")
    assert "exported: the steady frame of each process\n" in done.stderr
    assert [result["mean"] for result in json.loads(done.stdout)["results"]] == [pytest.approx(0.27)]
    command_line.rayrace("export", mixed, "--format", "parquet", "-o", tmp_path / "a.parquet")
    assert parquet.read_table(tmp_path / "a.parquet").num_rows == 12
    nowhere = tmp_path / "no" / "a.parquet"
    said = command_line.rayrace("export", mixed, "--format", "parquet", "-o", nowhere, code=2).stderr
    assert "No such file or directory" in said


def test_wrong_use(mixed, make_run, bad):
    with pytest.raises(UserError, match='no format "xml"; known: pyperf, hyperfine, github, budget, parquet'):
        exporters.write(mixed, "xml", None)
    with pytest.raises(UserError, match='pyperf has no "process"; it holds: frame'):
        exporters.write(mixed, "pyperf", None, what="process")
    with pytest.raises(UserError, match="parquet is no text; name a file with -o FILE"):
        exporters.write(mixed, "parquet", None)
    with pytest.raises(UserError, match="nothing to export\n  rust, comparison: failed: it broke"):
        exporters.write(make_run([bad("rust", "failed", "it broke")], "broken"), "pyperf", None)


COUNTS = {
    "tool": "perf", "version": "6.1", "width": 4, "height": 3, "rays": 20, "instructions": 4e4, "cycles": 2e4,
    "spread": 2e-4, "smaller": None, "options": [], "environment": {},
}  # fmt: skip


@pytest.fixture
def counted(make_run, cell, bad):
    """A run of two cells, one of which was counted."""
    of = {"pass": "count"}
    counts = bad("cpp", "ok", "", counts=COUNTS, **of), bad("numba", "unavailable", "no tool", **of)
    return make_run([*cell("cpp"), *cell("numba"), *counts])


def test_counts_are_exported(counted, tmp_path):
    found, _ = exported(counted, "github", tmp_path / "a.json")
    assert [(one["name"], one["unit"]) for one in found] == [
        ("cpp, comparison", "s"), ("cpp, comparison, instructions", "instructions"), ("numba, comparison", "s"),
    ]  # fmt: skip
    assert found[1]["value"] == 4e4 and "4 x 3 pixels, by perf 6.1" in found[1]["extra"]
    exporters.write(counted, "pyperf", tmp_path / "b.json")
    cpp, numba = pyperf.BenchmarkSuite.load(str(tmp_path / "b.json")).get_benchmarks()
    assert cpp.get_metadata()["count_instructions"] == 4e4 and "count_instructions" not in numba.get_metadata()
    exporters.write(counted, "parquet", tmp_path / "a.parquet")
    rows = parquet.read_table(tmp_path / "a.parquet").to_pylist()
    assert [row["counts.instructions"] for row in rows if row["pass"] == "count"] == [4e4, None]


def test_a_budget(counted, make_run, cell, tmp_path):
    found, left_out = exported(counted, "budget", tmp_path / "a.json")
    assert left_out == ["numba, comparison: no tool"] and found["percent"] == 1
    way = {"tool": "perf", "version": "6.1", "width": 4, "height": 3, "options": [], "environment": {}}
    assert found["cells"] == {"cpp, comparison": {"instructions": 4e4, **way}}
    with pytest.raises(UserError, match="nothing was counted"):
        exporters.write(make_run(cell("cpp"), "plain"), "budget", None)
