"""CPU time and peak memory of families: children, orphans, lives shorter than a tick; from a harness of any size."""

import json
import os
import secrets
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from harness.process.family import Family
from harness.process.launcher import MemoryFiles
from harness.process.process import Outcome
from harness.race import row
from harness.renderer import builder, events

pytestmark = pytest.mark.alone

MB = 10**6
SOURCE = Path(__file__).with_name("family.c")
HARNESS = """
import json, sys
from pathlib import Path
ballast = b"x" * int(sys.argv[1])
from harness.process import process
from harness.race import row
from harness.renderer import events
from harness.system import trouble
here, found = Path(sys.argv[2]), {}
(here / "neutral").mkdir(parents=True)
for mode in sys.argv[4:]:
    series, before = here / "series.csv", trouble.look()
    outcome = process.run([sys.argv[3], mode], here / "neutral", here / "out", here / "err", 60, series)
    assert outcome.code == 0, (here / "err").read_text()
    cpu, stolen = row.cpu(outcome, series), trouble.between(before, trouble.look())["steal_s"]
    found[mode] = {"cpu": cpu, "memory": row.memory(events.Said(), outcome), "doubt": row.cpu_doubt(cpu, outcome),
                   "wall_s": outcome.wall_s, "audit": outcome.measurer, "said": (here / "out").read_text(),
                   "stolen": stolen if isinstance(stolen, float) else 0.0}
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    compiler = builder.find_compiler("c")
    if compiler is None:
        pytest.skip(builder.MISSING["c"])
    built = tmp_path_factory.mktemp("families") / "family"
    subprocess.run([compiler, "-O1", "-fno-builtin", str(SOURCE), "-o", str(built)], check=True)
    return built


@pytest.fixture
def families(program, tmp_path):
    """families(*modes): what was found of these modes of family.c, by a harness that holds nothing and by one that
    holds 300 MB."""

    def measure(ballast, modes):
        command = [sys.executable, "-c", HARNESS, str(ballast), tmp_path / str(ballast), program, *modes]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return lambda *modes: [measure(ballast, modes) for ballast in (0, 300 * MB)]


def used(found):
    return found["cpu"]["user_s"] + found["cpu"]["system_s"]


@pytest.mark.parametrize(
    ("mode", "seconds", "orphans"),
    [("short", 0.005, 0), ("waits", 0.3, 0), ("does not wait", 0.3, 1), ("orphan", 0.3, 2), ("between ticks", 0.15, 0)],
)
def test_cpu_time(families, mode, seconds, orphans):
    """To the room that starting, touching 120 MB and the ticks of the dead take; wait4 and the series agree.

    What the host of a virtual machine takes away is charged to who runs just then.
    """
    for found in (family[mode] for family in families(mode)):
        print(found)
        memory = 0.15 if "wait" in mode or mode == "orphan" else 0.02
        assert seconds <= used(found) <= 1.1 * seconds + memory + found["stolen"]
        assert abs(found["cpu"]["series_s"] - used(found)) <= max(found["audit"]["resolution_s"], 0.1 * used(found))
        assert found["audit"]["saw_end"] and found["doubt"] is None
        if sys.platform == "linux":
            assert found["cpu"]["orphans"] == orphans
            expected = 0 if not orphans else used(found)
            assert found["cpu"]["orphans_s"] == pytest.approx(expected, abs=0.01 + found["stolen"])


def test_a_daemon_ends_with_the_renderer(families):
    """One in a session of its own, that would burn for a minute."""
    for found in (family["leaves"] for family in families("leaves")):
        assert found["wall_s"] < 10 and 0.1 < used(found) < 10 and found["cpu"]["orphans"] == 1
        assert found["cpu"]["series_s"] == pytest.approx(used(found), abs=0.01)
        until = time.monotonic() + 10
        while psutil.pid_exists(int(found["said"])) and time.monotonic() < until:
            time.sleep(0.01)
        assert not psutil.pid_exists(int(found["said"]))


@pytest.mark.skipif(not os.path.exists("/proc/self/smaps_rollup"), reason="no smaps_rollup here")
def test_peak_of_a_family(families):
    """Besides what they hold: the program and the C library, of which PSS leaves a part to other programs."""
    found = families("holds", "waits", "orphan")
    for mode, truth, methods in (("holds", 100, {"wait4"}), ("waits", 140, {"PSS"}), ("orphan", 120, {"wait4", "PSS"})):
        for memory in (family[mode]["memory"] for family in found):
            print(mode, memory)
            assert truth * MB <= memory["peak_bytes"] <= (truth + 2) * MB
            assert memory["method"] in methods and memory["at_least_bytes"] is None


FORKS = """
import os, random, sys, time
held = bytearray(b"x") * (100 * 10**6)
random.seed(int(sys.argv[1]))
end = time.monotonic() + 1.5
while time.monotonic() < end:
    for _ in range(4):
        if os.fork() == 0:
            time.sleep(random.uniform(0.01, 0.1))
            os._exit(0)
    for _ in range(4):
        os.wait()
"""


@pytest.mark.skipif(not os.path.exists("/proc/self/smaps_rollup"), reason="no smaps_rollup here")
def test_pages_of_who_ends_meanwhile_count_once(monkeypatch):
    """A family that shares 100 MB, and whose children begin and end while it is looked at, never has more."""
    seed, sums = int.from_bytes(os.urandom(2)), []
    print(f"seed {seed}")
    monkeypatch.setattr("harness.process.family.PSS_SHARE", 0.9)
    for number in range(3):
        root = subprocess.Popen([sys.executable, "-S", "-c", FORKS, str(seed + number)])
        watched = Family(root.pid, root.pid)
        while root.poll() is None:
            sample = watched.sample(time.monotonic())
            sums += [sample.pss] if sample and sample.pss else []
            time.sleep(0.005)
    print(len(sums), min(sums), max(sums))
    assert len(sums) > 10 and 95 * MB < max(sums) < 112 * MB  # and the interpreter, with what five of it change


@pytest.mark.skipif(not os.path.exists("/proc/self/smaps_rollup"), reason="no smaps_rollup here")
@pytest.mark.parametrize("kind", ["written", "mapped", "given to a child"])
def test_files_in_memory_count(kind):
    """Once, whether they are mapped or not, and by however many."""
    source = {
        "written": "",
        "mapped": "here = mmap.mmap(file, 0); here.read()\n",
        "given to a child": "here = mmap.mmap(file, 0); here.read(); os.fork(); here.seek(0); here.read()\n",
    }[kind]
    source = f"import mmap, os, time; file = os.memfd_create('f')\nos.write(file, b'x' * 50 * {MB})\n{source}"
    root = subprocess.Popen([sys.executable, "-S", "-c", f"{source}os.write(1, b'there'); time.sleep(60)"],
                            stdout=subprocess.PIPE, start_new_session=True)  # fmt: skip
    try:
        assert root.stdout.read(5) == b"there"
        time.sleep(0.3)
        watched = Family(root.pid, root.pid)
        sample = watched.sample(time.monotonic())
        print(sample, watched.files_peak)
        assert 50 * MB <= watched.files_peak <= 51 * MB and 53 * MB <= sample.pss == watched.pss <= 66 * MB
    finally:
        os.killpg(root.pid, signal.SIGKILL)
        root.communicate()


@pytest.mark.skipif(not os.access("/dev/shm", os.W_OK), reason="no /dev/shm here")
@pytest.mark.parametrize(("kind", "most"), [("open", 50), ("closed", 50), ("removed", 0), ("of others", 0)])
def test_files_in_dev_shm_count_where_the_family_made_them(kind, most):
    """While they are there, closed or not; not what was there before and did not change."""
    path = Path(f"/dev/shm/rayrace-test-{secrets.token_hex(8)}")
    if kind == "of others":
        path.write_bytes(b"x" * 50 * MB)
        time.sleep(0.05)  # a file has the time of the last tick
    try:
        files = MemoryFiles()
        with open(path, "rb" if kind == "of others" else "wb") as file:
            if kind != "of others":
                file.write(b"x" * 50 * MB)
                file.flush()
            opened = files.size([os.getpid()])
        if kind == "removed":
            path.unlink()
        found = opened if kind in ("open", "of others") else files.size([os.getpid()])
        assert most * MB <= found < (most + 1) * MB
    finally:
        path.unlink(missing_ok=True)


def test_below_the_floor_there_are_two_bounds(families):
    modes = "short", "between ticks"
    for memory in (family[mode]["memory"] for family in families(*modes) for mode in modes):
        assert memory["method"] == row.AT_MOST == "wait4 (at most)"
        assert 1 * MB < memory["peak_bytes"] <= memory["floor_bytes"] + 1 * MB < 20 * MB
        assert memory["at_least_bytes"] is None or 0 < memory["at_least_bytes"] < 4 * MB


def test_a_large_harness_changes_no_peak(families):
    modes = "short", "holds", "waits", "orphan"
    small, large = families(*modes)
    for mode in modes:
        peaks = [found[mode]["memory"]["peak_bytes"] for found in (small, large)]
        print(mode, peaks)
        assert abs(peaks[0] - peaks[1]) <= 1 * MB, mode


@pytest.mark.parametrize(
    ("own", "wait4", "pss", "peak", "method"),
    [
        (50, 49.5, None, 50, "VmHWM"),
        (50, 40, None, 40, "wait4"),  # it tells more than any of its processes had
        (10**9, 40, 60, 60, "PSS"),
        (10**9, 0, 60, 60, "PSS"),  # more than the machine has
        (50, 50.9, None, 50, "VmHWM"),  # the same mark, read at the exit
        (50, 80, None, 80, "wait4"),  # it grew after it had told, or a child was larger
        (50, 80, 120, 120, "PSS"),
        (50, 50, 45, 50, "VmHWM"),
        (None, 40, 30, 40, "wait4"),
        (None, 10.9, None, 10.9, row.AT_MOST),
        (None, 10.9, 2, 10.9, row.AT_MOST),
        (None, 10.9, 12, 12, "PSS"),
    ],
)
def test_the_method_that_knows_the_most(own, wait4, pss, peak, method):
    audit = {"mark_bytes": 3 * MB, "pss_peak_bytes": pss and pss * MB}
    outcome = Outcome(None, 0.0, 1.0, 0, None, False, 1.0, 0.0, wait4 * MB, 10 * MB, audit)
    said = events.Said(memory=own and {"peak_bytes": own * MB, "render_peak_bytes": 1, "method": "VmHWM"})
    found = row.memory(said, outcome)
    assert (found["peak_bytes"], found["method"]) == (peak * MB, method)
    possible = own is not None and own <= wait4 + 1
    assert (row.memory_doubt(said, outcome) is None) == (possible or own is None)
    audit |= {"files_peak_bytes": 1, "vms_peak_bytes": 7 * MB}
    assert row.memory(said, outcome)["method"] == ("PSS, with files in memory" if method == "PSS" else method)
    assert row.memory(said, outcome)["peak_virtual_bytes"] == 7 * MB
    assert found["at_least_bytes"] == (3 * MB if method == row.AT_MOST else None)
    assert found["floor_bytes"] == (10 * MB if "wait4" in method else None)
    assert found["render_peak_bytes"] == (1 if possible else None) and found["wait4_peak_bytes"] == wait4 * MB
