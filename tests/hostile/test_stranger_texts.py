"""Texts of a stranger's run: no control character reaches a terminal or a drawing, no formula a spreadsheet."""

import csv
import hashlib
import json
import re

import numpy as np
import pandas as pd
import pytest
import stored_run

from harness.errors import UserError
from harness.machine import fitness_cores
from harness.store import clean, store
from reports.page import several
from reports.paper import table
from reports.run import results, stored
from reports.summary import provenance

EVIL = "a\x1b[2J\x00\x07\x9b31m\u202eb\ufffec\x7f"
SHOWN = r"a\x1b[2J\x00\x07\x9b31m\u202eb\ufffec\x7f"


def strings(value):
    """All texts of a value, names too."""
    if isinstance(value, dict):
        for name, one in value.items():
            yield name
            yield from strings(one)
    elif isinstance(value, list | tuple):
        for one in value:
            yield from strings(one)
    elif isinstance(value, str):
        yield value


def with_evil(facts, rows):
    """Both with such texts in phases, hosts, reasons, methods, names, warnings."""
    facts["title"] = EVIL
    facts["environment"] |= {"host": EVIL, "cpu": EVIL, "commit": EVIL, "os": EVIL}
    facts["pair"]["label"] += EVIL
    told = []
    for row in rows:
        if row["phases"]:
            row["phases"].insert(1, [EVIL, 0.05, 0.06])
            row["used"]["methods"][EVIL] = EVIL
            row["versions"][EVIL] = EVIL
        row |= {"technology": EVIL, "unranked": None, "warnings": [EVIL]}
        row["reason"] = row["reason"] and EVIL
        told.append(row)
    for cell in facts["cells"]:
        cell["technology"] = EVIL
    return facts, told


@pytest.fixture
def run(tmp_path):
    stored_run.write(tmp_path / "run", *with_evil(stored_run.facts(), stored_run.rows()))
    return tmp_path / "run"


def test_the_gate(run):
    found = list(strings(list(store.read(run))))
    assert SHOWN in found and not [text for text in found if clean.CONTROL.search(text)]


def test_the_gate_of_a_run_on_a_cluster(tmp_path):
    facts, jobs = stored_run.facts("cluster"), stored_run.job_lines()
    for line in jobs:
        line |= {"host": EVIL, "reason": EVIL} if "ended" in line else {}
    parts = [(f"000{n}-1", *with_evil(stored_run.facts(n), stored_run.rows(n))) for n in range(2)]
    stored_run.write(tmp_path / "run", facts, [], jobs, parts)
    found = list(strings(list(store.read(tmp_path / "run", list(store.hosts(tmp_path / "run"))))))
    assert SHOWN in found and not [text for text in found if clean.CONTROL.search(text)]


def test_what_is_no_control_character_stays():
    text = "é \u2028 \u00a0 😀 日本 a\tb\nc \U0001f469\u200d\U0001f680"
    assert clean.parsed(json.dumps({text: [text]}).encode()) == {text: [text]}


@pytest.mark.parametrize("command", [["status", "RUN"], ["status", "RUN", "--json"], ["compare", "RUN", "RUN"]])
def test_a_terminal(run, rayrace, command):
    said = rayrace(*(run if word == "RUN" else word for word in command), code=0)
    assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202e]", said.stdout + said.stderr)


@pytest.mark.slow
def test_the_report(run):
    """Its drawings are XML, in which no control character may be."""
    facts, rows = with_evil(stored_run.facts(), stored_run.rows())
    for row in rows:
        row["warnings"] = ["=1+1", "@SUM(A1)"]
        row["technology"] = "-2+3"
    stored_run.write(run, facts, rows)
    stored_run.write_series(run, rows)
    several.make([run], run / "report")
    written = [*(run / "report").glob("*.md"), *(run / "report").glob("*.svg"), *(run / "report").glob("*.csv")]
    found = "".join(path.read_text("utf-8") for path in written)
    assert "x1b" in found and not re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", found)
    assert len(written) > 5 and (run / "report" / "report.html").stat().st_size
    for path in (run / "report").rglob("*.csv"):
        with open(path, newline="", encoding="utf-8") as file:
            bad = [
                cell for row in csv.reader(file) for cell in row if cell[:1] in table.FORMULA and not is_number(cell)
            ]
        assert not bad, (path.name, bad)


def is_number(text):
    try:
        float(text)
    except ValueError:
        return False
    return True


def test_formulas(tmp_path):
    texts = ["=HYPERLINK(1)", "+1", "-1", "@a", "\tb", "c", "-"]
    frame = pd.DataFrame({"=text": texts, "number": [-1.5, 2, 3, 4, 5, 6, 7]})
    table.write_frame(tmp_path / "a.csv", frame)
    with open(tmp_path / "a.csv", newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["'=text", "number"]
    assert [row[0] for row in rows] == ["'=HYPERLINK(1)", "'+1", "'-1", "'@a", "'\tb", "c", "'-"]
    assert [float(row[1]) for row in rows] == frame["number"].tolist()


def test_a_picture_that_was_not_judged(tmp_path):
    """Other bytes than those whose SHA-256 the row has: it is not shown, and the reason is said."""
    picture, rows = np.random.default_rng(3).random((4, 4, 3)), stored_run.rows()
    digest = hashlib.sha256(picture.tobytes()).hexdigest()
    for row in rows:
        if row["picture"]:
            row["picture"]["sha256"] = digest
    stored_run.write(tmp_path / "run", stored_run.facts(), rows)
    (tmp_path / "run" / "pictures").mkdir()
    loaded = results.load(tmp_path / "run")
    file = tmp_path / "run" / loaded.record(loaded.cells[0])["picture"]["file"]
    for order in "CF":
        np.save(file, np.asarray(picture, order=order))
        assert np.array_equal(stored.picture(loaded, loaded.cells[0]), picture)
    np.save(file, np.nextafter(picture, 1))
    found = stored.picture(loaded, loaded.cells[0])
    assert isinstance(found, results.Missing) and "not those that were judged" in found.reason


@pytest.mark.parametrize("digest", [None, "", "0", "deadbeef", "0" * 63, "A" * 64, "0" * 64 + "\n"])
def test_a_picture_whose_checksum_is_none(digest, tmp_path):
    """What could not be compared with its picture is no row."""
    rows = stored_run.rows()
    rows[0]["picture"]["sha256"] = digest
    stored_run.write(tmp_path / "run", stored_run.facts(), rows)
    with pytest.raises(UserError, match="sha256"):
        results.load(tmp_path / "run")


@pytest.mark.parametrize(
    "text", ["", "some", "some total=5\n", "some avg10=x avg300=1\n", "some avg10=1 avg60=2\n", "x=y"]
)
def test_a_pressure_file_of_another_kind(text, tmp_path):
    found = fitness_cores.pressure(text)
    assert found.verdict == "unknown" and "avg10" in found.value
    environment = {**stored_run.facts()["environment"], "pressure": text}
    if "avg10=1" not in text:
        assert any("no avg10" in line for line in provenance.disturbances(environment))
    whole = "some avg10=3.50 avg60=2.00 avg300=1.25 total=9\nfull avg10=0.00 avg60=0.00 avg300=0.00 total=0\n"
    assert fitness_cores.pressure(whole).value == "3.50 % of the last 10 s, 1.25 % of the last 5 min"
