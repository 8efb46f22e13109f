"""The launcher and the measurer as `process.run` uses them, with small programs in place of renderers."""

import itertools
import json
import os
import signal
import sys
import threading
import time

import pytest

from harness.process import process
from harness.race import row
from harness.system import gpu

pytestmark = pytest.mark.alone


@pytest.fixture
def run(tmp_path):
    """run(python source, watch=..) is the Outcome, and what the program printed."""

    def run(source, timeout=60, watch=None, interval=0.05, command=None):
        (tmp_path / "neutral").mkdir(exist_ok=True)
        out, err = tmp_path / "out", tmp_path / "err"
        command = command or [sys.executable, "-I", "-S", "-c", source]
        outcome = process.run(command, tmp_path / "neutral", out, err, timeout, watch, interval)
        return outcome, out.read_text() if out.exists() else ""

    return run


def test_exit_status(run):
    outcome, _ = run("import sys; sys.exit(17)")
    assert (outcome.failed, outcome.code, outcome.signal, outcome.timed_out) == (None, 17, None, False)


def test_signal(run):
    outcome, _ = run("import os; os.abort()")
    assert (outcome.code, outcome.signal, outcome.timed_out) == (None, signal.SIGABRT, False)


def test_times_are_on_the_monotonic_clock(run):
    before = time.monotonic()
    outcome, said = run("import time; print(time.monotonic()); time.sleep(0.2); print(time.monotonic())")
    first, last = map(float, said.split())
    assert before < outcome.spawned < first < last < outcome.exited < time.monotonic()
    assert outcome.wall_s >= 0.2


def test_surroundings(run, tmp_path, monkeypatch):
    monkeypatch.setenv("SOME_SECRET", "1")
    monkeypatch.setenv("LANG", "C.UTF-8")
    told = "os.getcwd(), dict(os.environ), sys.stdin.read(), os.getsid(0), os.getpid()"
    source = f"import json, os, sys; print(json.dumps([{told}]))"
    folder, environment, given, session, pid = json.loads(run(source)[1])
    assert folder == str(tmp_path / "neutral") and given == "" and session == pid
    assert environment["LANG"] == "C.UTF-8" and environment["CUDA_DEVICE_ORDER"] == "PCI_BUS_ID"
    assert set(environment) <= {*process.KEPT, "LC_CTYPE", "CUDA_DEVICE_ORDER"}


def test_no_descriptor_is_inherited(run):
    _, said = run("import os; print(sorted(map(int, os.listdir('/proc/self/fd'))))")
    assert json.loads(said)[:3] == [0, 1, 2] and len(json.loads(said)) == 4  # the fourth is of listdir


def test_timeout_is_kept_and_polite_first(run):
    source = "import signal, sys, time; signal.signal(signal.SIGTERM, lambda *_: sys.exit(5)); time.sleep(60)"
    outcome, _ = run(source, timeout=0.5)
    assert outcome.timed_out and outcome.code == 5 and 0.5 <= outcome.wall_s < 10


@pytest.mark.parametrize("timeout", [1e300, float("inf")])
def test_a_timeout_of_ages(run, timeout):
    assert run("", timeout=timeout)[0].code == 0


@pytest.mark.parametrize("words", [["no-such-program"], ["/etc/passwd"], ["/"], [""], ["a\0b"]])
def test_what_cannot_start(run, words):
    outcome, _ = run("", command=words)
    assert outcome.failed.startswith(f"could not start {words[0]}: ")


def test_launcher_that_is_killed_takes_the_renderer_with_it(run, tmp_path):
    pid = tmp_path / "pid"
    outcome, _ = run(
        f"import os, time; open({str(pid)!r}, 'w').write(str(os.getpid())); time.sleep(0.3);"
        "os.kill(os.getppid(), 9); time.sleep(600)"
    )
    assert outcome.failed == "the launcher died"
    until = time.monotonic() + 10
    while os.path.exists(f"/proc/{pid.read_text()}") and time.monotonic() < until:
        time.sleep(0.01)
    assert not os.path.exists(f"/proc/{pid.read_text()}")


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV])
def test_a_measurer_that_is_killed(run, tmp_path, monkeypatch, number):
    """The outcome says so. Where it died by itself, as in a driver, the next one asks no GPU, and says why."""
    tell = process._tell
    monkeypatch.setattr(process.Process, "without_gpu", "")

    def kill_and_tell(helper, message):
        if "spawned" in message:
            helper.send_signal(number)
            helper.wait()
        tell(helper, message)

    with monkeypatch.context() as patch:
        patch.setattr(process, "_tell", kill_and_tell)
        outcome, _ = run("", watch=tmp_path / "series.csv")
    assert outcome.code == 0 and outcome.measurer is None
    assert outcome.unwatched == (process.KILLED if number == signal.SIGKILL else process.IN_A_DRIVER)
    outcome, _ = run("", watch=tmp_path / "series.csv")
    assert outcome.unwatched is None
    said = outcome.measurer["gpu"]["gpu_power_w"]
    assert (process.IN_A_DRIVER in said) == (number != signal.SIGKILL), said


def test_no_helper_is_left(run, tmp_path):
    import psutil

    before = psutil.Process().children()  # of other tests
    run("", watch=tmp_path / "series.csv")
    assert psutil.Process().children() == before


def test_modules_in_the_current_folder_are_not_imported(run, tmp_path, monkeypatch):
    """A folder may hold a csv.py or a harness of its own."""
    for name in ("csv.py", "psutil.py", "json.py"):
        (tmp_path / name).write_text("raise SystemExit('the wrong module')\n")
    monkeypatch.chdir(tmp_path)
    outcome, _ = run("", watch=tmp_path / "series.csv")
    assert outcome.code == 0 and outcome.measurer is not None


# The measurer

BURN = "import time\nend = time.process_time() + {}\nwhile time.process_time() < end: pass\n"
THREADS = """import hashlib, threading, time
def burn():
    while time.process_time() < 1: hashlib.pbkdf2_hmac("sha256", b"x", b"y", 20000)
threads = [threading.Thread(target=burn) for _ in range(2)]
for thread in threads: thread.start()
for thread in threads: thread.join()
"""
CHILDREN = """import os, time
for _ in range(2):
    if os.fork() == 0:
        while time.process_time() < 0.6: pass
        os._exit(0)
for _ in range(2): os.wait()
"""
SHORT_CHILDREN = """import os, time
for _ in range(50):
    if os.fork() == 0:
        while time.process_time() < 0.02: pass
        os._exit(0)
    os.wait()
time.sleep(0.2)
"""
WAITS_LATE = """import os, time
if os.fork() == 0:
    while time.process_time() < 1: pass
    os._exit(0)
time.sleep(1.5)
os.wait()
time.sleep(0.2)
"""


@pytest.mark.parametrize(
    "source",
    [BURN.format(1), THREADS, CHILDREN, SHORT_CHILDREN, WAITS_LATE],
    ids=["one core", "threads", "children", "short children", "waits late"],
)
def test_cpu_time(source, run, tmp_path):
    """The series ends where wait4 does: what it knows of the dead is cut to ticks, and nothing else is lost."""
    outcome, _ = run(source, watch=tmp_path / "series.csv")
    seen = row.last_cpu(tmp_path / "series.csv")
    total = outcome.user_s + outcome.system_s
    print(total, seen, outcome.measurer)
    assert 0.9 < total < 2 and outcome.measurer["saw_end"]
    exact = "fork" not in source
    assert abs(seen - total) <= (0.001 if exact else 0.025)


def test_cpu_time_that_differs_is_flagged(run, tmp_path):
    outcome, _ = run(BURN.format(0.5), watch=tmp_path / "series.csv")
    total = outcome.user_s + outcome.system_s
    for series, flagged in ((total, False), (0.88 * total, True), (1.12 * total, True), (None, False)):
        doubt = row.cpu_doubt({"user_s": total, "system_s": 0.0, "series_s": series}, outcome)
        assert (doubt is not None) == flagged


def test_series_and_audit(run, tmp_path):
    outcome, _ = run(
        "import time; b = bytearray(b'x' * 50_000_000); time.sleep(1.5)", watch=tmp_path / "series.csv", interval=0.1
    )
    header, *rows = (tmp_path / "series.csv").read_text().splitlines()
    assert header == ",".join(
        ("t", "cpu_s", "rss_bytes", "vms_bytes", "threads", "pss_bytes", "package_energy_j", *gpu.SERIES)
    )
    *rows, end = [row.split(",") for row in rows]
    assert float(end[0]) == pytest.approx(outcome.wall_s, abs=1e-6) and set(end[2:]) == {""}
    assert float(end[1]) == pytest.approx(outcome.user_s + outcome.system_s, abs=1e-3)
    times = [float(row[0]) for row in rows]
    assert times == sorted(times) and times[0] >= 0 and times[-1] < outcome.wall_s
    assert max(int(row[2]) for row in rows) > 50_000_000 and max(int(row[3]) for row in rows) > 50_000_000
    assert {row[4] for row in rows[1:]} == {"1"} and {row[5] for row in rows} == {""}
    audit = outcome.measurer
    assert audit["ticks"] == len(rows) and audit["interval_s"] == 0.1 and 0 <= audit["cpu_s"] < 1.5
    # every deadline was met or counted as missed; the last ones may fall behind the end
    assert abs(audit["ticks"] + audit["missed"] - (outcome.wall_s - times[0]) / 0.1) <= 2
    assert 0.05 < audit["interval_p50_s"] < 0.2 and audit["interval_p50_s"] <= audit["interval_p99_s"]


def test_gpu_columns_are_empty_with_the_reason(run, tmp_path):
    if gpu.Gpu().unavailable is None:
        pytest.skip("there is a GPU here")
    outcome, _ = run("import time; time.sleep(0.3)", watch=tmp_path / "series.csv")
    reasons = outcome.measurer["gpu"]
    assert list(reasons) == list(gpu.SERIES) and outcome.measurer["gpu_sources"] == {}
    assert all(why.startswith(("no NVIDIA d", "no permission", "nvidia-ml-py is not")) for why in reasons.values())
    empty = "," * len(gpu.SERIES)
    assert all(row.endswith(empty) for row in (tmp_path / "series.csv").read_text().splitlines()[1:])


def test_a_process_that_is_gone_at_once(run, tmp_path):
    for _ in range(5):
        outcome, _ = run("", command=["true"], watch=tmp_path / "series.csv")
        assert outcome.code == 0 and outcome.measurer["ticks"] <= 2


def test_missed_ticks_are_counted(monkeypatch):
    """Every look takes 2.5 intervals: of each three deadlines the first is met and two are missed."""
    from harness.process import measurer

    class Slow:
        looks, pids = 0, frozenset()

        def __init__(self, pid, launcher):
            pass

        def sample(self, now):
            Slow.looks += 1
            time.sleep(0.25)
            return None if Slow.looks == 6 else (0, 0, 0, 0, None)

    class Rows:
        writerow = staticmethod(list)

    read, write = os.pipe()
    monkeypatch.setattr(measurer, "Family", Slow)
    with open(read, "rb", buffering=0) as words, open(write, "wb") as other:
        threading.Timer(2, other.close).start()
        target = {"pid": 0, "launcher": 0, "spawned": 0.0}
        seen = measurer.watch(target, 0.1, Rows, measurer.Gpu(), measurer.Rapl(), words)
    gaps = [round((b - a) / 0.1) for a, b in itertools.pairwise(seen.ticks)]
    assert len(seen.ticks) == 5 and all(gap >= 3 for gap in gaps) and not seen.saw_end
    assert seen.missed >= sum(gap - 1 for gap in gaps)
