"""The energy of the processor while a repetition rendered, from a series with a counter of known power."""

from types import SimpleNamespace

import pytest

from harness.race import energy_use

WATTS, START, END = 40.0, 1.0, 3.0


@pytest.fixture
def made(tmp_path):
    """A function that makes what is known of a repetition: frames of 0.5 s, ticks of 0.1 s, a counter from 7 J."""

    def make(why=None, rays=1000, end=END, step=0.1):
        rows = [f"{k * step:.6f},{7 + WATTS * k * step}" for k in range(int(4 / step))]
        (tmp_path / "series.csv").write_text("t,package_energy_j\n" + "\n".join(rows) + "\n")
        frames = [{"start": 100 + START + k / 2, "end": 100 + START + (k + 1) / 2, "renders": 2} for k in range(4)]
        phases = [{"name": "render", "start": 100 + START, "end": 100 + end}]
        counts = None if rays is None else {"primary": rays, "reflected": 0, "transmitted": 0, "shadow": 0}
        said = SimpleNamespace(phases=phases, frames=frames, rays=counts)
        audit = {"package_energy": why, "interval_s": step}
        return said, SimpleNamespace(measurer=audit, spawned=100.0), tmp_path / "series.csv"

    return make


def test_of_a_power(made):
    found = energy_use.use(*made())
    assert set(found) == set(energy_use.VALUES)
    assert found["power_w"] == pytest.approx(WATTS)
    assert found["energy_j"] == pytest.approx(WATTS * found["energy_s"])
    assert 1.7 <= found["energy_s"] <= END - START
    assert found["joules_per_frame"] == pytest.approx(WATTS * 0.25)
    assert found["joules_per_mray"] == pytest.approx(WATTS * 0.25 / 1000 * 1e6)


def test_why_there_is_none(made):
    assert energy_use.use(*made(why="no RAPL")) == {"unavailable": "no RAPL"}
    said, outcome, series = made()
    assert energy_use.use(said, SimpleNamespace(measurer=None, spawned=0.0), series) == {
        "unavailable": "the measurer died"
    }
    nothing = SimpleNamespace(phases=[], frames=[], rays=None)
    assert "phase render" in energy_use.use(nothing, outcome, series)["unavailable"]
    short = energy_use.use(*made(end=START + 0.05))
    assert all("too short to sample" in value["unavailable"] for value in short.values())
    found = energy_use.use(*made(rays=None))
    assert found["joules_per_mray"] == {"unavailable": "it does not count its rays"} and found["power_w"] > 0
