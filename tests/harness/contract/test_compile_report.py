"""`rayrace doctor --cuda`: what renderers say of their kernels, or why they say nothing."""

import json

import pytest
from typer.testing import CliRunner

from harness.contract import compile_report
from harness.errors import UserError
from harness.renderer import registry
from rayrace import main

KERNEL = {
    **{"event": "kernel", "name": "render_pixels", "target": "sm_90", "registers": 48, "occupancy": 0.625},
    **{"shared_bytes": 2048, "local_bytes": 0, "constant_bytes": 9, "spill_store_bytes": 1, "spill_load_bytes": 2},
    **{"threads_per_block": 256, "float64_instructions": 0, "contracted": 3, "compile_s": 1.5, "assemble_s": 0.1},
}
MANIFEST = """contract = 1
name = "fake"
technology = "none"
description = "tells of kernels"
features = [
    "sphere", "box", "polygon", "ellipsoid", "csg", "ambient", "diffuse", "phong", "shadows", "soft", "reflection",
    "transmission", "attenuation", "media", "glossy", "supersampling", "lens",
]
[methods]
precision = ["float64", "float32"]
walk = ["least", "stack", "table"]
scene_memory = ["auto", "global", "constant", "shared"]
[inspect]
command = ["{python}", "{folder}/inspect_kernels.py"]
[[variant]]
name = "fake-cuda"
command = ["no such program"]
device = "cuda"
"""


@pytest.fixture
def fake(tmp_path):
    """fake(source of the inspect command): the folder of a renderer."""

    def make(source):
        folder = tmp_path / "fake"
        folder.mkdir()
        (folder / "renderer.toml").write_text(MANIFEST)
        (folder / "inspect_kernels.py").write_text("import json, sys\nKERNEL = " + repr(KERNEL) + "\n" + source)
        return folder

    return make


def doctor(folder, *options):
    """Exit status and output of the command, with the fake renderer in place of ours."""
    result = CliRunner().invoke(main.app, ["doctor", "--cuda", *options])
    return result.exit_code, result.output


@pytest.fixture
def only(monkeypatch):
    """only(folder): the renderer there is all that there is."""

    def choose(folder):
        known = {name: e for name, e in registry.entries((folder,)).items() if e.renderer.folder == folder.resolve()}
        monkeypatch.setattr(registry, "entries", lambda extra=(): known)
        return folder

    return choose


TELL = """
targets = next(a for a in sys.argv if a.startswith("--targets=")).partition("=")[2].split(",")
for target in targets:
    print(json.dumps({**KERNEL, "target": target}))
"""


def test_a_row_for_each_case_and_target(fake, only):
    folder = only(fake(TELL))
    status, output = doctor(folder, "--json", "--target", "sm_75", "--target", "sm_90")
    rows = json.loads(output)
    assert status == 0 and len(rows) == 2 * len(compile_report.cases())
    assert {row["status"] for row in rows} == {"ok"} and {row["target"] for row in rows} == {"sm_75", "sm_90"}
    assert {row["scene_memory"] for row in rows if row["case"] == "mirrors"} == {"constant", "global", "shared"}
    assert all(row["registers"] == 48 and row["occupancy"] == 0.625 for row in rows)


def test_the_table_shows_spills_and_occupancy(fake, only):
    folder = only(fake(TELL))
    status, output = doctor(folder, "--target", "sm_90")
    assert status == 0 and "1 + 2" in output and "62" in output and "mirrors, shadows" in output


def test_a_scene_of_the_users(fake, only, tmp_path):
    (tmp_path / "one.txt").write_text(
        "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,4)\nSPHERE (0,0,0) 1\n(1,1,1) 0 1 (0,0,0) 4 1\n"
    )
    folder = only(fake(TELL))
    status, output = doctor(folder, "--json", "--target", "sm_90", "--scene", str(tmp_path / "one.txt"))
    assert status == 0 and [(r["case"], r["precision"]) for r in json.loads(output)] == [
        ("one.txt", "float32"), ("one.txt", "float64"),
    ]  # fmt: skip


def test_what_is_not_installed_is_said_once_and_is_no_failure(fake, only):
    folder = only(fake('print(json.dumps({"event": "error", "reason": "no compiler (get one)"})); sys.exit(3)'))
    status, output = doctor(folder)
    assert status == 0 and output.count("unavailable: no compiler (get one)") == 1


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("print(json.dumps(KERNEL)); raise ValueError('broke')", "ValueError: broke"),
        ("print('nonsense')", "is no event of the contract"),
        ("print(json.dumps({**KERNEL, 'registers': -1}))", "is no event of the contract"),
        ("print(json.dumps({**KERNEL, 'occupancy': 'half'}))", "is no event of the contract"),
    ],
)
def test_a_failure_is_one(fake, only, source, reason):
    folder = only(fake(source))
    status, output = doctor(folder, "--json", "--target", "sm_90")
    bad = [row for row in json.loads(output) if row["status"] != "ok"]
    assert status == 1 and bad and all(row["status"] == "failed" and reason in row["reason"] for row in bad)


def test_no_renderer_of_the_kind():
    with pytest.raises(UserError, match="inspect"):
        compile_report.find({})


def test_options_of_cuda_alone(capsys):
    for option in (["--scene", "x"], ["--target", "sm_90"]):
        result = CliRunner().invoke(main.app, ["doctor", *option])
        assert isinstance(result.exception, UserError) and "only with --cuda" in str(result.exception)
