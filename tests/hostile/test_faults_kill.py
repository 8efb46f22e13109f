"""The harness ends at any instant, by kill -9 or by an error of the system: what had finished stays, and a resume
completes the run.

What a kill -9 leaves in the folder for temporary files is taken away by the next run. What it leaves in the cache: the
part of a reference that was being kept, which goes as others do when the cache is full, and the scratch folder of a
build, which goes when that is made again.
"""

import contextlib
import errno
import os
import random
import re
import shutil
import signal
import time

import faulty
import pytest

from harness.store import store

SEED = int(os.environ.get("RAYRACE_FUZZ_SEED", "20"))
ERRORS = "ENOSPC", "EIO", "EROFS", "EACCES", "EMFILE"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("faults")


@pytest.fixture(scope="module")
def machine(place, environment):
    """A Faulty with a folder of its own for temporary files."""
    (place / "tmp").mkdir()
    found = faulty.Faulty({**environment, "TMPDIR": str(place / "tmp")})
    yield found
    found.close()


@pytest.fixture(scope="module")
def tiny(place):
    return faulty.tiny(place)


@pytest.fixture(scope="module")
def undisturbed(machine, place, tiny):
    """(rows without their times, instants) of a run that nothing happens to; the second, which finds all built."""
    file, words = tiny
    for name in ("first", "undisturbed"):
        status, instants = machine.run(["run", file, "--out", place / name, *words], place / "said")
        assert status == 0, (place / "said").read_text()
    return rows(place / "undisturbed"), instants


def rows(folder):
    return {faulty.store_key(record): faulty.timeless(record, folder) for record in store.read(folder)[1]}


def begin(folder, tiny):
    """Words that begin a run in a folder, or go on with it."""
    file, words = tiny
    return ["run", file, "--resume" if folder.exists() else "--out", folder, *words]


def left_of(folder):
    """Rows that are there: whole, each once."""
    if not (folder / "run.json").exists():
        assert not folder.exists() or store.is_blank(folder)
        return {}
    found = [faulty.store_key(record) for record in store.read(folder)[1]]
    assert len(found) == len(set(found))
    return rows(folder)


def nothing_runs(place):
    faulty.wait_until(lambda: not faulty.processes_of(place / "tmp" / "rayrace-"), 20)


def complete(machine, place, folder, tiny, undisturbed):
    """Go on to the end: rows as if nothing had happened, and nothing left beside them."""
    status, _ = machine.run(begin(folder, tiny), place / "said")
    assert status == 0, (place / "said").read_text()
    assert rows(folder) == undisturbed[0]
    assert not list(folder.rglob("*.part"))
    for path in (place / "tmp").iterdir():  # an empty folder may be of a process that has just made it
        assert of_python(path) or not any(path.iterdir()), path


def of_python(path):
    """Whether a file is Python's, by which tempfile tries a folder: gone at once, unless it is killed there."""
    try:
        return bool(re.fullmatch("[a-z0-9_]{8}", path.name)) and path.read_bytes() in (b"", b"blat")
    except FileNotFoundError:
        return True
    except IsADirectoryError:
        return False


def kill_again_and_again(machine, place, tiny, undisturbed, kills):
    """At instants of the interpreter's, and of the clock's, each kill meeting what the one before it left."""
    rng = random.Random(SEED)
    print("seed", SEED)
    done, runs, began, seconds = 0, 0, {}, 2.0
    folder = None
    while done < kills:
        if folder is None:
            runs += 1
            folder, began = place / f"killed{kills}-{runs}", {}
        told = begin(folder, tiny)
        if done % 3 == 2:
            pid, start = machine.start(told, place / "said"), time.monotonic()
            time.sleep(rng.uniform(0, seconds))
            with contextlib.suppress(ProcessLookupError):  # it has ended
                os.kill(pid, signal.SIGKILL)
            status, _ = machine.wait()
            seconds = max(1.0, time.monotonic() - start) if status == 0 else seconds
        else:
            status, _ = machine.run(told, place / "said", at=rng.randrange(undisturbed[1]))
        assert status in (0, -signal.SIGKILL), (place / "said").read_text()
        nothing_runs(place)
        now = left_of(folder)
        assert began.items() <= now.items(), "a row is lost, or another one now"
        began = now
        if status == 0:  # it was quicker: a run that is complete is none to be killed
            assert now == undisturbed[0]
            folder = None
            continue
        done += 1
    if folder is not None:
        complete(machine, place, folder, tiny, undisturbed)
    print(f"kill -9: {done} times in {runs} runs; lost repetitions: 0, surviving processes: 0")
    return done


@pytest.mark.slow
def test_killed_at_any_instant(machine, place, tiny, undisturbed, injected):
    injected("kill -9", kill_again_and_again(machine, place, tiny, undisturbed, 15))


@pytest.mark.nightly("test_killed_at_any_instant has 15 kills by day")
def test_killed_at_300_instants(machine, place, tiny, undisturbed, injected):
    injected("kill -9", kill_again_and_again(machine, place, tiny, undisturbed, 300))


@pytest.mark.parametrize("instant", ["run.json.part", "pictures", "repetitions.jsonl", "truth", ".stdout", ".lock"])
def test_killed_as_it_writes(machine, place, tiny, undisturbed, injected, instant, tmp_path):
    """Just before the run describes itself, between a picture and its row, in the reference, as it takes the lock."""
    folder = place / f"at{instant}"
    status, _ = machine.run(begin(folder, tiny), place / "said", at=0, within=instant)
    assert status == -signal.SIGKILL
    nothing_runs(place)
    left_of(folder)
    complete(machine, place, folder, tiny, undisturbed)
    injected("kill -9")
    shutil.rmtree(folder)


def fail(machine, place, tiny, undisturbed, instants, lasting):
    """At each of these instants an error of the system, in a run of its own; how many."""
    rng = random.Random(SEED)
    ended = 0
    for number, at in enumerate(instants):
        folder, what = place / f"failed{number}{lasting}", rng.choice(ERRORS)
        status, _ = machine.run(begin(folder, tiny), place / "said", at=at, what=what, lasting=lasting)
        said = (place / "said").read_text()
        print(f"{what} at {at}{' and after' if lasting else ''}: {status} {said.splitlines()[-1] if said else ''}")
        assert "Traceback" not in said, said
        nothing_runs(place)
        before = left_of(folder)
        if status:
            ended += 1
            told = os.strerror(getattr(errno, what)), "could not", "No usable temporary directory"  # Python's own words
            assert any(words in said for words in told), said
            if "--resume" not in said:
                assert not before, said
        if all(row["status"] == "ok" for row in before.values()):
            complete(machine, place, folder, tiny, undisturbed)
            assert before.items() <= rows(folder).items()
        shutil.rmtree(folder, ignore_errors=True)
        for path in (place / "tmp").iterdir():
            shutil.rmtree(path, ignore_errors=True)  # an error as it is removed leaves it to the next run too
    print(f"errors of the system: {len(instants)}, {ended} ended the run; lost repetitions: 0")
    return len(instants)


@pytest.mark.slow
@pytest.mark.parametrize("lasting", [False, True])
def test_an_error_at_any_instant(machine, place, tiny, undisturbed, injected, lasting):
    some = random.Random(SEED + lasting).sample(range(undisturbed[1]), 8)
    injected("error of the system", fail(machine, place, tiny, undisturbed, some, lasting))


@pytest.mark.nightly("test_an_error_at_any_instant has 8 errors by day")
@pytest.mark.parametrize("lasting", [False, True])
def test_an_error_at_each_sixth_instant(machine, place, tiny, undisturbed, injected, lasting):
    some = range(3 * lasting, undisturbed[1], 6)
    injected("error of the system", fail(machine, place, tiny, undisturbed, some, lasting))
