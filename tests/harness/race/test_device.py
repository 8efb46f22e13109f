"""Variants for a GPU, and exhibits: who is available, what is ranked, what counts as a failure. A fake plays them."""

import ctypes
import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from harness.contract import check
from harness.renderer import registry
from harness.renderer.job import count_shapes
from harness.renderer.parameters import NOT_IN_THE_PICTURE, Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.system import cuda

MAIN = Path(__file__).parents[1] / "bad_renderers" / "main.py"
SIMULATED = {cuda.SIMULATOR: "1"}
NO_DEVICE = {"CUDA_VISIBLE_DEVICES": ""}  # on a machine that has one too
MISSING = "no CUDA device (simulator: RAYRACE_CUDASIM=1)"
HEAD = 'contract = 1\nname = "device"\ntechnology = "T"\ndescription = "D"\nfeatures = []\n'
METHODS = 'methods = { scene_memory = ["auto", "shared"] }\n'
UNRANKED = "ran in the CUDA simulator: its times say nothing about a GPU"


@pytest.fixture
def folder(tmp_path):
    """folder("device", ..): these variants of bad_renderers/main.py, all of device cuda; `more` is added to each."""

    def make(*variants, more=METHODS, head="", cost=False):
        place = tmp_path / "renderer"
        place.mkdir(exist_ok=True)
        shutil.copy(MAIN, place)
        tables = ""
        for name in variants:
            tables += f'[[variant]]\nname = "{name}"\ncommand = ["{{python}}", "-S", "{{folder}}/main.py"]\n'
            tables += 'device = "cuda"\n' + more
            tables += 'exhibit = "a seam shows"\n' if name in ("device-exhibit", "device-broken") else ""
            tables += 'exhibit = "it is slow"\nexhibit_of = "cost"\n' if name == "device-wrong" and cost else ""
        (place / "renderer.toml").write_text(HEAD + head + tables)
        return place

    return make


@pytest.fixture
def no_device(monkeypatch):
    monkeypatch.setattr(cuda, "devices", lambda: 0)
    monkeypatch.delenv(cuda.SIMULATOR, raising=False)


# Is there one?


def two(place):
    """Writes 2 to where the driver is to write the number of devices, and tells of no error."""
    place._obj.value = 2
    return 0


@pytest.mark.parametrize(
    ("library", "count"),
    [
        (None, 0),
        (SimpleNamespace(), 0),
        (SimpleNamespace(cuInit=lambda _: 100, cuDeviceGetCount=two), 0),
        (SimpleNamespace(cuInit=lambda _: 0, cuDeviceGetCount=lambda place: two(place) or 3), 0),
        (SimpleNamespace(cuInit=lambda _: 0, cuDeviceGetCount=lambda _: 0), 0),
        (SimpleNamespace(cuInit=lambda _: 0, cuDeviceGetCount=two), 2),
    ],
    ids=["no driver", "another library", "no device", "no count", "none", "two"],
)
def test_devices(library, count, monkeypatch):
    def open_library(name):
        if library is None:
            raise OSError(name)
        return library

    monkeypatch.setattr(ctypes, "CDLL", open_library)
    assert cuda.devices.__wrapped__() == count


def test_the_driver_is_asked_once_and_only_for_a_gpu(known, folder, monkeypatch):
    asked = []
    monkeypatch.setattr(ctypes, "CDLL", lambda name: asked.append(name) or SimpleNamespace(cuInit=lambda _: 100))
    monkeypatch.delenv(cuda.SIMULATOR, raising=False)
    cuda.devices.cache_clear()
    assert [known[name].unavailable for name in ("python", "numpy")] == [None, None] and not asked
    entry = registry.entries((folder("device"),))["device"]
    assert entry.unavailable == entry.unavailable == MISSING and len(asked) == 1
    cuda.devices.cache_clear()


@pytest.mark.parametrize(("value", "reason"), [("1", None), ("0", MISSING), ("", MISSING), ("yes", MISSING)])
def test_the_simulator_will_do(value, reason, folder, no_device, monkeypatch):
    monkeypatch.setenv(cuda.SIMULATOR, value)
    entry = registry.entries((folder("device"),))["device"]
    assert entry.unavailable == reason and entry.simulated == (reason is None)


def test_a_device_will_do(folder, no_device, monkeypatch):
    monkeypatch.setattr(cuda, "devices", lambda: 1)
    entry = registry.entries((folder("device"),))["device"]
    assert entry.unavailable is None and not entry.simulated


@pytest.mark.parametrize(
    ("head", "more", "reason"),
    [
        ("", 'requires = { modules = ["no_such"] }\n', "no Python module no_such (pip install no_such)"),
        ("", 'requires = { programs = ["no-such"] }\n', "no program no-such on the PATH (apt install no-such)"),
        ('[requires]\nmodules = ["first"]\n', 'requires = { modules = ["second"] }\n', "no Python module first (pip"),
        ("", 'requires = { modules = ["json"] }\n', MISSING),
    ],
)
def test_what_is_missing_comes_before_the_device(head, more, reason, folder, no_device):
    entry = registry.entries((folder("device", head=head, more=more),))["device"]
    assert entry.unavailable.startswith(reason)


def test_methods_of_a_variant_are_in_place_of_the_renderers(folder):
    head = '[methods]\nprecision = ["float64", "float32"]\n'
    both = registry.entries((folder("device", head=head),))["device"]
    assert both.methods == {"scene_memory": ("auto", "shared")}
    assert registry.entries((folder("device", head=head, more=""),))["device"].methods == {
        "precision": ("float64", "float32")
    }


# The command line


def test_list(rayrace, folder):
    place = folder("device", "device-exhibit")
    words = "list", "--renderer", place
    told = json.loads(rayrace(*words, "--json", env=NO_DEVICE, code=0).stdout)
    plain, exhibit = told[-2:]
    assert (plain["device"], plain["available"], plain["reason"], plain["simulated"]) == ("cuda", False, MISSING, False)
    assert (plain["exhibit"], exhibit["exhibit"]) == (None, "a seam shows") and told[0]["device"] == "cpu"
    shown = rayrace(*words, env=NO_DEVICE, code=0).stdout
    assert shown.count(f"unavailable: {MISSING[:14]}") >= 2 and "exhibit: a seam shows" in shown
    told = json.loads(rayrace(*words, "--json", env=SIMULATED, code=0).stdout)
    assert (told[-1]["available"], told[-1]["simulated"], told[0]["simulated"]) == (True, True, False)
    assert rayrace(*words, env=SIMULATED, code=0).stdout.count(" simulated ") >= 2


@pytest.fixture
def race(rayrace, experiment, folder, rows, tmp_path):
    """race(variants, env, code): the command that ended, and its rows by variant."""

    def run(variants, env, code, more="", **changes):
        file = experiment([*variants, "python"], more)
        words = "run", file, "--out", tmp_path / "run", "--renderer", folder(*variants, **changes)
        return rayrace(*words, env=env, code=code), rows(tmp_path / "run")

    return run


def test_without_a_device_it_is_a_row(race):
    done, found = race(["device"], NO_DEVICE, 0)
    (row,) = found["device"]
    assert (row["status"], row["reason"], row["unranked"], row["device"]) == ("unavailable", MISSING, None, None)
    assert "1 ok, 1 unavailable" in done.stdout


def test_rows_of_the_simulator_are_ranked_with_none(race):
    done, found = race(["device"], SIMULATED, 0)
    (row,), (other,) = found["device"], found["python"]
    assert row["status"] == "ok" and row["unranked"] == UNRANKED and row["device"]["simulated"] is True
    assert row["device"]["compute_capability"] == [9, 0] and row["device"]["driver"] is None
    assert row["frame_parts"] == [{"kernel": 0, "download": 1e-6}] * 2 and row["agreement"]["max_outside"] == 0
    assert (other["unranked"], other["device"], other["frame_parts"]) == (None, None, [None, None])
    for each in (row, other):
        assert each["pass"] == "timed"
        assert each["shapes"] == dict.fromkeys(("sphere", "box", "polygon", "ellipsoid", "triangle", "csg"), 0)
    assert "1 ok (unranked), 1 ok\n" in done.stdout or "1 ok, 1 ok (unranked)\n" in done.stdout
    assert f"  device: unranked: {UNRANKED}\n" in done.stdout
    assert "RMSE below 0.0028, the truth's accuracy, agreement ✓, unranked" in done.stderr


def test_parameters_of_a_gpu_reach_it(race):
    _, found = race(
        ["device"], SIMULATED, 0, '[sweep]\nscene_memory = ["shared"]\nblock_width = [8]\ntotal_threads = [99]\n'
    )
    told = found["device"][0]["used"]["methods"]
    assert told == {
        "scene_memory": "shared", "block_width": "8", "block_height": "16", "total_threads": "99", "max_registers": "0"
    }  # fmt: skip
    assert found["python"][0]["status"] == "unsupported"
    assert found["python"][0]["reason"] == "has no scene_memory shared (has auto)"


def test_an_exhibit_that_is_wrong_is_what_it_is_for(race):
    done, found = race(["device-exhibit"], SIMULATED, 0)
    (row,) = found["device-exhibit"]
    assert (row["status"], row["unranked"]) == ("wrong picture", "exhibit: a seam shows")
    assert "1 wrong as meant (unranked)" in done.stdout and "wrong picture" not in done.stdout + done.stderr
    assert "  device-exhibit: wrong as meant: 1 pixels off by more than" in done.stdout
    assert "device-exhibit, scene: wrong as meant: 1 pixels off" in done.stderr


def test_an_exhibit_that_does_not_run_is_a_failure(race):
    done, found = race(["device-broken"], SIMULATED, 1)
    assert found["device-broken"][0]["status"] == "failed"
    assert "device-broken: failed: exit 1: no scene today" in done.stdout


def test_the_wrong_picture_of_an_exhibit_of_a_cost_is_a_failure(race):
    done, found = race(["device-wrong"], SIMULATED, 1, cost=True)
    (row,) = found["device-wrong"]
    assert (row["status"], row["unranked"]) == ("wrong picture", "exhibit of a cost: it is slow")
    assert "device-wrong: wrong picture: 1 pixels off" in done.stdout


def test_a_wrong_picture_in_the_simulator_is_a_failure(race):
    done, found = race(["device-wrong"], SIMULATED, 1)
    assert found["device-wrong"][0]["status"] == "wrong picture" and found["device-wrong"][0]["unranked"] == UNRANKED
    assert "device-wrong: wrong picture: 1 pixels off" in done.stdout


def test_render(rayrace, folder, write, tmp_path):
    scene = write("scene.txt", "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n")
    words = "--renderer", folder("device", "device-exhibit"), "--width", 8, "--height", 8, "-o", tmp_path / "a.npy"
    done = rayrace("render", scene, "-r", "device", *words, env=NO_DEVICE, code=2)
    assert done.stderr == f"error: device is unavailable: {MISSING}\n"
    sides = "--scene-memory", "shared", "--block-width", 4, "--block-height", 8
    done = rayrace("render", scene, "-r", "device", *words, *sides, "--json", env=SIMULATED, code=0)
    told = json.loads(done.stdout)
    assert told["device"]["name"] == "a device" and told["unranked"] == UNRANKED
    done = rayrace("render", scene, "-r", "device-exhibit", *words, env=SIMULATED, code=0)
    assert done.stderr == "note: exhibit: a seam shows\n"


# The contract test


def examine(folder, monkeypatch, *variants):
    """[(what, passed, detail), ..] in the simulator."""
    monkeypatch.setenv(cuda.SIMULATOR, "1")
    return [(c.what, c.passed, c.detail) for c in check.examine(folder(*variants))]


def test_check_leaves_exhibits_out(folder, monkeypatch):
    found = examine(folder, monkeypatch, "device", "device-exhibit")
    assert all(passed for _, passed, _ in found)
    assert found[-1] == ("device-exhibit: an exhibit", True, "not checked: a seam shows")
    assert ("device: other blocks and memories give the same bytes", True, "") in found


@pytest.mark.parametrize("variant", ["device-block", "device-memory"])
def test_check_of_what_may_not_change_the_picture(variant, folder, monkeypatch):
    failed = [what for what, passed, _ in examine(folder, monkeypatch, variant) if not passed]
    assert failed == [f"{variant}: other blocks and memories give the same bytes"]


def test_check_without_a_device(folder, no_device):
    (_, only) = check.examine(folder("device"))
    assert (only.what, only.passed, only.detail) == ("device: available here", False, f"not checked: {MISSING}")
    place = folder("device", "bad-nothing")
    toml = place / "renderer.toml"
    toml.write_text("cpu".join(toml.read_text().rsplit("cuda", 1)))
    found = list(check.examine(place))
    assert all(c.passed for c in found) and len(found) > 5
    assert found[1].detail == f"not checked: {MISSING}"


# The parameters


def test_parameters_that_may_not_change_the_picture():
    changed = Parameters(scene_memory="shared", block_width=1, block_height=2, total_threads=3, max_registers=4)
    assert changed.picture() == Parameters() != changed
    values = changed.values()
    assert {name for name, value in Parameters().values().items() if values[name] != value} <= set(NOT_IN_THE_PICTURE)


def test_the_contract_names_every_parameter():
    contract = (Path(check.__file__).parents[2] / "renderers" / "README.md").read_text()
    named = {name for line in contract.splitlines() if line.startswith("| `") for name in line.split("|")[1].split("`")}
    assert set(Parameters().values()) <= named


def test_shapes_are_what_a_ray_is_tried_against(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    matt, mesh = " (1,1,1) 0 1 (0,0,0) 1 1\n", f'MESH "{tmp_path / "a.obj"}" (0,0,0) (0,0,0) 1'
    scene = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\n" + f"SPHERE (0,0,0) 1{matt}" * 3 + mesh + matt
    scene += "BOX (0,0,0) (1,0,0) (0,1,0) (0,0,1)" + matt + "POLYGON 3 (0,0,0) (1,0,0) (0,1,0)" + matt
    scene += f"OR SPHERE (0,0,0) 1 AND {mesh} BOX (0,0,0) (1,0,0) (0,1,0) (0,0,1) END END" + matt
    shapes = count_shapes(flatten(text.read(scene)))
    assert shapes == {"sphere": 3, "box": 1, "polygon": 1, "ellipsoid": 0, "triangle": 4, "csg": 1}
