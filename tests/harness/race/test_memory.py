"""A renderer's peak memory is its own: a harness that holds 300 MB does not show in it, nor in the floor."""

import json
import subprocess
import sys

import pytest

pytestmark = pytest.mark.alone

MB = 10**6
HARNESS = """
import json, sys
from pathlib import Path
ballast = b"x" * int(sys.argv[1])
from harness.process import process, repetition
from harness.race import row
from harness.renderer import registry
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten

scene = flatten(text.read("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)"))
here = Path(sys.argv[2])
(here / "neutral").mkdir(parents=True)
found = {}
for name in ("python", "numpy"):
    runs = [repetition.run(registry.entries()[name], scene, Parameters(width=8, height=8), ()) for _ in range(3)]
    memory = [row.memory(run.said, run.outcome) for run in runs]
    assert all(m["method"] == "VmHWM" for m in memory)
    found[f"{name}, its own"] = min(m["peak_bytes"] for m in memory)
    found[f"{name}, rendering"] = min(m["render_peak_bytes"] or 0 for m in memory)
    found[f"{name}, wait4"] = min(m["wait4_peak_bytes"] for m in memory)
runs = [process.run(["true"], here / "neutral", here / "out", here / "err", 60) for _ in range(3)]
found["true, wait4"] = min(run.wait4_peak_bytes for run in runs)
found["floor"] = min(run.wait4_floor_bytes for run in runs)
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def peaks(tmp_path_factory):
    def measure(ballast):
        folder = tmp_path_factory.mktemp("peaks")
        done = subprocess.run(
            [sys.executable, "-c", HARNESS, str(ballast), folder / "run"], capture_output=True, text=True, timeout=120
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return measure(0), measure(300 * MB)


def test_a_large_harness_changes_no_peak(peaks):
    small, large = peaks
    print({name: (small[name] / MB, large[name] / MB) for name in small})
    for name in small:
        assert abs(large[name] - small[name]) <= 1 * MB, name


def test_wait4_is_at_least_the_floor_and_what_the_renderer_says(peaks):
    for found in peaks:
        assert found["true, wait4"] >= found["floor"] - 0.5 * MB and found["floor"] < 20 * MB
        for name in ("python", "numpy"):
            assert found[f"{name}, wait4"] >= found[f"{name}, its own"] - 1 * MB
        assert found["numpy, its own"] > 1.5 * found["python, its own"]


def test_without_words_of_its_own_wait4_is_taken(bad_folder):
    from harness.process import repetition
    from harness.race import row
    from harness.renderer import registry
    from harness.renderer.job import Parameters
    from harness.scene import text
    from harness.scene.flatten import flatten

    entry = registry.entries((bad_folder("bad-nothing", name="silent"),))["bad-nothing"]
    scene = flatten(text.read("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)"))
    result = repetition.run(entry, scene, Parameters(width=4, height=4), ())
    memory = row.memory(result.said, result.outcome)
    assert memory["method"] in ("wait4", row.AT_MOST)  # it is hardly larger than the launcher
    assert memory["peak_bytes"] == result.outcome.wait4_peak_bytes
    assert memory["floor_bytes"] == result.outcome.wait4_floor_bytes > 0 and memory["render_peak_bytes"] is None
