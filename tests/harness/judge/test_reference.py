import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.judge import cache, judge, reference
from harness.process import repetition
from harness.renderer import manifest, registry
from harness.renderer.job import fingerprint
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


def test_the_documentation_has_the_numbers_of_moved_copies():
    told = (Path(__file__).parents[3] / "docs" / "measuring-well.md").read_text("utf-8")
    by, further = reference.PERTURBATIONS, reference.FURTHER
    assert reference.FURTHER_ULPS["float64"] == 1
    for words in (
        f"when the sample moves by {reference.ULPS} float32 steps",
        f"moved copies ({by['float64']}, for float32 {by['float32']})",
        f"moved copies ({further['float64']}, by a float32 step; for float32 {further['float32']}, by "
        f"{reference.FURTHER_ULPS['float32']})",
    ):
        assert words in told, words


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
    moves = np.array([(job.sample_x, job.sample_y) for job in reference.perturbed(wanted, 8, 20, 4)]) - 0.5
    radii = np.hypot(moves[:, 0] / 100, moves[:, 1] / 50)
    assert len(moves) == 8
    assert np.allclose(radii, 4 * 2.0**-23 / 2, rtol=1e-6)
    assert np.all(moves.min(axis=0) < 0) and np.all(moves.max(axis=0) > 0)
    assert reference.perturbed(wanted, 8, 20, 4) == reference.perturbed(wanted, 8, 20, 4)
    assert not set(reference.perturbed(wanted, 8, 20, 4)) & set(
        reference.perturbed(wanted, *reference.others("float32"))
    )


def test_a_float32_picture_is_compared_at_its_own_epsilon():
    """Else the comparison measures epsilon: contact shadows begin that far out (OFF-1)."""
    assert reference.job_of(replace(SMALL, precision="float32")).epsilon == 2.0**-19
    assert reference.job_of(SMALL).epsilon == reference.job_of(replace(SMALL, precision="mp60")).epsilon == 2.0**-48
    assert reference.job_of(replace(SMALL, epsilon=1e-3)).epsilon == 1e-3


def test_a_float32_solid_is_compared_with_one_that_merges_as_it_does():
    """Else the comparison measures CSG-4: what is thinner than 16 u is not there. Rounding errs by 14 of these."""
    float32 = reference.job_of(replace(SMALL, precision="float32"))
    assert float32.sliver == 2.0**-20 and reference.job_of(float32) == float32
    assert reference.job_of(SMALL).sliver is None and "sliver" not in reference.job_of(SMALL).values()
    assert {job.sliver for job in reference.perturbed(float32, 4, 20, 4)} == {2 * 2.0**-24, 30 * 2.0**-24}


def stand_in(moved):
    """Answers to the jobs of a reference: grey, and `moved(number)` in the first pixels of the perturbed ones."""
    number = -1

    def run(*_, **__):
        nonlocal number
        number += 1
        picture = np.full((4, 5, 3), 0.5)
        if number:
            picture[0] += moved(number)
        return repetition.Result("ok", array=picture)

    return run


def test_what_perturbed_references_span(known, tmp_path):
    """The first row is up to 0.1 brighter and darker; of 4 further references two leave that and half its width."""
    moved = {**{k: (-1) ** k * 0.1 for k in range(1, 9)}, 9: 0.19, 10: 0.21, 11: -0.19, 12: -0.21}
    made = reference.make(known["numpy"], {}, replace(SMALL, width=5, height=4), (), tmp_path, stand_in(moved.get))
    assert made.mask.tolist() == [[True] * 5] + [[False] * 5] * 3
    np.testing.assert_allclose(made.span, np.broadcast_to([[[0.4]], [[0.6]]], (2, 5, 3)))
    assert made.left == (0, 5, 0, 5)
    again = reference.Reference.restored(*made.stored())
    assert again.left == made.left and again.span.tolist() == made.span.tolist()


def test_without_ill_conditioned_pixels_no_further_reference_is_made(known, tmp_path):
    calls = []
    run = stand_in(lambda number: calls.append(number) or 1e-6)
    made = reference.make(known["numpy"], {}, replace(SMALL, width=5, height=4), (), tmp_path, run)
    assert len(calls) == 8 and not made.mask.any() and made.left == () and made.span.shape == (2, 0, 3)


def test_a_reference_that_was_kept_without_its_span_is_not_taken(known, tmp_path):
    """Version 0.1 kept references under another key, without a span."""
    maker, version = known["cpp"], "scene"
    kept, job = cache.Kept(tmp_path), reference.job_of(SMALL)
    old = fingerprint({}, version, job, 8, maker.name, maker.renderer.version)
    arrays = {"reference": np.zeros((16, 16, 3)), "mask": np.zeros((16, 16), bool)}
    kept.put(old, {"maker": "cpp", "rays": None}, arrays)
    assert old != reference.key(maker, version, SMALL)
    assert reference.find(kept, known["python"], known, version, SMALL) is None
    made = reference.Reference("cpp", *arrays.values(), None, np.zeros((2, 0, 3)), ())
    kept.put(reference.key(maker, version, SMALL), *made.stored())
    assert reference.find(kept, known["python"], known, version, SMALL).maker == "cpp"


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


def test_many_rays_are_judged_by_a_compiled_renderer(known):
    """NumPy would take minutes where a compilation takes seconds."""
    arrays, needed = flatten(text.read(comparison(), "scene")), ("sphere", "reflection")
    for parameters, wanted in (
        (Parameters(width=512, height=512, depth=10), "numpy"),
        (Parameters(width=512, height=512, depth=10, precision="float32"), "numba"),
        (Parameters(width=512, height=512, depth=10, sampler="jittered", samples=4), "numba"),
        (Parameters(width=64, height=64, depth=6, glossy_rays=1), "numpy"),
        (Parameters(width=64, height=64, depth=6, glossy_rays=4), "numba"),
    ):
        judges = reference.judges_of(arrays, parameters)
        assert reference.choose(known["cpp"], known, parameters, needed, judges).name == wanted, parameters


def test_one_build_judges_any_scene(bench):
    cpp, job = bench.entry("cpp"), reference.job_of(SMALL)
    asked = reference.for_any_scene(cpp, job)
    builds = {cpp.renderer.build(asked, needed).folder for needed in (("sphere",), ("box", "mesh", "transmission"))}
    assert len(builds) == 1
    assert reference.for_any_scene(bench.known["numpy"], job) == job
