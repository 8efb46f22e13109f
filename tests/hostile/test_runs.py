"""Hostile stored runs, whole or packed: cells that a report can be made of, or an error that names the file."""

import io
import json
import lzma
import os
import pickle
import re
import tarfile

import hostile
import numpy as np
import pytest
from stored_run import as_bytes, facts, job_lines, rows, texts, write

from harness.errors import UserError
from harness.machine import environment
from harness.plan import predict
from harness.store import packed, store
from reports.run import results

NAMES = "run.json", "repetitions.jsonl", "jobs.jsonl", ": a file"


def load(folder, floor=True):
    """All that is asked of a run before a section of its report is written. floor: its noise too, which is slow."""
    hosts = store.hosts(folder)
    loaded = results.load(folder, list(hosts))
    for cell in loaded.cells:
        assert cell.verdict and cell.label is not None and cell.place
        cell.median("steady_s", "no time")
    assert loaded.scenes is not None and (not floor or loaded.floor)
    return loaded


@pytest.fixture(scope="module", autouse=True)
def _warm():
    """What libraries take when they are first used is no case's."""
    with hostile.scratch() as folder:
        write(folder / "run", facts(), rows())
        load(folder / "run")


@pytest.fixture
def tried(place):
    """tried(told, records, ..): what `load` makes of a run of this."""

    def tried(*told, floor=True):
        write(place / "run", *told)
        return hostile.outcome(lambda: load(place / "run", floor), *NAMES)

    return tried


def bent_bytes(random, told):
    """A tree of JSON bent, or its text damaged."""
    if random.randint(0, 2):
        return as_bytes(hostile.bent(random, told))
    return hostile.damaged_bytes(random, as_bytes(told))


def test_cases(fuzz, tried):
    def once(random):
        told, records = facts(), rows()
        if random.randint(0, 1):
            told = bent_bytes(random, told)
        else:
            number = random.randint(0, len(records) - 1)
            records[number] = bent_bytes(random, records[number])
        tried(told, records, floor=random.randint(0, 9) == 0)

    fuzz("stored runs", once)


def test_cases_of_runs_that_lie_about(fuzz, place, monkeypatch):
    """From which the times of a new run are predicted, unless they are damaged."""
    here = environment.capture()
    monkeypatch.setattr(environment, "capture", lambda: here)

    def once(random):
        told, records = facts(), rows()
        told["environment"].update(host=here["host"], cpu=here["cpu"])
        if random.randint(0, 1):
            told = bent_bytes(random, told)
        else:
            records[0] = bent_bytes(random, records[0])
        write(place / "run", told, records)
        with hostile.contained():
            predict.Predictor(predict.history(place))

    fuzz("runs that lie about", once)
    write(place / "run", {**facts(), "environment": here}, rows())
    assert len(predict.history(place)) == len(rows())


def test_cases_of_clusters(fuzz, tried):
    def once(random):
        told, jobs, parts = facts("cluster"), job_lines(), [[f"000{n}-1", facts(n), rows(n)] for n in range(2)]
        what = random.randint(0, 3)
        if what == 0:
            told = bent_bytes(random, told)
        elif what == 1:
            number = random.randint(0, len(jobs) - 1)
            jobs[number] = bent_bytes(random, jobs[number])
        else:
            part = random.choice(parts)
            if what == 2:
                part[1] = bent_bytes(random, part[1])
            else:
                part[2][0] = bent_bytes(random, part[2][0])
        tried(told, [], jobs, parts, floor=random.randint(0, 9) == 0)

    fuzz("runs on clusters", once)


def test_the_corpus_is_good(tried):
    found = tried(facts(), rows())
    assert not isinstance(found, UserError), found
    assert [cell.status for cell in found.cells] == ["ok", "ok", "failed"]
    found = tried(facts("cluster"), [], job_lines(), [(f"000{n}-1", facts(n), rows(n)) for n in range(2)])
    assert not isinstance(found, UserError), found
    assert any(record.get("lost") for record in found.records)


def packed_file(path, members):
    """A packed run of (name, bytes); the quickest that xz can."""
    filters = [{"id": lzma.FILTER_LZMA2, "preset": 0, "dict_size": 1 << 16}]
    with lzma.open(path, "wb", filters=filters) as out, tarfile.open(fileobj=out, mode="w|") as tar:
        for name, data in members:
            member = tarfile.TarInfo(name)
            member.size = len(data)
            tar.addfile(member, io.BytesIO(data))


def unpack(file):
    with packed.opened(file) as folder:
        return load(folder, floor=False)


def planes():
    file = io.BytesIO()
    np.save(file, np.zeros((4, 4, 3)))
    return file.getvalue()


MEMBERS = [
    *(
        "run.json",
        "repetitions.jsonl",
        "jobs.jsonl",
        "pictures/a.npy.planes",
        "logs/a.stdout",
        "../a",
        "/a",
        "pictures",
    ),
    *("pictures/..", "parts/x/run.json", "pictures/a/b", "run.json/x", "", ".", "end.json"),
]


def test_cases_of_packed_runs(fuzz, place):
    def once(random):
        members = [*texts(facts(), rows()).items(), ("pictures/a.npy.planes", planes())]
        way = random.randint(0, 2)
        number = random.randint(0, len(members) - 1)
        name, data = members[number]
        if way == 0:
            members[number] = name, hostile.damaged_bytes(random, data)
        elif way == 1:
            members[number] = random.choice(MEMBERS), data
        file = place / "a.tar.xz"
        packed_file(file, members)
        if way == 2:  # of what xz packed, which its checksums tell, or, without them, of the archive
            whole = file.read_bytes()
            if random.randint(0, 1):
                whole = lzma.compress(hostile.damaged_bytes(random, lzma.decompress(whole)), preset=0)
            else:
                whole = hostile.damaged_bytes(random, whole)
            file.write_bytes(whole)
        hostile.outcome(lambda: unpack(file), "a.tar.xz", *NAMES)

    fuzz("packed runs", once)


DEEP = 100_000
BAD = {
    "nothing": b"",
    "NUL bytes": b"\0" * 1000,
    "UTF-16": json.dumps(facts()).encode("utf-16"),
    "half a letter": json.dumps(facts()).encode() + b"\xc3",
    "a list": b"[]",
    "nested lists": b"[" * DEEP,
    "nested tables": b'{"format": 1, "x": ' + b'{"a":' * DEEP,
    "nested as deep as is read": b'{"format": 1, "environment": ' + b'{"a":' * 900 + b"1" + b"}" * 901,
    "a number of 5000 digits": b'{"format": 1, "x": ' + b"1" * 5000 + b"}",
    "no cells": {"format": 1},
    "cells that are none": facts() | {"cells": [1, None, "x"]},
    "a cell without a name": facts() | {"cells": [{}]},
    "cells that are a table": facts() | {"cells": {"a": 1}},
    "no environment": facts() | {"environment": []},
    "another experiment": facts() | {"experiment": "x"},
    "a pair of one": facts() | {"pair": {"cell": "key-cpp"}},
}


@pytest.mark.parametrize("name", BAD)
def test_bad(tried, name):
    found = tried(BAD[name], rows())
    assert isinstance(found, UserError) and "run" in str(found), found


BAD_ROWS = {
    "NUL bytes": b"\0" * 1000,
    "UTF-16": json.dumps(rows()[0]).encode("utf-16").replace(b"\n", b""),
    "half a letter": b'{"cell": "\xc3"}',
    "nested lists": b'{"cell": "x", "used": ' + b"[" * DEEP + b"]" * DEEP + b"}",
    "half a pair": b'{"cell": "\\ud800"}',
    "no number": json.dumps(rows()[0] | {"wall_s": float("nan")}).encode(),
    "nothing of it": {},
    "a list for a cell": {"cell": []},
    "a table for a cell": {"cell": {}},
    "frames that are texts": rows()[0] | {"frames_s": ["x"]},
    "frames that are none": rows()[0] | {"frames_s": {"a": 1}},
    "phases of two": rows()[0] | {"phases": [["a", 1]]},
    "rays without kinds": rows()[0] | {"rays": {}},
    "warnings that are numbers": rows()[0] | {"warnings": [1]},
    "another's point": rows()[0] | {"point": 5},
    "a status of numbers": rows()[0] | {"status": 5},
    "parameters of nothing": rows()[0] | {"parameters": []},
}


@pytest.mark.parametrize("name", BAD_ROWS)
def test_a_bad_row(tried, name):
    found = tried(facts() | {"cells": []}, [BAD_ROWS[name], *rows()])
    assert isinstance(found, UserError) and re.search(r"repetitions\.jsonl(:1|: repet)", str(found)), found


def test_a_bomb_of_zeros(place):
    """Half a megabyte that unpacks to gigabytes is not held in memory."""
    file = place / "a.tar.xz"
    members = texts(facts(), rows())
    with lzma.open(file, "wb", preset=0) as out, tarfile.open(fileobj=out, mode="w|") as tar:
        for name, data in members.items():
            member = tarfile.TarInfo(name)
            member.size = len(data)
            tar.addfile(member, io.BytesIO(data))
        member = tarfile.TarInfo("logs/zeros.stdout")
        for size in (50 << 20, 300 << 20):
            member.size = size
            tar.addfile(member, _Zeros())
    assert file.stat().st_size < 1 << 20
    found = hostile.refused(
        lambda: unpack(file),
        "a.tar.xz",
        match="too large when unpacked: more than 4 GiB, and more than 64 MiB and 100 times",
    )
    assert "allocate" not in found


def test_a_member_that_promises(place):
    """A size that is announced, and not there."""
    for size in (1 << 40, 1 << 27, -1):
        with lzma.open(place / "a.tar.xz", "wb", preset=0) as out:
            member = tarfile.TarInfo("logs/a.stdout")
            member.size = size
            out.write(member.tobuf(tarfile.GNU_FORMAT))
        hostile.refused(lambda: unpack(place / "a.tar.xz"), "a.tar.xz", "run.json")


class _Zeros:
    def read(self, count):
        return bytes(count)


def test_planes_that_promise(place):
    """A header of 10^12 numbers, and one of no bytes each."""
    for shape, dtype in (("(1000000000000,)", "<f8"), ("(10,)", "|S0"), ("(1,)", "|V1000000000"), ("(1,)", "|O")):
        text = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}".encode()
        text += b" " * (118 - len(text) - 1) + b"\n"
        data = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(81)
        packed_file(place / "a.tar.xz", [*texts(facts(), rows()).items(), ("pictures/a.npy.planes", data)])
        hostile.outcome(lambda: unpack(place / "a.tar.xz"), "a.tar.xz")


def test_no_pickle_is_loaded(place):
    """Neither of a picture, nor of anything else that a run can hold."""
    mark = place / "mark"

    class Evil:
        def __reduce__(self):
            return open, (str(mark), "w")

    write(place / "run", facts(), rows())
    (place / "run" / "pictures").mkdir(exist_ok=True)
    for name in {row["picture"]["file"] for row in rows() if row["picture"]}:
        with open(place / "run" / name, "wb") as file:
            pickle.dump(Evil(), file)
    from reports.run import stored

    loaded = load(place / "run")
    assert any(isinstance(stored.picture(loaded, cell), results.Missing) for cell in loaded.cells)
    assert not mark.exists()


def test_a_pipe_in_place_of_rows(place):
    write(place / "run", facts(), rows())
    os.remove(place / "run" / "repetitions.jsonl")
    os.mkfifo(place / "run" / "repetitions.jsonl")
    hostile.refused(lambda: load(place / "run"), "repetitions.jsonl")
