"""The doctor's findings, of machines that are made up of files."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from harness.machine import doctor, fitness_cores
from harness.renderer.registry import usable_cores
from harness.system import cgroup
from rayrace.terminal import verdict_of


@pytest.fixture
def machine(tmp_path):
    """machine({"proc/self/cgroup": "0::/a", ..}) is the root of a system with these files."""

    def make(files):
        for name, text in files.items():
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"{text}\n")
        return tmp_path

    return make


GROUP = "sys/fs/cgroup"
V2 = {
    "proc/self/cgroup": "0::/user/shell",
    f"{GROUP}/cgroup.controllers": "cpu memory",
    f"{GROUP}/cpu.stat": "usage_usec 5",  # the top counts no throttling
    f"{GROUP}/user/cpu.max": "150000 100000",
    f"{GROUP}/user/cpu.stat": "usage_usec 5\nnr_periods 9\nnr_throttled 3\nthrottled_usec 2500000",
    f"{GROUP}/user/memory.max": "4000000000",
    f"{GROUP}/user/shell/cpu.max": "400000 100000",
    f"{GROUP}/user/shell/memory.max": "max",
    f"{GROUP}/user/shell/memory.peak": "5",
}
V1 = {
    "proc/self/cgroup": "4:memory:/user\n2:cpu,cpuacct:/user\n0::/",
    f"{GROUP}/cpu/user/cpu.cfs_quota_us": "150000",
    f"{GROUP}/cpu/user/cpu.cfs_period_us": "100000",
    f"{GROUP}/cpu/user/cpu.stat": "nr_periods 9\nnr_throttled 3\nthrottled_time 2500000000",
    f"{GROUP}/cpu/cpu.cfs_quota_us": "400000",
    f"{GROUP}/cpu/cpu.cfs_period_us": "100000",
    f"{GROUP}/memory/memory.limit_in_bytes": "9223372036854771712",
    f"{GROUP}/memory/user/memory.limit_in_bytes": "4000000000",
    f"{GROUP}/memory/user/memory.max_usage_in_bytes": "5",
}


@pytest.mark.parametrize(("files", "version", "peak"), [(V2, 2, "memory.peak"), (V1, 1, "memory.max_usage_in_bytes")])
def test_the_tightest_group_counts(machine, files, version, peak):
    root = machine(files)
    assert (cgroup.version(root), cgroup.quota(root), cgroup.held_back(root)) == (version, 1.5, (3, 2.5))
    assert (cgroup.memory_limit(root), cgroup.memory_peak(root)) == (4_000_000_000, peak)
    found = fitness_cores.quota(root)
    assert found.verdict == "doubtful" and found.value.startswith("1.5 cores") and "3 times for 2.5 s" in found.value
    assert "at most 1 thread" in found.remedy
    assert doctor.memory_limit(root).value.startswith("4 GB of")


def test_a_container_that_does_not_see_its_own_path(machine):
    root = machine(
        {**{name: V2[name] for name in (f"{GROUP}/cgroup.controllers",)}, f"{GROUP}/cpu.max": "50000 100000"}
    )
    (root / "proc/self").mkdir(parents=True)
    (root / "proc/self/cgroup").write_text("0::/not/mounted/here\n")
    assert cgroup.quota(root) == 0.5


@pytest.mark.parametrize("stat", [f"{GROUP}/cpu.max", "nothing"])
def test_no_quota(machine, stat):
    root = machine({f"{GROUP}/cgroup.controllers": "cpu", "proc/self/cgroup": "0::/", stat: "max 100000"})
    assert fitness_cores.quota(root).verdict == "good" and cgroup.held_back(root) is None
    assert doctor.memory_limit(root).verdict == "good"


@pytest.mark.parametrize(("stopped", "verdict"), [(0, "good"), (3, "doubtful")])
def test_a_wide_quota_is_good_unless_it_was_used_up(machine, stopped, verdict):
    files = {f"{GROUP}/cgroup.controllers": "cpu", f"{GROUP}/cpu.max": f"{usable_cores()}00000 100000"}
    files[f"{GROUP}/cpu.stat"] = f"nr_throttled {stopped}\nthrottled_usec {stopped}000"
    assert fitness_cores.quota(machine({"proc/self/cgroup": "0::/", **files})).verdict == verdict


def test_a_system_that_tells_nothing(machine):
    root = machine({})
    findings = [
        *(fitness_cores.quota(root), doctor.memory_limit(root), doctor.descendants(root)),
        *(fitness_cores.throttled(root), fitness_cores.siblings("no", root), fitness_cores.governor("unavailable: x")),
    ]
    assert {finding.verdict for finding in findings} == {"unknown"}
    assert all(finding.value.startswith("unavailable: ") for finding in findings)
    assert "source unknown" in fitness_cores.clock(root).value


@pytest.mark.parametrize(
    ("siblings", "virtual", "verdict"),
    [
        ("{n}", "no sign of one", "good"),
        ("{n}", "yes", "unknown"),
        ("0-99", "yes", "doubtful"),
        ("0-99", "no", "doubtful"),
    ],
)
def test_siblings(machine, siblings, virtual, verdict, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1}, raising=False)
    place = "sys/devices/system/cpu/cpu{n}/topology/thread_siblings_list"
    root = machine({place.format(n=n): siblings.format(n=n) for n in (0, 1)})
    found = fitness_cores.siblings(virtual, root)
    assert found.verdict == verdict and ("taskset -c 1 " in found.remedy) == (verdict == "doubtful")


@pytest.mark.parametrize(
    ("source", "available", "verdict", "remedy"),
    [
        ("tsc", "tsc", "good", ""),
        ("hpet", "tsc hpet acpi_pm", "doubtful", "clocksource=tsc"),
        ("acpi_pm", "hpet acpi_pm", "doubtful", "least_frame"),
    ],
)
def test_clock(machine, source, available, verdict, remedy, monkeypatch):
    monkeypatch.setattr(fitness_cores, "SLOW_READ", 1)
    place = "sys/devices/system/clocksource/clocksource0/"
    found = fitness_cores.clock(
        machine({f"{place}current_clocksource": source, f"{place}available_clocksource": available})
    )
    assert found.verdict == verdict and source in found.value and remedy in found.remedy
    monkeypatch.setattr(fitness_cores, "SLOW_READ", 0)
    assert fitness_cores.clock().verdict == "doubtful"


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="no pinning here")
def test_pinning_is_tried_elsewhere(monkeypatch):
    before = os.sched_getaffinity(0)
    assert fitness_cores.pinning().verdict == "good" and os.sched_getaffinity(0) == before
    monkeypatch.setattr(fitness_cores, "PIN", "raise PermissionError")
    found = fitness_cores.pinning()
    assert found.verdict == "doubtful" and found.value.startswith("refused") and "seccomp" in found.remedy


@pytest.mark.parametrize(
    ("value", "verdict"), [("2", "good"), ("1", "doubtful"), ("0", "doubtful"), ("unavailable: x", "unknown")]
)
def test_randomisation(value, verdict):
    assert doctor.randomisation(value).verdict == verdict


@pytest.mark.parametrize(("count", "verdict"), [("0", "good"), ("7", "doubtful")])
def test_throttled(machine, count, verdict):
    root = machine({f"sys/devices/system/cpu/cpu{n}/thermal_throttle/core_throttle_count": count for n in (0, 1)})
    assert fitness_cores.throttled(root).verdict == verdict


@pytest.mark.parametrize(("cores", "text"), [([0], "0"), ([0, 1, 2, 5], "0-2,5"), ([1, 3], "1,3"), ([], "")])
def test_ranges(cores, text):
    assert fitness_cores.ranges(cores) == text


@pytest.mark.parametrize(
    ("pressure", "verdict"),
    [
        ("unavailable: /proc/pressure/cpu: No such file or directory", "unknown"),
        ("some avg10=0.00 avg60=0.00 avg300=0.10 total=5\nfull avg10=0.00 avg60=0.00 avg300=0.00 total=0", "good"),
        ("some avg10=12.50 avg60=0.00 avg300=0.10 total=5", "doubtful"),
    ],
)
def test_pressure(pressure, verdict):
    assert fitness_cores.pressure(pressure).verdict == verdict


GPU = (
    "import json\nfrom harness.machine import fitness_gpu\n"
    "print(json.dumps([vars(found) for found in fitness_gpu.of_nvidia()]))"
)
NVML = Path(__file__).parents[2] / "support" / "nvml"


@pytest.fixture
def gpu(tmp_path):
    """gpu(errors={..}) are the findings, by name, with the replay of NVML changed so."""

    def examine(**changes):
        trace = json.loads((NVML / "trace.json").read_text())
        trace = {**trace, "process": None, "rows": trace["rows"][:1], **changes}
        (tmp_path / "trace.json").write_text(json.dumps(trace))
        variables = {**os.environ, "PYTHONPATH": f"{NVML}{os.pathsep}.", "NVML_TRACE": str(tmp_path / "trace.json")}
        variables.pop("CUDA_VISIBLE_DEVICES", None)
        command = [sys.executable, "-c", GPU]
        done = subprocess.run(command, capture_output=True, text=True, env=variables, cwd=NVML.parents[2])
        assert done.returncode == 0, done.stderr
        return {found["what"]: found for found in json.loads(done.stdout)}

    return examine


def test_gpu(gpu):
    found = gpu()
    assert {name: found[name]["verdict"] for name in found} == {
        "GPU": "good",
        "GPU persistence": "good",
        "GPU clocks": "good",
        "other programs on the GPU": "good",
    }
    assert found["GPU clocks"]["value"] == "1980 of 1980 MHz now, held back by: none"


def test_gpu_that_is_used_and_held_back(gpu):
    row = json.loads((NVML / "trace.json").read_text())["rows"][0]
    found = gpu(rows=[[*row[:-1], 0x40]], process=os.getpid())
    assert "hardware thermal slowdown" in found["GPU clocks"]["value"]
    assert {name for name in found if found[name]["verdict"] == "doubtful"} == {
        "GPU clocks",
        "other programs on the GPU",
    }
    assert all(found[name]["remedy"] for name in found if found[name]["verdict"] == "doubtful")


def test_gpu_that_does_not_tell(gpu):
    found = gpu(errors={"nvmlDeviceGetComputeRunningProcesses": "NoPermission"})["other programs on the GPU"]
    assert found["verdict"] == "unknown" and "no permission" in found["value"]
    assert [*gpu(errors={"nvmlInit": "LibraryNotFound"})] == ["GPU"]


def test_the_verdict_names_every_doubt():
    good, doubt, unknown = (doctor.Finding(verdict, what, "x", "") for what, verdict in
                            (("a", "good"), ("b", "doubtful"), ("c", "unknown")))  # fmt: skip
    assert verdict_of([good, unknown]) == "verdict: fit to measure; 1 of 2 are unknown"
    assert verdict_of([good, doubt, doubt]) == "verdict: fit to measure with doubts: b, b; 0 of 3 are unknown"
