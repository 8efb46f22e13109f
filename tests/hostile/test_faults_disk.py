"""The disk under a run: full, read-only, gone, or with something else where a file should be."""

import json
import os
import shutil
import subprocess
import sys
import time

import faulty
import pytest

from harness.errors import UserError
from harness.store import alone, store

COMPILES = r"""
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
int main(int argc, char** argv)
{
    char cache[4000] = ".", words[9000];
    for (int n = 1; n < argc; n++)
        if (!strncmp(argv[n], "--cache=", 8))
            strcpy(cache, argv[n] + 8);
    sprintf(words, "echo 'int one;' | cc -shared -x c - -o %s/one.so", cache);
    strcat(cache, "/one.so");
    if (system(words) || !dlopen(cache, RTLD_NOW)) {
        fprintf(stderr, "%s\n", dlerror());
        return 1;
    }
    return 0;
}
"""


@pytest.fixture
def disk(tmp_path):
    """disk(kilobytes): an empty file system of that size, mounted at a folder; remount(folder, options)."""
    mounted = []

    def mount(kilobytes):
        place = tmp_path / f"disk{len(mounted)}"
        place.mkdir()
        options = ["-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs"]
        if subprocess.run(["mount", *options, place], capture_output=True).returncode:
            pytest.skip("no permission to mount")
        mounted.append(place)
        return place

    yield mount
    for place in mounted:
        subprocess.run(["umount", "-l", place], check=True)


def remount(place, options):
    subprocess.run(["mount", "-o", f"remount,{options}", place], check=True)


def count(folder):
    return len(store.read(folder)[1])


def assert_said(done, *texts):
    """One line on standard error says what happened and what to do; nobody sees a traceback (the fixture looks)."""
    last = done.stderr.splitlines()[-1]
    assert last.startswith("error: ") and all(text in last for text in texts), done.stderr


@pytest.mark.slow
def test_a_full_disk(rayrace, disk, tmp_path, injected):
    """It fills up in mid-run; with room again the run is completed, and each row that was there is still the same."""
    file, words = faulty.tiny(tmp_path / "tiny", processes=6)
    folder, lost = disk(240) / "run", 0
    done = rayrace("run", file, "--out", folder, *words, code=2)
    assert_said(done, "No space left on device", f"repetitions are kept in {folder}", f"--resume {folder}")
    before = (folder / "repetitions.jsonl").read_bytes()
    whole = before[: before.rfind(b"\n") + 1]
    assert 0 < whole.count(b"\n") < 18 and not list(folder.rglob("*.part"))
    assert count(folder) == whole.count(b"\n")
    again = rayrace("run", file, "--resume", folder, *words)
    if again.returncode:  # still full: the same words
        assert_said(again, "No space left on device", "--resume")
    remount(folder.parent, "size=20m")
    rayrace("run", file, "--resume", folder, *words, code=0)
    after = (folder / "repetitions.jsonl").read_bytes()
    assert after.startswith(whole)
    assert all(record["status"] == "ok" for record in store.read(folder)[1])
    injected("full disk")
    print(f"full disk: after {whole.count(bytes([10]))} of {after.count(bytes([10]))} repetitions; lost: {lost}")


@pytest.mark.slow
def test_a_full_disk_for_temporary_files(rayrace, disk, tmp_path, injected):
    """No renderer is blamed for it: none is started, and no row says that it failed."""
    file, words = faulty.tiny(tmp_path / "tiny", processes=2)
    temporary, folder = disk(1500), tmp_path / "run"
    (temporary / "filler").write_bytes(bytes(900 * 1024))
    done = rayrace("run", file, "--out", folder, *words, env={"TMPDIR": str(temporary)}, code=2)
    assert_said(done, str(temporary), "No space left on device", f"--resume {folder}")
    assert count(folder) == 0
    (temporary / "filler").unlink()
    rayrace("run", file, "--resume", folder, *words, env={"TMPDIR": str(temporary)}, code=0)
    assert {record["status"] for record in store.read(folder)[1]} == {"ok"}
    assert not list(temporary.iterdir())
    injected("full disk")


@pytest.mark.parametrize("barred", ["RAYRACE_CACHE", "TMPDIR"])
def test_a_disk_that_runs_no_programs(barred, rayrace, disk, tmp_path):
    """As a cache on a disk that is mounted with noexec: the row says which, and what to do. A library too."""
    file, words = faulty.tiny(tmp_path / "tiny", processes=1)
    place = disk(20000)
    remount(place, "noexec")
    env = {"RAYRACE_CACHE": str(tmp_path / "cache"), barred: str(place)}
    if barred == "TMPDIR":  # a renderer that compiles a library into its cache
        (tmp_path / "tiny" / "flat" / "flat.c").write_text(COMPILES)
    rayrace("run", file, "--out", tmp_path / "run", *words, "--set", "renderers=['flat']", env=env, code=1)
    reasons = [record["reason"] for record in store.read(tmp_path / "run")[1]]
    remedy = f"runs no programs (noexec): set {barred} to a folder of another"
    assert reasons and all(reason.endswith(remedy) and str(place) in reason for reason in reasons), reasons


@pytest.mark.slow
def test_a_read_only_disk(rayrace, disk, tmp_path, injected):
    """No run begins or goes on there; one that is there can be read."""
    file, words = faulty.tiny(tmp_path / "tiny")
    place = disk(20000)
    rayrace("run", file, "--out", place / "there", *words, "--set", "processes=1", code=0)
    remount(place, "ro")
    assert_said(
        rayrace("run", file, "--out", place / "run", *words, code=2), str(place / "run"), "Read-only file system"
    )
    there = place / "there"
    assert_said(rayrace("run", file, "--resume", there, *words, code=2), "Read-only file system", f"--resume {there}")
    rayrace("compare", there, there, code=0)
    rayrace("export", there, "--format", "github", code=0)
    remount(place, "rw")
    rayrace("run", file, "--resume", there, *words, code=0)
    assert count(there) == 4
    injected("read-only disk", 2)


def test_a_file_where_a_folder_should_be(rayrace, tmp_path, injected):
    """What a read-only folder is to those who are root."""
    file, words = faulty.tiny(tmp_path / "tiny")
    (tmp_path / "results").write_text("")
    assert_said(rayrace("run", file, *words, cwd=tmp_path, code=2), "results", "Not a directory")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "pictures").write_text("")
    assert_said(rayrace("run", file, "--resume", tmp_path / "run", *words, code=2), "run/pictures: not a folder")
    assert "no such folder" in rayrace("run", file, "--resume", tmp_path / "none", *words, code=2).stderr
    assert not (tmp_path / "none").exists()
    injected("file for a folder", 2)


# What another hand does to the folder after the first row; and what is said.
HANDS = {
    "deleted": (lambda folder: shutil.rmtree(folder, ignore_errors=True), "is gone, and what had finished with it"),
    "rows deleted": (lambda folder: (folder / "repetitions.jsonl").unlink(), "it was deleted during the run"),
    "series deleted": (lambda folder: shutil.rmtree(folder / "series"), None),
    "logs deleted": (lambda folder: shutil.rmtree(folder / "logs"), "--resume"),
    "moved": (lambda folder: folder.rename(folder.with_name("elsewhere")), "is gone"),
}


@pytest.mark.slow
@pytest.mark.parametrize("hand", HANDS)
def test_another_hand_in_the_folder(rayrace, environment, tmp_path, hand, injected):
    file, words = faulty.tiny(tmp_path / "tiny", processes=40)
    folder = tmp_path / "run"
    started = subprocess.Popen(
        [faulty.PROGRAM, "run", file, "--out", folder, *words], env=environment, stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    rows = folder / "repetitions.jsonl"
    faulty.wait_until(lambda: rows.exists() and rows.read_bytes().count(b"\n") >= 1)
    act, message = HANDS[hand]
    act(folder)
    if message is None:  # it goes on
        faulty.wait_until(lambda: rows.read_bytes().count(b"\n") >= 6)
        started.terminate()
        _, said = started.communicate(timeout=60)
        late = store.read(folder)[1][5]
        assert late["status"] == "ok" and "measurer: " in said and late["series"] is late["measurer"] is None
    else:
        _, said = started.communicate(timeout=60)
        assert started.returncode == 2 and message in said.splitlines()[-1], said
    assert "Traceback" not in said
    injected("folder changed by another hand")
    if hand in ("logs deleted", "series deleted", "moved"):
        there = folder.with_name("elsewhere") if hand == "moved" else folder
        before = count(there)
        assert before
        rayrace("run", file, "--resume", there, *words, "--set", f"processes={before + 1}", code=0)
        assert count(there) > before
    assert not faulty.processes_of(tmp_path / "run", tmp_path / "tiny" / "flat")


@pytest.mark.slow
def test_a_log_that_cannot_be_written(rayrace, tmp_path, injected):
    file, words = faulty.tiny(tmp_path / "tiny", processes=1)
    rayrace("run", file, "--out", tmp_path / "run", *words, code=0)
    first = json.loads((tmp_path / "run" / "repetitions.jsonl").read_text().splitlines()[0])["cell"]
    (tmp_path / "run" / "logs" / f"{first}-1.stdout").mkdir()
    words = [*words, "--set", "processes=2"]
    done = rayrace("run", file, "--resume", tmp_path / "run", *words, code=2)
    assert_said(done, f"{first}-1.stdout: Is a directory", "--resume")
    (tmp_path / "run" / "logs" / f"{first}-1.stdout").rmdir()
    rayrace("run", file, "--resume", tmp_path / "run", *words, code=0)
    injected("log that cannot be written")


@pytest.mark.slow
def test_two_at_once_on_one_run(rayrace, environment, tmp_path, injected):
    """The second is told so at once, and touches nothing; also a second --resume."""
    file, words = faulty.tiny(tmp_path / "tiny", processes=400)
    folder = tmp_path / "run"
    first = subprocess.Popen(
        [faulty.PROGRAM, "run", file, "--out", folder, *words], env=environment,
        stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    rows = folder / "repetitions.jsonl"
    faulty.wait_until(lambda: rows.exists() and rows.read_bytes().count(b"\n") >= 2)
    start = time.monotonic()
    for lock in ({}, {"RAYRACE_LOCK": "-another"}):  # also where the lock of measuring is another
        done = rayrace("run", file, "--resume", folder, *words, env=lock, code=2)
        assert_said(done, "another rayrace is at work on this run", f"rayrace status {folder}")
        assert "waiting" not in done.stderr
    assert time.monotonic() - start < 150 and first.poll() is None
    rayrace("status", folder, code=0)
    first.terminate()
    first.wait()
    before = count(folder)  # of two variants and the A/A pair
    rayrace("run", file, "--resume", folder, *words, "--set", f"processes={before // 3 + 2}", code=0)
    found = [faulty.store_key(record) for record in store.read(folder)[1]]
    assert len(found) == len(set(found)) > before
    injected("second process on a run", 2)


def test_the_lock_ends_with_who_holds_it(tmp_path):
    with (
        alone.only_one(tmp_path),
        pytest.raises(UserError, match="another rayrace is at work"),
        alone.only_one(tmp_path),
    ):
        pass
    with alone.only_one(tmp_path):
        pass
    holder = subprocess.Popen(
        [sys.executable, "-c", f"from pathlib import Path; from harness.store import alone; import os, signal\n"
         f"with alone.only_one(Path({str(tmp_path)!r})): os.kill(os.getpid(), signal.SIGKILL)"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip
    holder.wait()
    with alone.only_one(tmp_path):
        pass
