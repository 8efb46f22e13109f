"""NVML that fails in mid-run: the GPU falls off, its driver hangs or takes the process along that asked. Rows lose what
it would have told, with the reason, and nothing else."""

import json
import os
import sys
import time
from pathlib import Path

import faulty
import pytest

from harness.process import process
from harness.store import store

FAKE = Path(__file__).parents[1] / "support" / "nvml"
TRACE = json.loads((FAKE / "trace.json").read_text())


def fake(place, **fault):
    (place / "trace.json").write_text(json.dumps({**TRACE, "process": None, "fault": fault or None}))
    path = os.pathsep.join([str(FAKE), *filter(None, [os.environ.get("PYTHONPATH")])])
    return {"PYTHONPATH": path, "NVML_TRACE": str(place / "trace.json")}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["GpuIsLost", "dies", "hangs"])
def test_in_mid_run(rayrace, tmp_path, kind, injected):
    """From half a second after the first sample of each measurer, in repetitions of a second or two."""
    file, words = faulty.tiny(tmp_path / "tiny", processes=1)
    words += ["--set", "image.width=300", "--set", "image.height=300", "--set", "frames=500", "--only", "flat"]
    rayrace("run", file, "--out", tmp_path / "run", *words, env=fake(tmp_path, kind=kind, from_s=0.5), code=0)
    records = store.read(tmp_path / "run")[1]
    assert records
    for record in records:
        assert record["status"] == "ok" and record["cpu"]["user_s"] > 0 and record["wall_s"] > 0.5
        if kind == "GpuIsLost":
            audit = record["measurer"]
            assert audit["saw_end"] and audit["gpu"]["gpu_power_w"] == "available" and audit["ticks"] > 2
            series = (tmp_path / "run" / record["series"]).read_text().splitlines()
            power = [line.split(",")[series[0].split(",").index("gpu_power_w")] for line in series[1:-1]]
            assert power[0] and not power[-1], "told to the end, or never"
        else:
            audit = record["measurer"]  # of a second measurer, which leaves the GPU alone
            assert audit["saw_end"] and process.IN_A_DRIVER in audit["gpu"]["gpu_power_w"]
    again = [record for record in records if f"it was repeated: {process.IN_A_DRIVER}" in record["warnings"]]
    assert len(again) == (kind != "GpuIsLost")
    rayrace("run", file, "--resume", tmp_path / "run", *words, "--set", "processes=2", env=fake(tmp_path), code=0)
    assert len(store.read(tmp_path / "run")[1]) == len(records) + 1
    injected(f"NVML {kind}", len(records))


@pytest.mark.parametrize("kind", ["dies", "hangs"])
def test_as_the_measurer_starts(tmp_path, monkeypatch, kind, injected):
    """The renderer is not kept waiting for ever."""
    monkeypatch.setattr(process, "START", 3.0)
    monkeypatch.setattr(process.Process, "without_gpu", "")
    for name, value in fake(tmp_path, kind=kind, from_s=-1).items():
        monkeypatch.setenv(name, value)
    (tmp_path / "neutral").mkdir()
    begun = time.monotonic()
    done = process.run(
        [sys.executable, "-c", "pass"], tmp_path / "neutral", tmp_path / "out", tmp_path / "err", 60, tmp_path / "s.csv"
    )
    assert done.code == 0 and done.failed is None and done.measurer is None and done.unwatched == process.IN_A_DRIVER
    assert time.monotonic() - begun < 40
    injected(f"NVML {kind}")
