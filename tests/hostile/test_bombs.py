"""Small files of a stranger that would take all memory or time: each is refused early, with what was too much of it."""

import io
import json
import lzma
import os
import struct
import tarfile
import zlib
from contextlib import contextmanager

import hostile
import numpy as np
import pytest
from stored_run import facts, rows, texts, write

from harness.store import arrays, clean, lines, packed, store
from reports.run import results, stored

QUICK = [{"id": lzma.FILTER_LZMA2, "preset": 0, "dict_size": 1 << 16}]


@contextmanager
def archive(path):
    """The stream that a packed file is made of."""
    with lzma.open(path, "wb", filters=QUICK) as out:
        yield out


def member(name, size=0, kind=tarfile.REGTYPE):
    made = tarfile.TarInfo(name)
    made.size, made.type = size, kind
    return made.tobuf(tarfile.GNU_FORMAT)


def refused(file, match, *names):
    def load():
        with packed.opened(file) as folder:
            return results.load(folder)

    return hostile.refused(load, *(names or [file.name]), match=match)


@pytest.mark.parametrize("kind", [tarfile.XHDTYPE, tarfile.XGLTYPE, tarfile.GNUTYPE_LONGNAME, tarfile.GNUTYPE_LONGLINK])
@pytest.mark.parametrize("there", [1 << 17, 100 << 20])
def test_headers_of_3_gb(place, kind, there):
    with archive(place / "a.tar.xz") as out:
        out.write(member("pax", 3 << 30, kind))
        for _ in range(there >> 17):
            out.write(b"9" * (1 << 17))
    refused(place / "a.tar.xz", "a header of more than 64 kB")


def test_headers_without_end(place):
    """A short one after the other."""
    with archive(place / "a.tar.xz") as out:
        text = b"20 comment=aaaaaaaa\n"
        out.write((member("pax", len(text), tarfile.XHDTYPE) + text.ljust(512, b"\0")) * 10_000)
    refused(place / "a.tar.xz", "a header of more than 64 kB|recursion|header")


@pytest.mark.parametrize("size", [0, 1])
def test_members_without_end(place, size):
    with archive(place / "a.tar.xz") as out:
        for _ in range(20):
            out.write((member("logs/a.stdout", size) + bytes(512 * size)) * 10_000)
    assert (place / "a.tar.xz").stat().st_size < 100_000
    refused(place / "a.tar.xz", r"more than [\d,]+ files, too many")


def test_as_many_members_as_are_taken(place):
    """No more than their time: a file that is large enough for all of them."""
    random = np.random.default_rng(5)
    with archive(place / "a.tar.xz") as out:
        for number in range(packed.MEMBERS + 1):
            out.write(member(f"logs/{number}.stdout", 512) + random.bytes(512))
    refused(place / "a.tar.xz", r"more than 20,000 files, too many")


def test_members_that_are_sparse(place):
    with archive(place / "a.tar.xz") as out:
        made = tarfile.TarInfo("logs/a.stdout")
        made.type, made.size = tarfile.GNUTYPE_SPARSE, 512
        out.write(made.tobuf(tarfile.GNU_FORMAT) + bytes(512))
    refused(place / "a.tar.xz", "not a packed run")


def test_rows_without_end(place):
    """60 MB of `{}` in 10 kB, and 250 MB of them in a folder."""
    with archive(place / "a.tar.xz") as out:
        for name, data in texts(facts(), []).items():
            if name != "repetitions.jsonl":
                out.write(member(name, len(data)) + data.ljust(-(-len(data) // 512) * 512, b"\0"))
        size = 60 * 3 * 333_333
        out.write(member("repetitions.jsonl", size))
        for _ in range(60):
            out.write(b"{}\n" * (size // 180))
        out.write(bytes(-size % 512))
    assert (place / "a.tar.xz").stat().st_size < 100_000
    refused(place / "a.tar.xz", "more than 150,000 lines", "repetitions.jsonl")


@pytest.fixture
def run(place):
    write(place / "run", facts(), rows())
    return place / "run"


# Functions, as together they are 900 MB, which every process that collects the tests would make and hold.
HEAVY = {
    "rows": ("repetitions.jsonl", lambda: b"{}\n" * (250 << 18), "more than 150,000 lines"),
    "a row": ("repetitions.jsonl", lambda: b'{"cell": "x", "a": [' + b"0," * (6 << 20) + b"0]}\n", "64 MiB of values"),
    "values": ("repetitions.jsonl", lambda: (b'{"a":[' + b"[]," * 4_000_000 + b"0]}\n") * 8, "64 MiB of values"),
    "a line": ("repetitions.jsonl", lambda: b'{"a": "' + b"x" * (200 << 20) + b'"}\n', "a line of more than"),
    "no line": ("repetitions.jsonl", lambda: bytes(200 << 20), "a line of more than"),
    "tables": (
        "run.json",
        lambda: b'{"format": 1, "x": [' + b'{"a":1},' * 8_000_000 + b"0]}",
        "more values than rayrace reads",
    ),
    "bytes": ("run.json", lambda: b" " * (200 << 20), "bytes, where rayrace reads"),
}


@pytest.mark.parametrize("name", HEAVY)
def test_heavy(run, name):
    file, content, match = HEAVY[name]
    (run / file).write_bytes(content())
    hostile.refused(lambda: results.load(run), file, match=match)


@pytest.mark.parametrize("file", ["run.json", "repetitions.jsonl"])
def test_a_file_with_a_hole_of_a_terabyte(run, file):
    os.truncate(run / file, 1 << 40)
    hostile.refused(lambda: results.load(run), file)


def nested(deep):
    return json.loads("[" * deep + "]" * deep)


@pytest.mark.parametrize("key", ["used", "versions", "peaks", "device"])
def test_values_within_values(run, key):
    told = rows()
    told[0][key] = {"methods": nested(900), "a": nested(900)}
    write(run, facts(), told)
    hostile.refused(lambda: results.load(run), "repetitions.jsonl", match="a damaged line")
    write(run, facts() | {"x": nested(900)}, rows())
    hostile.refused(lambda: results.load(run), "run.json")


def test_a_billion_repetitions_that_nobody_ran(place):
    """A run on a cluster has a row for each that its jobs have not run."""
    from stored_run import job_lines

    for count in (10**6, 10**12, "x", -1):
        told = facts("cluster")
        told["experiment"]["override"] = {
            name[0]: {"processes": count} for name in told["executor"]["batches"][0]["cells"]
        }
        write(place / "run", told, [], job_lines(), [(f"000{n}-1", facts(n), rows(n)) for n in range(2)])
        hostile.refused(
            lambda: store.read(place / "run", list(store.hosts(place / "run"))), "run", match="processes of"
        )


def header(shape, dtype="<f8"):
    text = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    text += b" " * (118 - len(text) - 1) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text


ARRAYS = {
    "terabytes": (header("(1000000, 1000000, 3)") + bytes(96), "promises"),
    "no bytes of a number": (header("(1000000000000,)", "|V0"), "an array of"),
    "an empty giant": (header("(1000000000000, 0, 3)") + b"x", "promises"),
    "objects": (header("(1,)", "|O") + bytes(8), "an array of"),
    "a negative side": (header("(-1, 3)") + bytes(24), ""),
    "names": (header("(1,)", "<U9") + bytes(36), "an array of"),
    "nothing": (b"", ""),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_arrays_that_promise(run, name):
    content, match = ARRAYS[name]
    (run / "pictures").mkdir(exist_ok=True)
    (run / "pictures" / "cpp.npy").write_bytes(content)
    loaded = results.load(run)
    with hostile.contained():
        found = stored.array(loaded, "pictures/cpp.npy")
    assert isinstance(found, results.Missing) and match in found.reason and "pictures/cpp.npy" in found.reason, found


def test_an_array_with_a_hole_of_a_terabyte(run):
    (run / "pictures").mkdir(exist_ok=True)
    path = run / "pictures" / "cpp.npy"
    path.write_bytes(header(f"({1 << 37},)"))
    os.truncate(path, path.stat().st_size + (1 << 40))
    with hostile.contained(), pytest.raises(ValueError, match="bytes, where rayrace reads"):
        arrays.load(path)


def test_a_dictionary_of_4_gb(place):
    """xz would take the memory of it before the first byte is unpacked."""
    data = bytearray(lzma.compress(b"".join([member("run.json", 3), b"{}\n".ljust(512, b"\0"), bytes(1024)])))
    size = 4 * (data[12] + 1)
    assert data[14:16] == b"\x21\x01"  # LZMA2, with one byte of properties
    data[16] = 40
    data[12 + size - 4 : 12 + size] = struct.pack("<I", zlib.crc32(data[12 : 12 + size - 4]))
    (place / "a.tar.xz").write_bytes(data)
    refused(place / "a.tar.xz", "not a packed run: Memory usage limit")


def test_a_packed_run_that_is_a_pipe(place):
    os.mkfifo(place / "a.tar.xz")
    refused(place / "a.tar.xz", "not a plain file")


def test_a_series_that_is_large(run):
    (run / "series").mkdir(exist_ok=True)
    (run / "series" / "cpp.csv").write_bytes(b"t,cpu_s\n")
    os.truncate(run / "series" / "cpp.csv", 1 << 40)
    hostile.refused(lambda: stored.series(run / "series" / "cpp.csv"), "cpp.csv", match="where rayrace reads")


def test_real_rows_are_far_from_the_limits(run):
    line = json.dumps(rows()[0]).encode()
    assert 20 * clean.weight(line) * 1000 < lines.HEAVIEST
    sizes = io.BytesIO()
    np.save(sizes, np.zeros((2048, 2048, 3)))
    (run / "a.npy").write_bytes(sizes.getvalue())
    assert arrays.load(run / "a.npy").shape == (2048, 2048, 3)
