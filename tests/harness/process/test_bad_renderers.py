"""One run of every bad renderer: each is a row with its true status and reason, and the next cell runs."""

import os
import re
import shutil
import time
from pathlib import Path

import pytest

from harness.process import repetition
from harness.renderer import registry
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten

BAD = Path(__file__).parents[1] / "bad_renderers"
HANG = "bad-hang", "bad-stubborn", "bad-hang-child"
VARIANTS = re.findall(r'^name    = "(bad-.*)"', (BAD / "renderer.toml").read_text(), re.MULTILINE)

# variant: status, part of the reason
EXPECTED = {
    "bad-nothing": ("ok", ""),
    "bad-obedient": ("ok", ""),
    "bad-blind": ("ok", ""),
    "bad-random": ("ok", ""),
    "bad-threads": ("ok", ""),
    "bad-gap": ("ok", ""),
    "bad-region": ("ok", ""),
    "bad-child": ("ok", ""),
    "bad-exit": ("failed", "exit 1: no scene today"),
    "bad-exit-silent": ("failed", "exit 7: it did not say why"),
    "bad-exit-stderr": ("failed", "exit 2: It broke here"),
    "bad-panic": ("failed", "exit 101: panicked at src/main.rs:3:5: no scene today"),
    "bad-chatter": ("failed", "exit 1: the last word"),
    "bad-refuse": ("unsupported", "no scene today"),
    "bad-segv": ("failed", "ended by SIGSEGV"),
    "bad-sigkill": ("killed", "by SIGKILL, perhaps for using too much memory"),
    "bad-rt-signal": ("failed", "ended by signal 40"),
    "bad-hang": ("timeout", "killed after "),
    "bad-stubborn": ("timeout", "killed after "),
    "bad-hang-child": ("timeout", "killed after "),
    "bad-garbage": ("failed", "line 1 of its output is no event of the contract: 'Rendering... 100 %'"),
    "bad-huge": ("failed", "line 1 of its output is no event of the contract: 'xxx"),
    "bad-huge-line": ("failed", " MB, the limit is 64 MB"),  # it is stopped while it writes, at 65 to 73.4 MB
    "bad-no-event": ("failed", "reported frames [], expected 0 to 1"),
    "bad-no-frames": ("failed", "reported frames [], expected 0 to 1"),
    "bad-few-frames": ("failed", "reported frames [0], expected 0 to 1"),
    "bad-many-frames": ("failed", "reported frames [0, 1, 2], expected 0 to 1"),
    "bad-stamps-order": ("failed", 'no event of the contract: \'{"event": "phase"'),
    "bad-stamps-past": ("failed", "outside the life of the process"),
    "bad-stamps-future": ("failed", "outside the life of the process"),
    "bad-stamps-overlap": ("failed", "before the end of the one that was said first"),
    "bad-stamps-nan": ("failed", "no event of the contract"),
    "bad-index": ("failed", "no event of the contract"),
    "bad-number": ("failed", "no event of the contract"),
    "bad-memory": ("failed", "no event of the contract"),
    "bad-versions": ("failed", "no event of the contract"),
    "bad-device": ("failed", "no event of the contract"),
    "bad-parts": ("failed", "the parts of frame 0 are longer than it"),
    "bad-renders": ("failed", "no event of the contract"),
    "bad-batch": ("ok", ""),
    "bad-batch-unasked": ("ok", ""),
    "bad-batch-first": ("failed", "frame 0 is of 64 renders, expected 1"),
    "bad-batch-rays": ("wrong picture", "3584 primary rays, the reference has 56"),
    "bad-reason": ("failed", "exit 1: half ? of it half"),
    "bad-pixel": ("wrong picture", "1 pixels off by more than 1e-09 outside the mask, the worst by 1e-06"),
    "bad-nan": ("wrong picture", "1 pixels are not finite"),
    "bad-inf": ("wrong picture", "1 pixels are not finite"),
    "bad-rays": ("wrong picture", "57 primary rays, the reference has 56"),
    "bad-shape": ("failed", "has shape (56, 3), expected (7, 8, 3)"),
    "bad-turned": ("failed", "has shape (8, 7, 3), expected (7, 8, 3)"),
    "bad-dtype": ("failed", "holds int64, expected float64 or float32"),
    "bad-endian": ("failed", "holds >f8, expected float64 or float32"),
    "bad-pickle": ("failed", "is no array: Array can't be memory-mapped: Python objects in dtype"),
    "bad-zip": ("failed", "is no array"),
    "bad-header": ("failed", "is no array"),
    "bad-length": ("failed", "is no array"),
    "bad-size": ("failed", "is no array"),
    "bad-empty-file": ("failed", "is no array"),
    "bad-no-file": ("failed", 'returned no file "other.npy" in its output folder'),
    "bad-no-folder": ("failed", 'returned no file "image.npy" in its output folder'),
    "bad-no-output": ("failed", "printed no output event"),
    "bad-folder": ("failed", 'returned no file "."'),
    "bad-outside": ("failed", 'returned no file "../image.npy"'),
    "bad-link": ("failed", 'returned no file "linked.npy"'),
    "bad-long-name": ("failed", 'returned no file "xxx'),
    "bad-no-command": ("failed", "could not start no-such-program-at-all: No such file or directory"),
    "bad-not-executable": ("failed", "renderer.toml: Permission denied"),
    "bad-command-folder": ("failed", "Permission denied"),
}


@pytest.fixture(scope="module")
def run(rayrace, tmp_path_factory):
    """The finished `rayrace run` of all variants, and its folder."""
    place = tmp_path_factory.mktemp("bad-run")
    (place / "scene.txt").write_text("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n")
    names = ", ".join(f'"{name}"' for name in VARIANTS)
    (place / "bad.toml").write_text(
        f'title = "bad"\nscenes = ["scene.txt"]\nrenderers = [{names}]\nprocesses = 1\nframes = 1\ntimeout = "60 s"\n'
        "[image]\nwidth = 8\nheight = 7\ndepth = 1\n"
        + "".join(f'[override.{name}]\ntimeout = "3 s"\n' for name in HANG)
    )
    began = time.monotonic()
    done = rayrace("run", place / "bad.toml", "--out", place / "run", "--renderer", BAD)
    return done, place / "run", time.monotonic() - began


def test_every_variant_is_expected():
    assert set(EXPECTED) == set(VARIANTS)


@pytest.mark.slow
@pytest.mark.whole
@pytest.mark.parametrize("variant", VARIANTS)
def test_row(run, rows, variant):
    (row,) = rows(run[1])[variant]
    status, reason = EXPECTED[variant]
    assert (row["status"], reason in row["reason"]) == (status, True), row["reason"]
    assert len(row["reason"]) < 1000 and "\n" not in row["reason"]
    assert (row["picture"] is not None) == (status in ("ok", "wrong picture"))
    assert (row["agreement"] is not None) == (status in ("ok", "wrong picture"))


@pytest.mark.slow
def test_run_goes_on_and_says_what_failed(run, rows):
    done, folder, _ = run
    assert sum(map(len, rows(folder).values())) == len(VARIANTS)
    assert done.returncode == 1
    assert "bad-pixel: wrong picture: 1 pixels off" in done.stdout


@pytest.mark.slow
def test_good_with_one_thing_wrong_was_judged(run, rows):
    accuracy = rows(run[1])["bad-nothing"][0]["agreement"]
    assert accuracy["reference"] and accuracy["max_outside"] < 1e-15 and accuracy["mask_fraction"] == 0


@pytest.mark.slow
def test_timeouts_were_kept(run, rows):
    for variant in HANG:
        (row,) = rows(run[1])[variant]
        assert 3 <= row["wall_s"] < 20


@pytest.mark.slow
def test_life_outside_phases_is_a_warning(run, rows):
    read = rows(run[1])
    assert any("uncovered" in text for text in read["bad-gap"][0]["warnings"])


@pytest.mark.slow
def test_logs_are_kept(run, rows):
    (row,) = rows(run[1])["bad-exit-stderr"]
    log = run[1] / "logs" / f"{row['cell']}-0.stderr"
    assert log.read_text().endswith("It broke here\n")


@pytest.mark.parametrize("variant", ["bad-child", "bad-hang-child"])
def test_child_that_is_left_behind_is_killed(variant, bad_folder, tmp_path):
    """Through one repetition, whose cache folder we know."""
    entry = registry.entries((bad_folder(variant, name="left"),))[variant]
    scene = flatten(text.read("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\n"))
    timeout = 5 if variant in HANG else 60
    result = repetition.run(entry, scene, Parameters(width=4, height=4), (), timeout=timeout, cache=tmp_path)
    assert result.status == ("timeout" if variant == "bad-hang-child" else "ok")
    child = int((tmp_path / "child").read_text())
    until = time.monotonic() + 5
    while is_alive(child) and time.monotonic() < until:
        time.sleep(0.01)
    assert not is_alive(child)


def is_alive(pid):
    try:
        os.kill(pid, 0)
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_a_second_different_picture_is_a_warning(rayrace, experiment, bad_folder, rows, tmp_path):
    folder = bad_folder("bad-random", name="random")
    rayrace("run", experiment(["bad-random"], processes=2), "--out", tmp_path / "run", "--renderer", folder, code=0)
    first, second = rows(tmp_path / "run")["bad-random"]
    assert first["picture"]["sha256"] != second["picture"]["sha256"]
    assert "the picture is not the same as in the first repetition" in second["warnings"]
    assert (tmp_path / "run" / second["picture"]["file"]).is_file()


# What the manifest says, not the program


@pytest.mark.parametrize(
    ("head", "status", "reason"),
    [
        ('[requires]\nmodules = ["no_such_module"]\n', "unavailable", "no Python module no_such_module (pip install"),
        ('[requires]\nmodules = ["no_such.module"]\n', "unavailable", "no Python module no_such.module"),
        ('[requires]\nprograms = ["no-such-program"]\n', "unavailable", "no program no-such-program on the PATH (apt"),
        ('[methods]\nprecision = ["float32"]\n', "unsupported", "has no precision float64 (has float32)"),
        ('[build]\ncompiler = "c"\ncommand = ["false"]\n', "failed", "its build failed: false: exit 1"),
        (
            '[build]\ncompiler = "c"\ncommand = ["no-compiler"]\n',
            "failed",
            "its build failed: no-compiler: No such file",
        ),
    ],
)
def test_manifest(head, status, reason, rayrace, experiment, bad_folder, rows, tmp_path):
    if "[build]" in head and not shutil.which("cc"):
        pytest.skip("no C compiler (apt install gcc)")
    folder = bad_folder("bad-nothing", name="demanding", head="\n" + head)
    done = rayrace("run", experiment(["bad-nothing", "python"]), "--out", tmp_path / "run", "--renderer", folder)
    found = rows(tmp_path / "run")
    assert found["bad-nothing"][0]["status"] == status and reason in found["bad-nothing"][0]["reason"]
    assert found["python"][0]["status"] == "ok"
    assert done.returncode == (1 if status == "failed" else 0)


def test_a_build_that_fails_is_tried_once(rayrace, experiment, bad_folder, rows, write, tmp_path):
    if not shutil.which("cc"):
        pytest.skip("no C compiler (apt install gcc)")
    count = tmp_path / "count"
    build = (
        f'[build]\ncompiler = "c"\ncommand = ["sh", "-c", "echo once >> {count}; echo main.c: error: no >&2; exit 4"]\n'
    )
    folder = bad_folder("bad-nothing", "bad-refuse", name="unbuilt", head="\n" + build)
    file = experiment(["bad-nothing", "bad-refuse"], processes=2)
    rayrace("run", file, "--out", tmp_path / "run", "--renderer", folder, code=1)
    assert [row["status"] for row in rows(tmp_path / "run")["bad-nothing"]] == ["failed"] * 2
    assert "exit 4: main.c: error: no" in rows(tmp_path / "run")["bad-refuse"][1]["reason"]
    assert count.read_text() == "once\n"
