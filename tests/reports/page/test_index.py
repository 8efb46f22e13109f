"""The page of a folder of runs: newest first, made again only where it must be, and nothing removed."""

import re

import pytest
from command_line import rayrace as command

from harness.errors import UserError
from harness.store import packed
from reports.page import index


@pytest.fixture
def lab(make_run, record, tmp_path):
    """A folder with two runs, one of them deeper, a packed one, a broken one and two that are none."""
    folder = tmp_path / "lab"
    for number, name in enumerate(("old", "packed", "broken")):
        told = [record(variant, n, frames=(1, 0.5 + number)) for variant in ("cpp", "numba") for n in range(2)]
        make_run(told, name=f"lab/{name}", title=f"The {name} run", started=f"2026-01-0{number + 1}T10:00:00")
    make_run([record("numpy")], name="lab/machine/new", title="<b>new</b>", started="2026-02-01T10:00:00")
    packed.pack(folder / "packed", folder / "packed.tar.xz", pictures=False)
    (folder / "packed").rename(tmp_path / "moved")
    (folder / "broken" / "run.json").write_text('{"title": "cut o')
    (folder / "foreign" / "inside").mkdir(parents=True)
    (folder / "foreign" / "notes.txt").write_text("mine")
    (folder / "README.md").write_text("# Runs of the lab")
    (folder / ".quiet").mkdir()
    return folder


def links(page):
    return re.findall(r'<li>\s*<a href="([^"]+)">', page.read_text("utf-8"))


def test_newest_first_with_what_was_skipped_and_why(lab):
    before = sorted(path for path in lab.rglob("*") if path.is_file())
    page = index.make(lab, lab / "report")
    assert page == lab / "report" / "index.html"
    assert links(page) == ["machine-new/report.html", "packed/report.html", "old/report.html"]
    assert all((page.parent / link).exists() for link in links(page))
    text = page.read_text("utf-8")
    assert "&lt;b&gt;new&lt;/b&gt;" in text and "<b>new</b>" not in text
    assert "3 runs on 1 machine, the newest first" in text and "h: a processor, 2 cores" in text
    assert "cpp has the lowest median" in text and "no picture was kept" in text and "data:image/webp" in text
    skipped = text.partition('id="s0-skipped-2"')[2]
    assert "foreign: holds no run" in skipped and "broken: " in skipped and "run.json" in skipped
    assert ".quiet" not in text and "README" not in text
    assert [path for path in before if not path.exists()] == [], "nothing is removed"


def test_only_what_is_missing_or_old_is_made(lab, record, monkeypatch):
    out, said = lab.parent / "site", []
    index.make(lab, out, say=said.append)
    assert len(said) == 3
    kept = {path: path.stat().st_mtime_ns for path in out.rglob("report.html")}
    assert index.make(lab, out, say=said.append) and len(said) == 3
    with open(lab / "old" / "repetitions.jsonl", "a") as file:
        file.write(
            (lab / "old" / "repetitions.jsonl")
            .read_text()
            .splitlines()[0]
            .replace('"repetition": 0', '"repetition": 9')
            + "\n"
        )
    (out / "packed" / index.FRESH).unlink()
    index.make(lab, out, say=said.append)
    assert [text.split("/")[-2] for text in said[3:]] == ["old", "packed"]
    assert (out / "machine-new" / "report.html").stat().st_mtime_ns == kept[out / "machine-new" / "report.html"]
    monkeypatch.setattr(index, "_code", lambda: "another rayrace")
    index.make(lab, out, say=said.append)
    assert len(said) == 8


def test_the_report_of_a_run_in_its_folder_is_no_run(lab):
    first = index.make(lab, lab / "report").read_text("utf-8")
    command("report", lab / "old")
    assert index.make(lab, lab / "report").read_text("utf-8") == first
    command("report", lab, "-o", lab / "elsewhere")
    assert index.make(lab, lab / "report").read_text("utf-8") == first


def test_names_are_never_shared(tmp_path):
    found = [tmp_path / "a b", tmp_path / "a-b.tar.xz", tmp_path / "a" / "b"]
    assert index.names(tmp_path, found) == ["a-b", "a-b-2", "a-b-3"]


def test_a_folder_without_runs_and_one_that_is_not_ours(lab, tmp_path):
    with pytest.raises(UserError, match="neither a run nor a folder of runs"):
        index.make(lab / "foreign", tmp_path / "out")
    assert not (tmp_path / "out").exists()
    with pytest.raises(UserError, match="holds files that do not belong to a report"):
        index.make(lab, lab / "foreign")
    assert (lab / "foreign" / "notes.txt").read_text() == "mine"
    assert "--check takes runs" in command("report", lab, "--check", code=2).stderr
