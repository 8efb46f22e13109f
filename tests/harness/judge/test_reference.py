import shutil
from dataclasses import replace

import numpy as np
import pytest

from harness.judge import judge, reference
from harness.process import repetition
from harness.renderer import manifest, registry
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.generate.comparison import comparison
from harness.scene.needs import needs

SMALL = Parameters(width=16, height=16, depth=2, shadows=True)
SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,6)\nSPHERE (0,0,-1) 0.8 (0.7,0.5,0.3) 0.4 20 (0,0,0) 1e6 1\n"


@pytest.fixture(scope="module")
def scene():
    return text.read(SCENE)


def wants(scene, parameters):
    return needs(scene, parameters)


def test_never_by_its_own_folder(known, scene):
    found = {name: reference.choose(entry, known, SMALL, wants(scene, SMALL)) for name, entry in known.items()}
    for name, maker in found.items():
        assert maker.renderer.folder != known[name].renderer.folder
    if known["cpp"].renderer.unavailable is None:
        assert found["python"].name == "cpp"
        assert found["cpp"].name == found["cpp-threads"].name == "numpy"


def test_the_first_that_can(known, scene):
    needed = wants(scene, SMALL)
    for gone, expected in ((("cpp",), "numpy"), (("cpp", "numpy"), "numba"), (("cpp", "numba", "numpy"), None)):
        left = {name: entry for name, entry in known.items() if name not in gone}
        found = reference.choose(known["python"], left, SMALL, needed)
        assert (found and found.name) == expected
    assert reference.choose(known["python"], known, SMALL, (*needed, "no-such-feature")) is None


@pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler (apt install gcc)")
def test_one_whose_build_fails_is_passed_over(known, scene, bad_folder):
    folder = bad_folder("bad-nothing", name="unbuilt", head='\n[build]\ncompiler = "c"\ncommand = ["false"]\n')
    broken = registry.Renderer(folder, manifest.load(folder))
    assert broken.unavailable is None
    found = reference.choose(known["python"], {**known, "cpp": Entry(broken, broken.manifest.variant[0])}, SMALL, ())
    assert found.name == "numpy"


def test_a_maker_that_fails_is_no_reference(known, scene, bad_folder, tmp_path):
    bad = registry.entries((bad_folder("bad-exit", "bad-nan", name="makers"),))
    made = reference.make(bad["bad-exit"], flatten(scene), SMALL, (), tmp_path)
    assert made.reason == "bad-exit could not make the reference: failed: exit 1: no scene today"
    made = reference.make(bad["bad-nan"], flatten(scene), SMALL, (), tmp_path)
    assert made.reason == "the reference of bad-nan has pixels that are not finite"


def test_perturbations_are_few_ulps_and_the_same_each_time():
    wanted = replace(SMALL, width=100, height=50)
    moves = np.array(reference.perturbed(wanted, 8)) - 0.5
    radii = np.hypot(moves[:, 0] / 100, moves[:, 1] / 50)
    assert len(moves) == 8
    assert np.allclose(radii, 4 * 2.0**-23 / 2, rtol=1e-6)
    assert np.all(moves.min(axis=0) < 0) and np.all(moves.max(axis=0) > 0)
    assert reference.perturbed(wanted, 8) == reference.perturbed(wanted, 8)


def test_a_float32_picture_is_compared_at_its_own_epsilon():
    """Else the comparison measures epsilon: contact shadows begin that far out (OFF-1)."""
    assert reference.job_of(replace(SMALL, precision="float32")).epsilon == 2.0**-19
    assert reference.job_of(SMALL).epsilon == reference.job_of(replace(SMALL, precision="mp60")).epsilon == 2.0**-48
    assert reference.job_of(replace(SMALL, epsilon=1e-3)).epsilon == 1e-3


@pytest.mark.slow
def test_the_mask_holds_the_pixels_that_float32_gets_wrong(known, tmp_path):
    """Of mirrors in mirrors: some pixels are wrong in float32, and those are in the mask."""
    maker = known["cpp"]
    if maker.renderer.unavailable:
        pytest.skip(maker.renderer.unavailable)
    scene = text.read(comparison(48, 3))
    parameters = replace(SMALL, width=200, height=200, depth=6)
    arrays, needed = flatten(scene), wants(scene, parameters)
    made = reference.make(maker, arrays, parameters, needed, tmp_path)
    rough = repetition.run(known["cpp"], arrays, replace(parameters, precision="float32"), needed).array
    difference = np.abs(rough.astype(np.float64) - made.picture).max(axis=-1)
    wrong = difference > judge.TOLERANCE["float32"]
    print(f"{wrong.sum()} pixels are wrong in float32, {made.mask.sum()} are in the mask")
    assert wrong.any() and not np.any(wrong & ~made.mask)
    assert made.mask.mean() < 0.03
    assert judge.judge(rough, made, "float32").wrong is None
