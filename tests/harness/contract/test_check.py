"""`rayrace check`: the shipped renderers pass, and a bad one fails by the name of the rule it breaks."""

import cheats
import liars
import pytest
from nightly import by_night

from harness.contract import check, check_scenes
from harness.judge.judge import Verdict
from harness.renderer import registry
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.store.record import UNCHECKED
from harness.system import cuda

FOLDERS = registry.folders()
PEERS = ("taichi", "jax", "typed", "embree")  # optional: where one is missing there is nothing to check


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.parametrize(
    "folder",
    by_night(
        FOLDERS,
        *("cpp", "numba", "python"),
        ids=lambda folder: folder.name,
        reason="CI checks NumPy and POV-Ray, and tests of conformance ask the same; a case takes 40 s or more",
    ),
)
def test_shipped(folder, rayrace):
    done = rayrace("check", folder, timeout=900)
    faults = [line for line in done.stdout.splitlines() if line.lstrip().startswith("FAIL")]
    if faults and all("available here: " in line for line in faults):
        pytest.skip(done.stdout)
    assert done.returncode == 0 and done.stdout.endswith("all checks passed\n"), done.stdout
    unchecked = [line for line in done.stdout.splitlines() if "not checked" in line and cuda.NO_DEVICE not in line]
    excused = (": an exhibit: ", "available here: not checked: no ") if folder.name in PEERS else (": an exhibit: ",)
    assert all(any(word in line for word in excused) for line in unchecked) or folder.name == "povray", unchecked


def test_a_good_one(rayrace, bad_folder):
    done = rayrace("check", bad_folder("bad-nothing", name="good"), code=0)
    assert done.stdout.count("ok  ") == len(done.stdout.splitlines()) - 1


@pytest.mark.parametrize(
    ("variant", "rule"),
    [
        ("bad-exit", "a picture of all that it claims: failed: exit 1: no scene today"),
        ("bad-garbage", "a picture of all that it claims: failed: line 1 of its output is no event"),
        ("bad-nan", "a picture of all that it claims: pixels that are not finite"),
        ("bad-random", "the same job again gives the same bytes"),
        ("bad-pixel", "agrees with another renderer in float64 (python): 1 pixels off by more than 1e-09"),
        ("bad-rays", "counts the rays of SPEC.md: 289 primary rays, the reference has 288"),
        ("bad-gap", "phases cover its life: "),
        ("bad-batch", "a frame is one render, or a batch that lasts: 64 renders last "),
        ("bad-batch-unasked", "a picture of all that it claims: failed: frames of 2 renders, which nobody asked for"),
        ("bad-batch-first", "a frame is one render, or a batch that lasts: frame 0 is of 64 renders, expected 1"),
        ("bad-batch-rays", "a frame is one render, or a batch that lasts: counts {'primary': 18432"),
        ("bad-threads", "1, 2 and 3 threads give the same bytes"),
        ("bad-region", "a region has the pixels of the whole: image.npy has shape (18, 16, 3), expected (8, 7, 3)"),
        ("bad-obedient", "refuses a feature it does not know, with exit status 3"),
        ("bad-blind", "a job without its camera fails, with a reason"),
    ],
)
def test_bad(variant, rule, rayrace, bad_folder):
    done = rayrace("check", bad_folder(variant, name="wrong"), code=1)
    failed = [line for line in done.stdout.splitlines() if line.startswith("FAIL")]
    assert failed[0].startswith(f"FAIL  {variant}: {rule}"), done.stdout
    assert done.stdout.endswith(f"checks failed: {len(failed)}\n")
    assert len(failed) <= 4, "one fault, and what follows from it"


SLEEP = pytest.mark.alone, pytest.mark.nightly("test_false (test_contradiction.py) has it by day")


@pytest.mark.parametrize("variant", [*by_night(["load", "save"], "save"), pytest.param("asleep", marks=SLEEP)])
def test_false_times(variant, rayrace, tmp_path):
    """It fails in the words that a race would say."""
    done = rayrace("check", liars.folder(tmp_path / "liars", variant), code=1)
    failed = [line for line in done.stdout.splitlines() if line.startswith("FAIL")]
    rule = "its marks agree with its phases and the processor: its marks contradict "
    assert len(failed) == 1 and failed[0].startswith(f"FAIL  liar-{variant}: {rule}{liars.LIES[variant]}"), done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(("cheat", "words"), [("ninth", cheats.OTHER), ("unmoved", cheats.WRONG), ("true", "")])
def test_a_later_frame_is_checked(cheat, words, rayrace, tmp_path):
    done = rayrace("check", cheats.folder(tmp_path / "cheats", 2, cheat), code=1 if words else 0)
    (told,) = [line for line in done.stdout.splitlines() if "a later frame is the picture of its place" in line]
    assert told.startswith("FAIL  " if words else "ok    ") and words in told and UNCHECKED not in told


LISTED = """import sys
from renderers import worker
with worker.importing():
    import numpy as np
jobs = []
def main(arguments):
    job = worker.Job(arguments)
    worker.require(job, [])
    jobs.append(job)
    with worker.phase("load"):
        background, _ = (np.load(job.array(name)) for name in ("background", "camera"))
    picture = worker.render(job, lambda: np.tile(background, (job.height, job.width, 1)))
    with worker.phase("save"):
        np.save(job.output("image.npy"), picture FAULT)
    worker.say("output", file="image.npy")
SERVE
"""


@pytest.mark.parametrize(
    ("fault", "serve", "rule"),
    [
        ("", "worker.serve(main, sys.argv[1:])", None),
        ("", "main(sys.argv[1:])", "its process ended after job 1; it must read the next one"),
        ("+ 1e-3 * (len(jobs) > 1)", "worker.serve(main, sys.argv[1:])", "a list of jobs gives the same bytes"),
    ],
)
def test_lists(fault, serve, rule, rayrace, write):
    """A renderer that keeps to lists of jobs; that does not know them; that carries something over to the next job."""
    write("listed/main.py", LISTED.replace("FAULT", fault).replace("SERVE", serve))
    head = 'contract = 1\nname = "listed"\ntechnology = "Python"\ndescription = "a test"\nfeatures = []\njobs = true\n'
    variant = '[[variant]]\nname = "listed"\ncommand = ["{python}", "{folder}/main.py"]\n'
    done = rayrace("check", write("listed/renderer.toml", head + variant).parent)
    failed = [line for line in done.stdout.splitlines() if line.startswith("FAIL")]
    assert done.returncode == (rule is not None), done.stdout
    assert "ok    listed: a list of jobs gives the same bytes" in done.stdout or rule
    assert rule is None or rule in failed[0], done.stdout


@pytest.mark.parametrize(
    ("head", "rule"),
    [
        ("colour = 1\n", "renderer.toml: "),
        ('[requires]\nmodules = ["no_such_module"]\n', "available here: no Python module no_such_module"),
        ('[build]\ncompiler = "c"\ncommand = ["false"]\n', "build: false: exit 1"),
        ('[methods]\nprecision = ["float64", "float32"]\n', None),
    ],
)
def test_manifest(head, rule, bad_folder, monkeypatch):
    monkeypatch.setenv("CC", "true")  # a compiler, as far as anyone looks
    folder = bad_folder("bad-nothing", name="manifest", head="\n" + head)
    failed = [found for found in check.examine(folder) if not found.passed]
    if rule is None:
        assert failed == []
    else:
        assert len(failed) == 1 and f"{failed[0].what}: {failed[0].detail}".startswith(rule)


@pytest.mark.parametrize(
    "features", [(), ("sphere",), ("polygon", "ambient"), ("sphere", "diffuse", "phong", "reflection")]
)
def test_its_scene_uses_what_is_claimed(features):
    from harness.scene.needs import needs

    used = needs(text.read(check_scenes.scene_text(features)), Parameters(depth=3))
    assert set(used) <= set(features)
    assert {"sphere", "polygon", "ambient", "diffuse", "reflection"} & set(features) <= set(used)


def test_a_large_mask_is_said():
    """Above a tenth of the picture; else it goes without saying."""
    told = {share: check._told(Verdict(None, max_outside=2e-12, mask_fraction=share)) for share in (0.1, 0.125)}
    assert told == {
        0.1: "2.0e-12",
        0.125: "2.0e-12; 12 % of the picture is ill-conditioned, and judged as a whole",
    }
    assert check._told(Verdict(None, mask_fraction=1.0)).startswith("every pixel is in the mask; 100 % of the picture")
