"""What disturbs a repetition is seen in the system's counters and attached to its row."""

import os
import subprocess
import sys
import time

import competing
import pytest

from harness.system import trouble

pytestmark = pytest.mark.alone

HERTZ = os.sysconf("SC_CLK_TCK")


@pytest.fixture
def system(tmp_path, monkeypatch):
    """system(steal=..): files of a system with these counters, of which two cores of three may be used; system.folder
    is its root."""

    monkeypatch.setattr(trouble, "usable", lambda: {0, 1})

    def write(steal=0.0, busy=0.0, waited=0.0, swapped=0, throttled=0, held_back=0.0, foreign=0.0):
        def put(name, text):
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)

        ticks = [int(busy * HERTZ), 0, 0, 555, 66, 0, 0, int(steal * HERTZ), 0, 0]
        elsewhere = [int(foreign * HERTZ)] * 10
        lines = [f"cpu{n} {' '.join(map(str, t))}" for n, t in ((0, ticks), (1, [0] * 10), (2, elsewhere))]
        put("proc/stat", "\n".join(["cpu  9 9 9", *lines, "intr 5"]) + "\n")
        put("proc/pressure/cpu", f"some avg10=0.00 avg60=0.00 avg300=0.00 total={int(waited * 1e6)}\nfull total=0\n")
        put("proc/vmstat", f"nr_free_pages 5\npswpin {swapped}\npswpout 7\n")
        put("sys/fs/cgroup/cgroup.controllers", "cpu memory\n")
        put("sys/fs/cgroup/cpu.stat", f"usage_usec 5\nnr_throttled 3\nthrottled_usec {int(held_back * 1e6)}\n")
        for core in (0, 1):
            put(f"sys/devices/system/cpu/cpu{core}/thermal_throttle/core_throttle_count", f"{throttled * core}\n")
        return trouble.look(tmp_path)

    write.folder = tmp_path
    return write


QUIET = {"steal_s": 0, "other_cpu_s": 0, "waited_s": 0, "swapped_pages": 0, "held_back_s": 0, "throttled": 0}


@pytest.mark.parametrize(
    ("change", "name", "value", "doubtful"),
    [
        ({"steal": 0.5}, "steal_s", 0.5, True),
        ({"steal": 0.05}, "steal_s", 0.05, False),
        ({"busy": 3.0}, "other_cpu_s", 3.0, True),
        ({"waited": 4.0}, "waited_s", 4.0, False),
        ({"swapped": 3}, "swapped_pages", 3, True),
        ({"throttled": 2}, "throttled", 2, True),
        ({"held_back": 0.01}, "held_back_s", 0.01, True),
        ({}, "steal_s", 0, False),
    ],
)
def test_each_counter(system, change, name, value, doubtful):
    before = system()
    found = trouble.between(before, {**system(**change), "own_s": before["own_s"]})
    assert found == {**QUIET, name: pytest.approx(value)}
    assert trouble.doubts(found, 2.0, threads=2, cores=2) == ([trouble.DOUBTS[name]] if doubtful else [])


def test_its_own_work_is_not_another_s(system):
    before = system()
    found = trouble.between(before, {**system(busy=3.0), "own_s": before["own_s"] + 2.96})
    assert found["other_cpu_s"] == pytest.approx(0.04) and not trouble.doubts(found, 2.0, threads=2, cores=2)


def test_a_long_repetition_bears_more(system):
    found = trouble.between(system(), system(steal=1.0))
    assert trouble.doubts(found, 10.0, threads=2) and not trouble.doubts(found, 30.0, threads=2)


@pytest.mark.parametrize(
    ("others", "threads", "cores", "doubtful"),
    [
        (2.0, 1, 2, False),  # a busy program has the other core
        (2.3, 1, 2, True),  # and takes of this one
        (2.3, 1, 4, False),
        (0.05, 2, 2, False),
        (0.2, 2, 2, True),  # no core is free
        (0.2, 8, 2, True),
    ],
)
def test_others_disturb_where_they_leave_too_few_cores(system, others, threads, cores, doubtful):
    """Over 2 s."""
    found = trouble.between({**system(), "own_s": 0}, {**system(busy=others + 1.0), "own_s": 1.0})
    assert trouble.doubts(found, 2.0, threads, cores) == [trouble.DOUBTS["other_cpu_s"]] * doubtful


@pytest.mark.parametrize(
    ("used", "threads", "cores", "doubtful"),
    [(0.05, 2, 2, False), (0.2, 2, 2, True), (2.0, 1, 2, False), (2.2, 1, 2, True)],
)
def test_the_measurer_disturbs_as_others_do(used, threads, cores, doubtful):
    """Over 2 s."""
    found = {**QUIET, "measurer_s": used}
    assert trouble.doubts(found, 2.0, threads, cores) == [trouble.DOUBTS["measurer_s"]] * doubtful
    assert trouble.doubts({**QUIET, "measurer_s": {"unavailable": "it was killed"}}, 2.0, threads, cores) == []


def test_cores_that_it_may_not_use_do_not_count(system):
    found = trouble.between({**system(), "own_s": 0}, {**system(foreign=2.0), "own_s": 0})
    assert found["other_cpu_s"] == 0


def test_two_threads_of_a_core_are_one_core(system):
    assert trouble.physical(system.folder) == 2  # it is not told
    for number in (0, 1):
        place = system.folder / f"sys/devices/system/cpu/cpu{number}/topology"
        place.mkdir(parents=True)
        (place / "thread_siblings_list").write_text("0-1\n")
    assert trouble.physical(system.folder) == 1


def test_what_is_not_told_has_its_reason(system):
    before = system()
    for name in ("proc/stat", "proc/pressure/cpu", "proc/vmstat"):
        (system.folder / name).unlink()
    found = trouble.between(before, trouble.look(system.folder))
    for name in ("steal_s", "other_cpu_s", "waited_s", "swapped_pages"):
        assert "No such file" in found[name]["unavailable"]
    (system.folder / "proc/stat").write_text("nonsense\n")
    assert "not as expected" in trouble.look(system.folder)["steal_s"]
    assert trouble.doubts(found, 1.0, threads=1) == []
    nothing = trouble.look(system.folder / "nowhere")
    assert nothing["throttled"] == "the system counts none"
    assert nothing["held_back_s"] == "no control group counts it"


def test_a_load_beside_is_seen_and_its_own_is_not():
    """With the real counters: a busy loop of another program, that is not waited for meanwhile."""
    if isinstance(trouble.look()["busy_s"], str):
        pytest.skip(trouble.look()["busy_s"])
    spin = "import time\nend = time.monotonic() + 1.5\nwhile time.monotonic() < end: pass"
    before = trouble.look()
    other = subprocess.Popen([sys.executable, "-c", spin])
    time.sleep(1.0)
    found = trouble.between(before, trouble.look())
    other.wait()
    assert found["other_cpu_s"] > 0.3
    assert trouble.DOUBTS["other_cpu_s"] in trouble.doubts(found, 1.0, threads=trouble.physical())


def test_it_is_in_the_row(rayrace, experiment, rows, tmp_path):
    rayrace("run", experiment(["python"]), "--out", tmp_path / "run", code=0)
    (row,) = rows(tmp_path / "run")["python"]
    assert set(row["disturbed"]) == {*QUIET, "measurer_s"}
    assert row["disturbed"]["measurer_s"] == row["measurer"]["cpu_s"] > 0


def test_a_row_that_was_disturbed_says_so(rayrace, experiment, rows, tmp_path):
    """Two busy programs for each core leave a thread at most a part of one.

    Each has a session of its own: the scheduler may give a session with one thread as much time as one with many
    (sched(7), autogrouping), and a renderer that is left a whole core is rightly not called disturbed.
    """
    file = experiment(["python"], size=90, frames=3)
    busy = [sys.executable, "-c", "while True: pass"]
    others = [subprocess.Popen(busy, start_new_session=True) for _ in range(2) for _ in trouble.usable()]
    try:
        rayrace("run", file, "--out", tmp_path / "run", code=0)
    finally:
        for other in others:
            other.kill()
            other.wait()
    (row,) = rows(tmp_path / "run")["python"]
    if "unavailable" not in str(row["disturbed"]["other_cpu_s"]):
        assert trouble.DOUBTS["other_cpu_s"] in row["warnings"]


def test_of_renderers_beside_a_busy_program_doubts_are_rarer_where_results_hold_and_there_where_not():
    """As recorded: the table in docs/measuring-well.md."""
    lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in competing.table()][2:]
    beside = {(where, threads): counts for where, threads, _, _, *counts in lines if "or more" in where}
    for was, now, _, missed in beside.values():
        assert missed.startswith("0 of ") and int(now.split()[0]) <= int(was.split()[0])
    was, now, *_ = beside["on the other core, a quarter of the time or more", "1"]
    assert was == "10 of 10" and int(now.split()[0]) <= 3
    text = (competing.ROOT / "docs/measuring-well.md").read_text(encoding="utf-8")
    assert all(line in text for line in competing.table()), "tests/support/competing.py prints the table"
