"""The cache of references and builds: damaged, unwritable, or filled by a clock that was wrong. All is made again."""

import os
import random
import subprocess
import time

import faulty
import numpy as np
import pytest
from left_behind import left_behind

from harness.judge import cache as kept
from harness.judge.cache import Kept
from harness.renderer import builder
from harness.store import store
from harness.system import ownership

SEED = int(os.environ.get("RAYRACE_FUZZ_SEED", "20"))
FACTS = {"maker": "cpp", "rays": {"primary": 63}}


@pytest.mark.parametrize("way", ["cut off", "changed", "filled with zeros", "of nothing"])
def test_a_reference_that_is_damaged(tmp_path, way, injected):
    """It is what was kept, or nothing; never anything else, and no exception."""
    rng, folder, cases = random.Random(SEED), Kept(tmp_path), 1 if way == "of nothing" else 300
    arrays = {"picture": np.arange(189.0).reshape(7, 9, 3), "mask": np.zeros((7, 9), bool)}
    folder.put("k", FACTS, arrays)
    whole, good = (tmp_path / "k.npz").read_bytes(), 0
    for _ in range(cases):
        data = bytearray(whole)
        if way == "cut off":
            del data[rng.randrange(len(data)) :]
        elif way == "changed":
            for _ in range(rng.choice((1, 1, 5, 50))):
                data[rng.randrange(len(data))] = rng.randrange(256)
        elif way == "filled with zeros":
            start = rng.randrange(len(data))
            data[start : start + 512] = bytes(len(data[start : start + 512]))
        else:
            data = b""
        (tmp_path / "k.npz").write_bytes(data)
        found = folder.get("k")
        if found is not None:
            good += 1
            assert found[0] == FACTS and all(np.array_equal(found[1][name], arrays[name]) for name in arrays)
    folder.put("k", FACTS, arrays)
    assert folder.get("k")[0] == FACTS
    injected("damaged reference", cases)
    print(f"{cases} references {way}: {good} of them still good, others made again; wrong ones taken: 0")


@pytest.fixture
def cached(tmp_path):
    """A cache of its own with a build in it, and what builds it: cached() is the Built."""
    from harness.renderer import registry

    faulty.tiny(tmp_path / "tiny")

    def build():
        (entry,) = [entry for name, entry in registry.entries((tmp_path / "tiny" / "flat",)).items() if name == "flat"]
        return entry.renderer.build()

    before = os.environ["RAYRACE_CACHE"]
    os.environ["RAYRACE_CACHE"] = str(tmp_path / "cache")
    try:
        yield build
    finally:
        os.environ["RAYRACE_CACHE"] = before


DAMAGE = {
    "cut off": lambda built: (built / "flat").write_bytes((built / "flat").read_bytes()[:1000]),
    "a bit": lambda built: (built / "flat").write_bytes(
        bytes([(data := (built / "flat").read_bytes())[0] ^ 1]) + data[1:]
    ),
    "gone": lambda built: (built / "flat").unlink(),
    "may not be run": lambda built: (built / "flat").chmod(0o644),
    "no record": lambda built: (built / "build.json").unlink(),
    "record cut off": lambda built: (built / "build.json").write_text('{"seconds": 1.'),
    "record of another kind": lambda built: (built / "build.json").write_text("[]"),
    "a folder": lambda built: ((built / "flat").unlink(), (built / "flat").mkdir()),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_build_that_is_damaged_is_made_again(cached, damage, injected):
    first = cached()
    whole = (first.folder / "flat").read_bytes()
    assert not first.cached and cached().cached
    DAMAGE[damage](first.folder)
    leftover = left_behind(first.folder.with_name(first.folder.name + "-killed"), first.folder.name)
    mine = first.folder.with_name(first.folder.name + "-backup")
    mine.mkdir()
    again = cached()
    assert not again.cached and (again.folder / "flat").read_bytes() == whole and not leftover.exists()
    assert mine.is_dir()
    assert os.access(again.folder / "flat", os.X_OK) and cached().cached
    injected("damaged build")


def test_a_cache_that_is_a_file(cached, tmp_path, injected):
    (tmp_path / "cache").write_text("")
    with pytest.raises(builder.BuildError, match="Not a directory; RAYRACE_CACHE names another folder"):
        cached()
    Kept(tmp_path / "cache" / "references").put("k", FACTS, {})
    assert Kept(tmp_path / "cache" / "references").get("k") is None
    injected("cache that is a file")


def test_a_folder_in_place_of_a_build_stays(cached, injected):
    """It is not removed, and the message says what to do."""
    first = cached()
    (first.folder / ownership.MARKER).unlink()
    (first.folder / "flat").write_text("mine")
    with pytest.raises(builder.BuildError, match="is no build that rayrace can use or remove; remove it, or set"):
        cached()
    assert (first.folder / "flat").read_text() == "mine"
    injected("damaged build")


@pytest.mark.slow
def test_a_run_without_a_cache_has_rows_with_the_reason(rayrace, tmp_path, injected):
    file, words = faulty.tiny(tmp_path / "tiny", processes=1)
    (tmp_path / "cache").write_text("")
    rayrace("run", file, "--out", tmp_path / "run", *words, env={"RAYRACE_CACHE": str(tmp_path / "cache")}, code=1)
    records = store.read(tmp_path / "run")[1]
    assert {record["status"] for record in records} == {"failed"}
    assert all("its build failed" in record["reason"] and "RAYRACE_CACHE" in record["reason"] for record in records)
    injected("cache that is a file")


@pytest.mark.slow
def test_a_read_only_cache(rayrace, tmp_path, injected):
    """What is in it is used: builds, and the reference."""
    place, file_and_words = tmp_path / "cache", faulty.tiny(tmp_path / "tiny", processes=1)
    file, words = file_and_words
    place.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "tmpfs", place], capture_output=True).returncode:
        pytest.skip("no permission to mount")
    try:
        cache = {"RAYRACE_CACHE": str(place)}
        rayrace("run", file, "--out", tmp_path / "first", *words, env=cache, code=0)
        subprocess.run(["mount", "-o", "remount,ro", place], check=True)
        rayrace("run", file, "--out", tmp_path / "second", *words, env=cache, code=0)
        rayrace("run", file, "--out", tmp_path / "third", *words, "--set", "image.width=9", env=cache, code=0)
    finally:
        subprocess.run(["umount", "-l", place], check=True)
    for name in ("second", "third"):
        assert all("max_outside" in record["agreement"] for record in store.read(tmp_path / name)[1])
    injected("read-only cache", 2)


OLD, FUTURE, RECENT, NEW, NEWER = (digit * 16 for digit in "abcde")  # keys


def test_a_full_cache_and_a_clock_that_was_wrong(tmp_path, monkeypatch, injected):
    """Files of a time to come go first: they say nothing of when they were asked for. The newest stay."""
    monkeypatch.setattr(kept, "LIMIT", 5000)
    folder, array = Kept(tmp_path), {"a": np.zeros(100)}
    for name, hours in ((OLD, -48), (FUTURE, 24 * 365), (RECENT, -1)):
        folder.put(name, FACTS, array)
        then = time.time() + 3600 * hours
        os.utime(tmp_path / f"{name}.npz", (then, then))
    size = (tmp_path / f"{OLD}.npz").stat().st_size
    monkeypatch.setattr(kept, "LIMIT", 3 * size + 100)
    folder.put(NEW, FACTS, array)
    assert {path.stem for path in tmp_path.glob("*.npz")} == {OLD, RECENT, NEW}
    monkeypatch.setattr(kept, "LIMIT", 2 * size + 100)
    folder.put(NEWER, FACTS, array)
    assert {path.stem for path in tmp_path.glob("*.npz")} == {NEW, NEWER}
    injected("clock that was wrong")


def test_a_disk_that_is_full_keeps_nothing(tmp_path, monkeypatch, injected):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    monkeypatch.setattr(os, "rename", full)
    Kept(tmp_path).put("k", FACTS, {"a": np.zeros(3)})
    assert list(tmp_path.iterdir()) == []
    injected("full disk")
