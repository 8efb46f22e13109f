"""Each feature alone and several mixed: every renderer against another, whatever its walk, threads or hierarchy."""

import conformance_spaces as spaces
import numpy as np
import pytest
from feature_scenes import features
from judged import Court
from nightly import by_night

from harness.judge import judge, reference
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs
from harness.system import cuda

SIZE = {"width": 26, "height": 22}
if cuda.simulated():
    SIZE = {"width": 13, "height": 10}  # a millisecond a ray
NAMES = [
    *("spheres", "transmission", "attenuation", "air", "media", "mesh", "open mesh", "csg", "csg mesh"),
    *("uniform", "jittered"),
    *("adaptive", "lens", "soft", "glossy", "glossy, the study's weight", "mix: glass, mirrors, shadows"),
    *("mix: glass mesh and solid in water", "mix: soft shadows and gloss through a lens", "mix: adaptive glass"),
    *("mix: jittered glass, soft shadows", "mix: all of it"),
]
JITTERED = "mix: jittered glass, soft shadows"
LATE = ("attenuation", "air", "open mesh", "uniform", "glossy, the study's weight", JITTERED)  # others have them too
MIXES = [name for name in NAMES if name.startswith("mix")]


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    found = features(tmp_path_factory.mktemp("meshes"))
    assert list(found) == NAMES
    return found


@pytest.fixture(scope="module")
def court(bench):
    return Court(bench)


@pytest.fixture(scope="module")
def reference_of(known, bench, scenes):
    made = {}

    def find(variant, name, parameters):
        scene = text.read(scenes[name][0], name)
        needed = needs(scene, parameters)
        # Python is slow, and sooner done with such small pictures than Numba with compiling for each.
        maker = reference.choose(known[variant], known, parameters, needed, ("python", "numpy", "cpp"))
        assert maker is not None
        key = name, maker.name, parameters.picture()
        if key not in made:
            made[key] = bench.reference(maker, flatten(scene), parameters, needed)
            assert isinstance(made[key], reference.Reference), made[key]
        return made[key]

    return find


@pytest.mark.parametrize("name", by_night(NAMES, *LATE))
def test_pictures_and_counts_agree(bench, reference_of, scenes, serial, name):
    """With kernels of what the scene needs and no more; C++ with one that has all: its own are in test_covering.py."""
    source, jobs = scenes[name]
    exact = not bench.known[serial].renderer.manifest.build
    result = bench.result(serial, source, exact=exact, **SIZE, **jobs)
    found = reference_of(serial, name, Parameters(**SIZE, **jobs))
    verdict = judge.judge(result.array, found, "float64")
    print(f"{serial} against {found.maker}: {verdict} {result.said.rays}")
    assert verdict.wrong is None, verdict.wrong
    assert verdict.mask_fraction < 0.35
    assert verdict.max_inside is not None or result.said.rays == found.rays, "nothing is ill-conditioned here"
    for kind, count in found.rays.items():
        # a ray that takes another way in an ill-conditioned pixel has at most so many descendants
        share = 1e-4 * count + (2 * found.mask.sum() if verdict.max_inside else 0)
        assert abs(result.said.rays[kind] - count) <= share, kind
    assert result.array.std() > 1e-3, "the scene shows nothing"


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("device", spaces.ON_DEVICES)
def test_devices_at_real_sizes(bench, court, scenes, device, name, precision):
    """Where their groups are many, and run at the same time."""
    source, job = scenes[name]
    job = {"width": 128, "height": 128, **job, "precision": precision}
    result = bench.result(device, source, exact=True, **job)
    assert court.wrong(("cpp",), text.read(source, name), Parameters(**job), result) is None


@pytest.mark.nightly("test_every_pair has each feature in float32 by day; Numba compiles a kernel for each case")
@pytest.mark.parametrize("name", MIXES[1:3])  # they have every feature but adaptive between them
def test_float32(bench, reference_of, scenes, serial, name):
    source, jobs = scenes[name]
    result = bench.result(serial, source, exact=True, **SIZE, **jobs, precision="float32")
    found = reference_of(serial, name, Parameters(**SIZE, **jobs, precision="float32"))
    verdict = judge.judge(result.array, found, "float32")
    assert verdict.wrong is None, verdict.wrong
    assert verdict.max_outside > 1e-9, "float32 that agrees to 1e-9 was computed in float64"


@pytest.mark.nightly("test_all_renderers_agree compares the bytes by day; Numba compiles 2 kernels for each case")
@pytest.mark.parametrize("name", ["media", "adaptive", "mix: all of it"])
def test_threads_change_no_byte(bench, known, scenes, name):
    """Of the serial twin's picture either."""
    source, jobs = scenes[name]
    for variant, entry in known.items():
        if entry.variant.threads == 1 or entry.renderer.manifest.name == "povray" or entry.unavailable:
            continue
        if entry.variant.exhibit:  # wrong on purpose
            continue
        if "box" not in entry.renderer.manifest.features:  # peers that know fewer shapes have tests of their own
            continue
        twin = bench.result(entry.renderer.manifest.variant[0].name, source, exact=True, **SIZE, **jobs)
        for threads in (1, 2, 5):
            result = bench.result(variant, source, exact=True, **SIZE, **jobs, threads=threads)
            assert result.array.tobytes() == twin.array.tobytes(), f"{variant} on {threads} threads"
            assert result.said.rays == twin.said.rays


@pytest.mark.parametrize("walk", ["recursion", "table", "stack"])
@pytest.mark.parametrize("name", by_night(["media", "glossy", JITTERED], JITTERED))
def test_every_walk_makes_the_same_picture(bench, scenes, serial, name, walk):
    source, jobs = scenes[name]
    least = bench.result(serial, source, exact=True, **SIZE, **jobs)
    other = bench.result(serial, source, exact=True, **SIZE, **jobs, walk=walk)
    np.testing.assert_allclose(other.array, least.array, rtol=0, atol=1e-12)
    assert other.said.rays == least.said.rays
    assert other.said.used["methods"]["walk"] == walk
    if walk != "recursion":
        depth, branches = jobs["depth"], max(jobs.get("glossy_rays", 0), 1) + (name != "glossy")
        rows = other.said.used["methods"]["walk_rows"]
        if walk == "stack":
            assert rows == 1 + depth * (branches - 1)
        else:
            assert rows == sum(max(branches, 2) ** order for order in range(depth + 1))
        assert other.said.used["methods"]["walk_bytes"] >= rows * 8


def test_a_chain_is_the_least_for_mirrors(bench, scenes, serial):
    source, jobs = scenes["mesh"]
    least = bench.result(serial, source, exact=True, **SIZE, **jobs)
    assert least.said.used["methods"]["walk"] in ("chain", "wavefront")
    for walk in ("chain", "stack", "table"):
        other = bench.result(serial, source, exact=True, **SIZE, **jobs, walk=walk)
        np.testing.assert_allclose(other.array, least.array, rtol=0, atol=1e-12)


def refused(bench, known, variant, source, **parameters):
    """The reason with which a variant refuses a job."""
    from harness.process import repetition

    entry = bench.entry(variant)
    scene = text.read(source, "refused")
    wanted = Parameters(**parameters)
    needed = needs(scene, wanted)
    if repetition.unsupported(entry, wanted, needed):
        pytest.skip("the manifest says so already")
    result = bench.run(entry, flatten(scene), wanted, needed)
    assert result.status == "unsupported", (result.status, result.reason, result.stderr)
    return result.reason


def test_a_chain_cannot_follow_glass(bench, known, scenes, serial):
    source, jobs = scenes["transmission"]
    assert "chain" in refused(bench, known, serial, source, **SIZE, **jobs, walk="chain")


def test_no_table_of_80_gigabytes(bench, known, scenes, serial):
    """d = 10 takes a table for one pixel, not for all; d = 30 is refused with the number of bytes (WLK-2)."""
    source = scenes["transmission"][0]
    entry = bench.entry(serial)
    if "table" not in entry.renderer.manifest.methods.get("walk", ()):
        pytest.skip("has no table")
    result = bench.result(serial, source, width=3, height=2, depth=10, walk="table")
    assert result.said.used["methods"]["walk_rows"] == 2**11 - 1
    assert result.said.memory["peak_bytes"] < 400 * 2**20
    reason = refused(bench, known, serial, source, width=3, height=2, depth=30, walk="table")
    assert any(char.isdigit() for char in reason)


def test_what_was_built_is_what_was_needed(bench, scenes, serial):
    source, jobs = scenes["media"]
    result = bench.result(serial, source, exact=True, **SIZE, **jobs)
    wanted = needs(text.read(source, "media"), Parameters(**SIZE, **jobs))
    assert set(result.said.used["features"]) == set(wanted)
    assert "soft" not in wanted and "media" in wanted
