"""A run begun by rayrace of before its folders were rearranged: read, resumed, or refused with the reason.

old_run.tar.xz is small.toml, its scene, and its run by commit a606ebb, interrupted (Ctrl-C) after 6 of 15 repetitions.
"""

import json
import statistics
import tarfile
from pathlib import Path

import pytest

from harness.machine import environment as machine

STORED = Path(__file__).with_name("old_run.tar.xz")


@pytest.fixture
def old(tmp_path):
    """Folder of the experiment and of `run`."""
    with tarfile.open(STORED) as packed:
        filters = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}  # Python 3.11.2 of Debian 12 has none
        packed.extractall(tmp_path, **filters)
    return tmp_path


def rows(folder):
    return [json.loads(line) for line in (folder / "repetitions.jsonl").read_text("utf-8").splitlines()]


def replaced(text, names):
    for name, other in names.items():
        text = text.replace(name, other)
    return text


@pytest.mark.slow
def test_it_is_read(old, rayrace):
    """By report, export, status and compare; the times exported are those of its rows."""
    rayrace("report", old / "run", code=0)
    told = (old / "run" / "report" / "report.md").read_text("utf-8")
    assert "Small" in told and "python" in told and "6 of 15" in rayrace("status", old / "run", code=0).stdout
    rayrace("export", old / "run", "--format", "hyperfine", "-o", old / "times.json", code=0)
    found = {one["command"]: one["median"] for one in json.loads((old / "times.json").read_text())["results"]}
    facts = json.loads((old / "run" / "run.json").read_text())
    for cell in facts["cells"]:
        own = [row for row in rows(old / "run") if row["cell"] == cell["cell"] and row["pass"] == "timed"]
        (median,) = [value for name, value in found.items() if cell["variant"] in name]
        assert median == pytest.approx(statistics.median(row["wall_s"] for row in own))
    rayrace("export", old / "run", "--format", "packed", "-o", old / "a.tar.xz", code=0)
    done = rayrace("compare", old / "run", old / "a.tar.xz", code=0)
    assert "2 not comparable" in done.stdout  # no interval from 2 processes


def test_on_another_machine_it_is_refused_with_the_reason(old, rayrace):
    file = old / "run" / "run.json"
    facts = json.loads(file.read_text())
    facts["environment"]["host"] = "elsewhere"
    file.write_text(json.dumps(facts))
    before = (old / "run" / "repetitions.jsonl").read_bytes()
    done = rayrace("run", old / "small.toml", "--resume", old / "run", code=2)
    assert "it cannot be resumed after these changes:" in done.stderr
    assert 'this machine: host was "elsewhere"' in done.stderr
    assert done.stderr.strip().endswith("start a new run, and compare the two")
    assert (old / "run" / "repetitions.jsonl").read_bytes() == before


@pytest.mark.slow
def test_where_nothing_has_changed_it_is_resumed(old, rayrace):
    """As if it had been begun on this machine, with the renderers of today; identifiers of cells are of both."""
    rayrace("run", old / "small.toml", "--out", old / "new", "--set", "processes=1", code=0)
    today = {cell["variant"]: cell for cell in json.loads((old / "new" / "run.json").read_text())["cells"]}
    cells = json.loads((old / "run" / "run.json").read_text())["cells"]
    file = old / "run" / "run.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"environment": machine.capture()}))

    def rename(key):
        """In all files, and in their names, which have the identifiers of cells."""
        names = {cell[key]: today[cell["variant"]][key] for cell in cells}
        for path in sorted((old / "run").rglob("*.*")):
            if path.suffix in (".json", ".jsonl"):
                path.write_text(replaced(path.read_text("utf-8"), names), "utf-8")
            path.rename(path.with_name(replaced(path.name, names)))

    rename("renderer_version")
    for key in ("scene_version", "cell"):  # the former was another where the processor's power was another
        if cells[0][key] != today[cells[0]["variant"]][key]:
            done = rayrace("run", old / "small.toml", "--resume", old / "run", code=2)
            assert f'local: {key} was "{cells[0][key]}"' in done.stderr
        rename(key)
    before = (old / "run" / "repetitions.jsonl").read_bytes()
    assert before.count(b"\n") == 6
    rayrace("run", old / "small.toml", "--resume", old / "run", code=0)
    assert (old / "run" / "repetitions.jsonl").read_bytes().startswith(before)
    done = [(row["cell"], row["repetition"], row["pass"]) for row in rows(old / "run")]
    assert len(done) == 15 == len(set(done)) and {row["status"] for row in rows(old / "run")} == {"ok"}
