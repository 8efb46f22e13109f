"""Parts of a run on a cluster, read as one: with made-up rows."""

import json

import pytest

from harness.cluster import status
from harness.errors import UserError
from harness.machine import fingerprint
from harness.store import likeness, merge, store

MACHINE = {"cpu": "c", "architecture": "x", "cores": {"usable": 4}, "memory_bytes": 10**10, "gpu": "none"}
SOFTWARE = {"os": "o", "kernel": "6", "python": "3", "compilers": {}, "packages": {"numpy": "2"}}


def environment(host, **other):
    return {"host": host, **MACHINE, **SOFTWARE, "governor": "g", "turbo": "t", **other}


def cell(variant, depth, threads=1):
    return {
        "cell": f"{variant}{depth}{threads}", "variant": variant, "scene": "s.txt", "point": {"depth": depth},
        "parameters": {"threads": threads},
    }  # fmt: skip


def row(told, number=0, kind="timed", state="ok", **other):
    return {
        "cell": told["cell"],
        "repetition": number,
        "pass": kind,
        "status": state,
        "reason": "",
        "picture": None,
        **other,
    }


@pytest.fixture
def made(tmp_path):
    """A function that writes a run: cells by batch, parts (name, environment, cells, rows), lines of jobs.jsonl."""

    def make(batches, parts, jobs, pair=None, processes=2, **facts):
        folder = tmp_path / "run"
        front = store.Run(folder)
        named = [
            {"cells": [[c["variant"], c["scene"], json.dumps(c["point"])] for c in mine], "pair": None}
            for mine in batches
        ]
        for number, paired in (pair or {}).items():
            named[number]["pair"] = [paired["variant"], paired["scene"], json.dumps(paired["point"])]
        front.describe(
            title="t", environment=environment("front"), cells=[c for mine in batches for c in mine], pair={},
            experiment={"processes": processes, "override": {"b": {"processes": 1}}, "measure": {"cold": False}},
            executor={"name": "slurm", "batches": named, "table": {}}, started="0", **facts,
        )  # fmt: skip
        front.close()
        for name, told, cells, rows, *more in parts:
            one = store.Run(folder / "parts" / name)
            one.describe(title="t", environment=told, cells=cells, started=name, **(more[0] if more else {}))
            for each in rows:
                one.append(each)
            one.close()
        (folder / "jobs.jsonl").write_text("".join(json.dumps(line) + "\n" for line in jobs))
        return folder

    return make


def submitted(job, number):
    return {"job": job, "number": number, "submitted": "1"}


def ended(job, state="", reason=""):
    return {"job": job, "ended": "2", "host": "h", "status": state, "reason": reason}


def test_rows_of_all_parts(made):
    """The files of a row are named by where they lie, and rows come with what their part says of the cell."""
    a, b = cell("a", 0), cell("b", 0)
    rows = [row(a, 0, picture={"file": "pictures/a.npy", "sha256": "1" * 64}, series="series/a-0.csv",
                accuracy={"reference_file": "pictures/r.npy", "mask_file": None}), row(a, 1)]  # fmt: skip
    parts = [("0000-7", environment("h"), [a, b], rows), ("0000-8", environment("h"), [a, b], [row(b)])]
    folder = made([[a, b]], parts, [submitted("7", 0), ended("7"), submitted("8", 0), ended("8")])
    facts, records = store.read(folder)
    assert [(r["cell"], r["repetition"], r["scene"]) for r in records] == [
        ("a01", 0, "s.txt"), ("a01", 1, "s.txt"), ("b01", 0, "s.txt")
    ]  # fmt: skip
    assert records[0]["picture"]["file"] == "parts/0000-7/pictures/a.npy"
    assert records[0]["series"] == "parts/0000-7/series/a-0.csv"
    assert records[0]["agreement"] == {"reference_file": "parts/0000-7/pictures/r.npy", "mask_file": None}
    assert facts["environment"]["host"] == "h" and list(facts["hosts"]) == [fingerprint.of(environment("h"))]


def test_what_is_lost_is_a_row_until_another_has_run_it(made):
    a, b = cell("a", 0), cell("b", 0)
    parts = [("0000-7", environment("h"), [a, b], [row(a, 0)])]
    jobs = [submitted("7", 0), ended("7", "killed", "job 7 was cancelled")]
    folder = made([[a, b]], parts, jobs)
    _, records = store.read(folder)
    lost = [(r["variant"], r["repetition"], r["status"], r["reason"]) for r in records if r.get("lost")]
    assert lost == [("a", 1, "killed", "job 7 was cancelled"), ("b", 0, "killed", "job 7 was cancelled")]
    assert all(r["frames_s"] is None and r["warnings"] == [] for r in records if r.get("lost"))
    assert status.of(folder).done == 1 and status.of(folder).all == 3
    # One more job is under way: nothing is known of these any more.
    with open(folder / "jobs.jsonl", "a") as file:
        file.write(json.dumps(submitted("8", 0)) + "\n" + '{"job": "8", "en')
    assert len(store.read(folder)[1]) == 1


def test_of_two_rows_the_one_that_ran_stands(made):
    a = cell("a", 0)
    bad, good = row(a, 0, state="unavailable"), row(a, 0, took_s=1.0)
    second = row(a, 0, took_s=2.0)
    for parts in ([[bad], [good]], [[good], [bad]], [[good], [second]]):
        folder = made([[a]], [(f"0000-{n}", environment("h"), [a], rows) for n, rows in enumerate(parts)], [])
        _, records = store.read(folder)
        assert [r.get("took_s") for r in records] == [1.0]
        for path in sorted(folder.rglob("*.jsonl")):
            path.unlink()


def test_hosts_with_other_numbers_of_threads(made):
    """A cell is known by what the experiment calls it; each host has its own number of threads."""
    few, many = cell("a", 0, 4), cell("a", 0, 64)
    parts = [("0000-7", environment("h"), [few], [row(few, 0)]), ("0000-8", environment("i"), [many], [row(many, 1)])]
    folder = made([[cell("a", 0, 2)]], parts, [submitted("8", 0), ended("8")])
    with pytest.raises(UserError, match=r"h-\w+, i-\w+; choose with --host"):
        store.read(folder)
    names = list(store.hosts(folder))
    assert [store.named(folder, told) for told in ("", "h", names[1])] == [None, names[:1], names[1:]]
    with pytest.raises(UserError, match=r"--host k: .* has rows of h-"):
        store.named(folder, "k")
    for name, wanted in zip(names, (few, many), strict=True):
        facts, records = store.read(folder, [name])
        assert facts["cells"] == [wanted] and [r["cell"] for r in records] == [wanted["cell"]]
    facts, records = store.read(folder, names)
    assert facts["cells"] == [few, many] and len(records) == 2
    assert status.of(folder).done == 2


def test_a_cell_that_lacks_a_key_is_no_run_on_a_cluster(made):
    a, b = cell("a", 0), cell("b", 0)
    del b["parameters"]
    with pytest.raises(UserError, match=r"cells\.1\.parameters is missing"):
        store.read(made([[a, b]], [], []))


def test_turns(made):
    a, b = cell("a", 0), cell("b", 0)
    facts, _ = store.read(made([[a, b]], [], [], pair={0: a}, processes=3))
    told = merge.turns(facts, facts["executor"]["batches"][0])
    assert len(told) == 3 + 1 + 3 and len(set(told)) == 7
    assert sum(kind == "pair" for *_, kind in told) == 3
    facts["experiment"]["measure"]["count"] = True
    counts = [name for name in merge.turns(facts, facts["executor"]["batches"][0]) if name[-1] == "count"]
    assert [(name[0], name[-2]) for name in counts] == [("a", 0), ("b", 0)]


def test_hosts_that_are_alike():
    one, two = environment("n1"), environment("n2", memory_bytes=int(0.99 * 10**10))
    assert likeness.is_alike(one, two) and likeness.kinds([one, two, one]) == []
    other = environment("n3", kernel="7", cores={"usable": 8})
    assert not likeness.is_alike(one, other)
    assert likeness.kinds([one, two, other]) == [
        "hosts differ in cores: {'usable': 4} on n1, n2; {'usable': 8} on n3",
        "hosts differ in kernel: 6 on n1, n2; 7 on n3",
    ]  # fmt: skip
    assert not likeness.is_alike(one, environment("n2", memory_bytes=int(0.9 * 10**10)))


def test_a_slow_host():
    """Only one that is surely slower than the median of the hosts is told."""

    def part(host, *rates):
        return {"environment": environment(host), "speed": {"float64": list(rates), "bytes": [1.0, 1.0, 1.0]}}

    quick = [part(f"n{n}", 10.0, 10.1, 9.9) for n in range(4)]
    assert likeness.speeds([*quick, part("n9", 9.9, 9.8, 10.05)]) == []
    (told,) = likeness.speeds([*quick, part("n9", 8.0, 8.1, 8.2)])
    assert told.startswith("n9 does 0.81 of the median host's float64")
    assert likeness.speeds([*quick, part("n9", 8.0, 8.1, 10.2)]) == []  # disturbed, perhaps
    assert (
        likeness.speeds([part("n1", 1.0), {"environment": environment("n2"), "speed": {"unavailable": "no c++"}}]) == []
    )
