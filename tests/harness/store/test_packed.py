"""A run in one file: nothing of it is lost, it is small, and a stranger's does no harm."""

import errno
import io
import lzma
import os
import signal
import subprocess
import sys
import tarfile
import tempfile

import numpy as np
import pytest

from harness.errors import UserError
from harness.store import packed, store

SEED = 71


@pytest.fixture
def run(tmp_path):
    """A run with arrays of every kind that a run has, and some that it has not."""
    made = store.Run(tmp_path / "a-run")
    made.describe(title="t")
    rng = np.random.default_rng(SEED)
    picture = rng.random((31, 17, 3))
    arrays = {
        "b.npy": picture,
        "a.npy": picture.astype(np.float32),
        "c.mask.npy": picture[..., 0] > 0.5,
        "d.npy": np.asfortranarray(picture),
        "e.npy": np.zeros((0, 3)),
        "f.npy": np.array([np.nan, np.inf, -0.0, 5e-324]),
    }
    for name, array in arrays.items():
        np.save(made.folder / "pictures" / name, array)
    made.append({"cell": "c", "repetition": 0, "picture": {"file": "pictures/b.npy", "sha256": "0" * 64}})
    made.close()
    (made.folder / "series" / "c-0.csv").write_text("t,cpu_s\n0,0\n")
    (made.folder / "logs" / "c-0.stdout").write_text("")
    (made.folder / "logs" / "c-0.stderr").write_text("a line\n")
    (made.folder / "report").mkdir()
    return made.folder


def files(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_nothing_is_lost_and_the_bytes_are_the_same_again(run, tmp_path):
    for name in ("one.tar.xz", "two.tar.xz"):
        packed.pack(run, tmp_path / name)
    assert (tmp_path / "one.tar.xz").read_bytes() == (tmp_path / "two.tar.xz").read_bytes()
    with packed.opened(tmp_path / "one.tar.xz") as folder:
        there = files(folder)
        assert folder.name == packed.name(tmp_path / "one.tar.xz") == "one"
        assert store.read(folder) == store.read(run)
    assert there == {name: data for name, data in files(run).items() if name != "logs/c-0.stdout"}
    assert not folder.exists()


def test_a_full_disk_for_temporary_files(run, tmp_path, monkeypatch):
    """It is not the run's fault; what to do is said, and nothing is left."""
    packed.pack(run, tmp_path / "one.tar.xz")
    copy = packed.shutil.copyfileobj

    def fails(source, target, size):
        copy(source, target, size)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(packed.shutil, "copyfileobj", fails)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    with pytest.raises(UserError) as caught, packed.opened(tmp_path / "one.tar.xz"):
        pass
    said = str(caught.value)
    assert "not a packed run" not in said and f"cannot be unpacked in {tmp_path / 'tmp'}" in said
    assert said.endswith("No space left on device; make room there, or set TMPDIR to another folder")
    assert not list((tmp_path / "tmp").iterdir())


WAITS = """import time
from harness.store import store
def hosts(folder):
    print(folder, flush=True)
    time.sleep(60)
store.hosts = hosts
from rayrace.main import main
main()
"""


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_a_signal_leaves_no_unpacked_run(name, run, tmp_path):
    packed.pack(run, tmp_path / "one.tar.xz")
    (tmp_path / "tmp").mkdir()
    words = [sys.executable, "-c", WAITS, "compare", tmp_path / "one.tar.xz", tmp_path / "one.tar.xz", "--host", "x"]
    known = {**os.environ, "TMPDIR": str(tmp_path / "tmp")}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(words, env=known, **pipes, preexec_fn=hear_ctrl_c) as process:
        assert process.stdout.readline().startswith(str(tmp_path / "tmp"))
        process.send_signal(getattr(signal, name))
        _, said = process.communicate(timeout=60)
    assert process.returncode == (130 if name == "SIGINT" else -getattr(signal, name)) and "Traceback" not in said
    assert not list((tmp_path / "tmp").iterdir())


def hear_ctrl_c():
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def test_a_folder_is_itself(run):
    with packed.opened(run) as folder:
        assert folder == run
    assert run.exists() and packed.name(run) == "a-run"


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_pictures_that_differ_in_last_bits_take_little_more_than_one(tmp_path, dtype):
    def size(pictures):
        made = store.Run(tmp_path / f"run-{pictures}")
        made.describe(title="t")
        rng = np.random.default_rng(SEED)
        first = rng.random((128, 128, 3)).astype(dtype)
        for number in range(pictures):
            other = first * (1 + np.finfo(dtype).eps * rng.integers(-1, 2, first.shape).astype(dtype))
            np.save(made.folder / "pictures" / f"{number}.npy", other)
        made.close()
        packed.pack(made.folder, tmp_path / "run.tar.xz")
        return (tmp_path / "run.tar.xz").stat().st_size

    assert size(5) < 2 * size(1)


def tar(file, members):
    """A packed file of anything: (name, bytes, changes of its header)."""
    with lzma.open(file, "wb") as out, tarfile.open(fileobj=out, mode="w|") as made:
        for name, data, changes in members:
            member = tarfile.TarInfo(name)
            member.size = len(data)
            for key, value in changes.items():
                setattr(member, key, value)
            made.addfile(member, io.BytesIO(data))
    return file


def refused(file, match):
    with pytest.raises(UserError, match=match) as raised, packed.opened(file):
        pass
    assert str(file) in str(raised.value)


@pytest.mark.parametrize("name", ["../evil", "/evil", "pictures/../../evil", "evil", "series/a/b", "run.json/x"])
def test_no_path_leaves_the_folder(tmp_path, name):
    refused(tar(tmp_path / "x.tar.xz", [(name, b"x", {})]), "it contains")


@pytest.mark.parametrize("kind", [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.FIFOTYPE, tarfile.CHRTYPE])
def test_only_files(tmp_path, kind):
    refused(tar(tmp_path / "x.tar.xz", [("pictures/a", b"", {"type": kind, "linkname": "/etc/passwd"})]), "it contains")


def test_a_bomb(tmp_path, monkeypatch):
    monkeypatch.setattr(packed, "LARGEST", 1 << 20)
    refused(tar(tmp_path / "x.tar.xz", [("pictures/a", bytes(2 << 20), {})]), "more than")


def test_a_picture_that_is_none(tmp_path):
    objects = io.BytesIO()
    np.save(objects, np.array([{}], dtype=object), allow_pickle=True)
    refused(tar(tmp_path / "x.tar.xz", [("pictures/a.npy.planes", objects.getvalue(), {})]), "an array of objects")
    refused(tar(tmp_path / "y.tar.xz", [("pictures/a.npy.planes", b"no array", {})]), "not a packed run")


def test_damage(run, tmp_path):
    file = tmp_path / "x.tar.xz"
    packed.pack(run, file)
    data = file.read_bytes()
    rng = np.random.default_rng(SEED)
    for bad in (b"", data[: len(data) // 2], b"\0" * 100, data[:50] + bytes(rng.bytes(50)) + data[100:]):
        file.write_bytes(bad)
        refused(file, "not a packed run: .*rayrace export RUN --format packed")
    refused(tmp_path / "absent.tar.xz", "No such file")


def test_what_is_no_run_is_not_packed(tmp_path):
    with pytest.raises(UserError, match="not a run"):
        packed.pack(tmp_path, tmp_path / "x.tar.xz")
    assert not list(tmp_path.iterdir())
