"""A folder is proved to be rayrace's by its mark, its own identity and a process that has ended; else it stays."""

import json
import os
import random
import secrets
import shutil
import tempfile

import pytest
from left_behind import left_behind

from harness.process import scratch
from harness.system import ownership


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


@pytest.fixture
def left(place):
    return left_behind(place / f"rayrace-{secrets.token_hex(16)}")


def change(place, /, **told):
    mark = place / ownership.MARKER
    mark.write_text(json.dumps({**json.loads(mark.read_text()), **told}))


def test_what_a_killed_process_left_is_removed(place, left):
    assert scratch.doubtful() == {}
    scratch.remove_left()
    assert not left.exists() and not list(place.iterdir())


def test_what_is_at_work_stays(place):
    with scratch.scratch() as folder:
        scratch.remove_left()
        assert folder.is_dir() and scratch.doubtful() == {}
    assert not list(place.iterdir())


def process_id():
    """The number of a process that runs and is not the one that made the folder."""
    return os.getppid()


DOUBTS = {
    "no mark": lambda left: (left / ownership.MARKER).unlink(),
    "an empty mark": lambda left: (left / ownership.MARKER).write_text(""),
    "a damaged mark": lambda left: (left / ownership.MARKER).write_bytes(random.randbytes(200)),
    "a mark of a list": lambda left: (left / ownership.MARKER).write_text("[1]"),
    "a mark of another name": lambda left: change(left, name="rayrace-" + "0" * 32),
    "a mark of another folder": lambda left: change(left, folder=[1, 2]),
    "of another host": lambda left: change(left, host="elsewhere"),
    "of a system without boots": lambda left: change(left, boot=None),
    "of another container": lambda left: change(left, processes="pid:[1]"),
    "no number": lambda left: change(left, pid="1; rm"),
    "a folder for a mark": lambda left: ((left / ownership.MARKER).unlink(), (left / ownership.MARKER).mkdir()),
    "a file more": lambda left: (left / "mine.txt").write_text("mine"),
    "a second name of the mark": lambda left: os.link(left / ownership.MARKER, left.parent / "second"),
}  # fmt: skip


@pytest.mark.parametrize("doubt", DOUBTS)
def test_in_doubt_it_stays_and_is_named(place, left, doubt):
    DOUBTS[doubt](left)
    scratch.remove_left()
    assert (left / "files" / "a").read_text() == "left"
    assert list(scratch.doubtful()) == [left], scratch.doubtful()


def test_a_copy_stays(place, left):
    """With the mark of the original, also under its name after the original is gone."""
    shutil.copytree(left, place / "copy")
    scratch.remove_left()
    os.rename(place / "copy", left)
    scratch.remove_left()
    assert (left / "files" / "a").read_text() == "left" and list(scratch.doubtful()) == [left]


def test_a_link_stays(place, left):
    os.rename(left, place / "elsewhere")
    left.symlink_to(place / "elsewhere")
    (left.parent / f"rayrace-{'1' * 32}").symlink_to("/")
    scratch.remove_left()
    assert (place / "elsewhere" / "files" / "a").exists() and left.is_symlink()


def test_a_mark_that_is_a_link_stays(place, left):
    mark = left / ownership.MARKER
    os.rename(mark, place / "mark")
    mark.symlink_to(place / "mark")
    scratch.remove_left()
    assert (left / "files" / "a").exists() and list(scratch.doubtful()) == [left]


def test_a_process_of_the_same_number_that_runs(place, left):
    """The number was given to another process: the one that made the folder has ended."""
    change(left, pid=process_id())
    scratch.remove_left()
    assert not left.exists()


def test_a_boot_that_is_over(place, left):
    change(left, boot="of another day", pid=process_id())
    scratch.remove_left()
    assert not left.exists()


def test_a_process_that_runs_without_the_lock(place, left):
    """As on a file system without locks: the number and the start of the process are enough."""
    change(left, pid=os.getpid(), started=ownership._started("self"))
    scratch.remove_left()
    assert (left / "files" / "a").exists() and scratch.doubtful() == {}


@pytest.mark.parametrize("name", ["rayrace-main", "rayrace-results", "rayrace-", f"rayrace-{'a' * 32}x", "rayrace"])
def test_other_names_are_not_looked_at(place, left, name):
    os.rename(left, place / name)
    change(place / name, name=name)
    scratch.remove_left()
    assert (place / name / "files" / "a").exists() and scratch.doubtful() == {}


def test_folders_of_version_0_1_are_named(place):
    for name in ("rayrace-0123456789abcdef", "rayrace-caches-0123456789abcdef"):
        (place / name).mkdir()
    scratch.remove_left()
    assert len(scratch.doubtful()) == 2 == len(list(place.iterdir()))


def test_a_foreign_folder_of_the_same_name_is_not_removed(place, monkeypatch):
    monkeypatch.setattr(secrets, "token_hex", lambda count: "ab" * count)
    mine = place / f"rayrace-{'ab' * 16}"
    mine.mkdir()
    (mine / "mine.txt").write_text("mine")
    with pytest.raises(FileExistsError), scratch.scratch():
        pass
    assert (mine / "mine.txt").read_text() == "mine"


def test_folders_that_stay(tmp_path):
    """Of the cache: whether they were made by rayrace, while the process that made them runs too."""
    ownership.make(tmp_path / "a" / "b")
    assert ownership.is_ours(tmp_path / "a" / "b") and not ownership.is_ours(tmp_path / "a")
    (tmp_path / "mine").mkdir()
    ownership.make(tmp_path / "mine")
    assert not ownership.is_ours(tmp_path / "mine") and not list((tmp_path / "mine").iterdir())
