"""Renderers that misbehave: each is a row with its reason, nothing of it is left, and the next one is not disturbed."""

import sys
import tempfile
import time
from pathlib import Path

import pytest
import zoo

from harness.process import process, repetition
from harness.race import contradiction, row
from harness.renderer import registry
from harness.renderer.limits import Limits
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.system import trouble

SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="orphans are found through Linux's /proc")


@pytest.fixture(scope="module")
def animals(tmp_path_factory):
    return registry.entries((zoo.folder(tmp_path_factory.mktemp("zoo") / "animals"),))


@pytest.fixture(autouse=True)
def no_files_in_memory():
    """What a renderer leaves in /dev/shm stays: nobody can prove that it is its."""
    yield
    for path in Path("/dev/shm").glob("rayrace-zoo-*"):  # others may run beside this test
        if not Path("/proc", path.name.split("-")[2]).exists():
            path.unlink(missing_ok=True)


@pytest.fixture
def run(animals, tmp_path, monkeypatch):
    """run(variant) is the Result of one repetition, and its row; all that it makes is below one folder."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    stuck, limits = process.STUCK, Limits.model_validate(zoo.LIMITS)

    def run(variant, watch=False):
        series = tmp_path / ("series.csv" if watch else "none.csv")
        monkeypatch.setattr(process, "STUCK", 2.0 if variant in zoo.PATIENT else stuck)
        result = repetition.run(
            animals[variant], flatten(text.read(SCENE)), Parameters(width=8, height=7, frames=1), (),
            timeout=zoo.timeout(variant), series=series if watch else None,
            cache=tmp_path / "cache", log=tmp_path / "log", limits=limits,
        )  # fmt: skip
        told = {"status": result.status, "reason": result.reason}
        told["unranked"] = contradiction.marks(result, series, 1) if result.status == "ok" else None
        return result, {**row.measured(result, series), **told}

    return run


@pytest.fixture(scope="module")
def undisturbed(animals):
    """What the good renderer said of its surroundings when it first ran."""
    return {}


@pytest.mark.parametrize("variant", zoo.ZOO)
def test_misdeed(variant, run, undisturbed, tmp_path):
    began = time.monotonic()
    result, record = run(variant, watch="measurer" in variant)
    took = time.monotonic() - began
    print(f"{variant}: {result.status}: {result.reason} {record['warnings']} {took:.2f} s")
    assert zoo.wrong(variant, record) is None
    assert (result.array is not None) == (result.status == "ok")
    assert len(str(record)) < 10**5 and took < zoo.TIMEOUT + 20
    assert zoo.running(str(tmp_path)) == []
    assert list((tmp_path / "temporary").iterdir()) == []
    assert not list((tmp_path / "cache").glob("core*"))
    if variant in ("zoo-all-link", "zoo-out-link"):
        assert (tmp_path / "cache" / "precious" / "file").exists()
    good, measured = run(zoo.GOOD)
    assert (good.status, good.reason, measured["warnings"], good.outcome.orphans) == ("ok", "", [], 0)
    assert undisturbed.setdefault("versions", good.said.versions) == good.said.versions
    assert good.array.shape == (7, 8, 3) and len(set(map(tuple, good.array.reshape(-1, 3)))) == 1


@pytest.mark.nightly("test_misdeed shows each misdeed by day; it takes about 45 s")
def test_a_run_of_the_whole_zoo(rayrace, experiment, rows, tmp_path):
    """Through the command line, shuffled, with a good one beside: no repetition is lost, and no process survives."""
    animals = [name for name in zoo.ZOO if name not in zoo.PATIENT]
    limits = "".join(f"{key} = {value!r}\n" for key, value in zoo.LIMITS.items()).replace("'", '"')
    file = experiment([zoo.GOOD, *animals], f'timeout = "{zoo.TIMEOUT} s"\n[limits]\n{limits}')
    (tmp_path / "temporary").mkdir()
    folder = zoo.folder(tmp_path / "animals")
    rayrace(
        "run", file, "--out", tmp_path / "run", "--renderer", folder, code=1, timeout=900,
        env={"TMPDIR": str(tmp_path / "temporary")},
    )  # fmt: skip
    found = rows(tmp_path / "run")
    lost = [name for name in (zoo.GOOD, *animals) if len(found.get(name, ())) != 1]
    survivors = zoo.running(str(tmp_path))
    left = [path.name for path in (tmp_path / "temporary").iterdir()]
    print(f"{len(animals)} faults injected, {len(lost)} repetitions lost, {len(survivors)} processes left, "
          f"{len(left)} temporary files left")  # fmt: skip
    assert (lost, survivors, left) == ([], [], [])
    assert found[zoo.GOOD][0]["status"] == "ok"
    wrong = {name: zoo.wrong(name, found[name][0]) for name in animals}
    if set(trouble.DOUBTS.values()) & set(found["zoo-time-little"][0]["warnings"]):
        del wrong["zoo-time-little"]  # time that others had the processor contradicts nothing (contradiction.py)
    assert not any(wrong.values()), wrong
