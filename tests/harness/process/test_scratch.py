"""A folder is removed whatever is in it; what links in it lead to is not."""

import itertools
import os
import sys
import tempfile

import pytest

from harness.process.scratch import remove, scratch


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_folders_nested_deeper_than_python_recurses(here):
    with scratch() as folder:
        back = os.getcwd()
        os.chdir(folder)
        for level in range(1100):
            open("file", "w").close()
            os.mkdir("rayrace-0" if level % 2 else "d")
            os.chdir("rayrace-0" if level % 2 else "d")
        os.chdir(back)
    assert list(here.iterdir()) == []


def test_folders_that_may_not_be_entered(here):
    with scratch() as folder:
        (folder / "a" / "b").mkdir(parents=True)
        (folder / "a" / "b" / "file").touch()
        for path in (folder / "a" / "b", folder / "a", folder):
            path.chmod(0)
    assert list(here.iterdir()) == []


def test_links_are_not_followed(here):
    (here / "kept").mkdir()
    (here / "kept" / "file").touch()
    with scratch() as folder:
        (folder / "link").symlink_to(here / "kept")
        os.mkfifo(folder / "pipe")
    with scratch() as folder:
        folder.rmdir()
        folder.symlink_to(here / "kept")
    with scratch() as folder:
        folder.rmdir()
    assert [path.name for path in here.rglob("*")] == ["kept", "file"]


def test_a_file(here):
    (here / "file").touch()
    remove(here / "file")
    assert list(here.iterdir()) == []


class Signal(BaseException):
    """What a handler raises."""


def once_at(instant):
    """A profiler that raises a Signal where Python would let a handler run: a function begins, one of C has ended."""
    count = 0

    def profile(frame, event, what):
        nonlocal count
        if event in ("call", "c_return", "c_exception"):
            count += 1
            if count == instant:
                raise Signal

    return profile


def test_a_signal_at_any_instant_leaves_nothing(here):
    for instant in itertools.count(1):
        heard = False
        sys.setprofile(once_at(instant))
        try:
            with scratch() as folder:
                (folder / "a").mkdir()
                (folder / "a" / "b").write_text("c")
        except Signal:
            heard = True
        finally:
            sys.setprofile(None)
        assert not list(here.iterdir()), f"a signal at instant {instant}"
        if not heard:
            break
    assert instant > 100
    print("instants:", instant)
