"""The machine's peaks: measured before timed repetitions that can run, and what is said where they cannot be had."""

import pytest

from harness.experiment import experiment as experiments
from harness.plan import plan
from harness.process import calibration
from harness.process.session import Sessions
from harness.race.bench import Bench
from harness.race.host import ThisHost
from harness.store.store import Run

pytestmark = pytest.mark.alone

EXPERIMENT = """title = "peaks"
scenes = ["scene.txt"]
renderers = ["cpp", "cpp-threads", "numba-cuda"]
processes = 1
[image]
width = 4
height = 4
[measure]
pair = "off"
peaks = {peaks}
"""
SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"


@pytest.fixture(autouse=True)
def _no_program_kept():
    calibration._program.cache_clear()
    yield
    calibration._program.cache_clear()


def test_peaks_are_of_this_machine():
    """Vectors do more than numbers one by one, of narrow numbers more fit in one, and a clock has no 100 GHz."""
    told = calibration.peaks(2)
    if "unavailable" in told:
        pytest.skip(told["unavailable"])
    one, both = told["one"], told["all"]
    assert (one["threads"], both["threads"]) == (1, 2)
    for peaks in told.values():
        assert 1e8 < peaks["scalar_float64"] < 4e11 * peaks["threads"] / 10 and 1e7 < peaks["bytes"] < 1e13
        assert peaks["float64"] > 1.2 * peaks["scalar_float64"] and peaks["float32"] > 1.2 * peaks["scalar_float32"]
    alone = calibration.peaks(1)
    assert alone["one"] == alone["all"]


def test_without_a_compiler(monkeypatch):
    monkeypatch.setenv("CXX", "no-such-compiler")
    why = "CXX is 'no-such-compiler', and there is no such program (correct CXX, or unset it)"
    assert calibration.peaks(1)["unavailable"] == f"calibration: {why}"


def test_a_program_that_fails(monkeypatch):
    """What it says on a processor that the build is not for."""
    monkeypatch.setattr(calibration, "_program", lambda: "false")
    assert "non-zero exit status 1" in calibration.peaks(1)["unavailable"]


class Told(ThisHost):
    """A host that says what was asked of it."""

    def __init__(self):
        super().__init__()
        self.asked = []

    def peaks(self, threads):
        self.asked.append(threads)
        return {"unavailable": "not in a test"}


@pytest.mark.parametrize("peaks", ["true", "false"])
def test_when_they_are_measured(peaks, tmp_path, known):
    """Before timed repetitions of cells that can run, with as many threads as they have, and for nothing else."""
    (tmp_path / "scene.txt").write_text(SCENE)
    file = tmp_path / "experiment.toml"
    file.write_text(EXPERIMENT.format(peaks=peaks))
    made = plan.make(experiments.load(file), file, known)
    host = Told()
    bench = Bench(made, known, Run(tmp_path / "run"), tmp_path / "caches", 0.05, host, Sessions())
    records = {}
    for cell in made.cells:
        for kind in ("timed", "cold"):
            records[cell.entry.name, kind] = bench.repeat(cell, 0, kind)["peaks"]
    able = [cell for cell in made.cells if cell.refused is None]
    wanted = [cell.parameters.threads for cell in able] if peaks == "true" else []
    assert host.asked == wanted
    for (name, kind), told in records.items():
        runs = peaks == "true" and kind == "timed" and any(cell.entry.name == name for cell in able)
        assert (told is not None) == runs
