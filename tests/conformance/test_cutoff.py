"""CUT-1 to CUT-4: what a cut-off drops is what it says, and the picture stays within the bound that follows from it."""

import math

import numpy as np
import pytest
from feature_scenes import features
from nightly import by_night
from random_scenes import random_material, random_scene, random_stage, words
from stage import camera, close, reflectance, square, turned

from harness.judge import bound
from harness.process import repetition
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs

NAMES = [
    *("attenuation", "media", "glossy", "glossy, the study's weight", "mix: glass, mirrors, shadows"),
    *("mix: soft shadows and gloss through a lens", "mix: jittered glass, soft shadows", "mirrors 31", "mirrors 32"),
    "uniform mirrors 33",
]
MIX, MIRRORS = NAMES[4], NAMES[-1]
LATE = ("glossy, the study's weight", "mix: jittered glass, soft shadows", "mirrors 31", MIRRORS)
CUTOFFS = (2.0**-3, 2.0**-7)
ROUNDING = {"float64": 1e-12, "float32": 1e-5}


def mirrors(seed):
    rng = np.random.default_rng(seed)
    return random_scene(rng, 5, 3, 3, 3, material=random_material, rest=random_stage(rng))


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    """{name: (scene text, parameters)}; a number in a name is the seed."""
    found = features(tmp_path_factory.mktemp("meshes"))
    for name in NAMES:
        if name not in found:
            samples = {"sampler": "uniform", "samples": 2} if "uniform" in name else {}
            found[name] = mirrors(int(name.split()[-1])), {"depth": 6, "shadows": False, **samples}
    return {name: found[name] for name in NAMES}


@pytest.fixture
def make(bench, scenes):
    """The Result of a scene by its name, of a size that suits the variant."""

    def result(variant, name, **parameters):
        side = bench.by_speed(variant, 10, 24)
        source, jobs = scenes[name]
        return bench.result(variant, source, **{"width": side, "height": side - 2, **jobs, **parameters})

    return result


def traced(result):
    return {kind: result.said.rays[kind] for kind in ("reflected", "transmitted", "shadow")}


def check_bound(source, depth, whole, cut, slack):
    """Every pixel and channel lies below the whole picture, by L_1 times its dropped weight at most (CUT-3)."""
    limit = bound.radiance(flatten(text.read(source, "cut off")), depth) * cut.dropped[..., None]
    lost = whole.array.astype(float) - cut.array
    print(f"lost up to {lost.max():.3g}, bound up to {limit.max():.3g}, rays {whole.said.rays} {cut.said.rays}")
    assert lost.min() >= -slack, "a cut-off adds no light"
    assert (lost - limit).max() <= slack
    assert cut.said.rays["primary"] == whole.said.rays["primary"]
    assert all(traced(cut)[kind] <= traced(whole)[kind] for kind in traced(cut))


@pytest.mark.parametrize("name", by_night(NAMES, *LATE))
def test_the_bound_holds_for_every_pixel_and_fewer_rays_drop_more(make, scenes, serial, name):
    source, jobs = scenes[name]
    whole, coarse, fine = (make(serial, name, cutoff=cutoff) for cutoff in (0.0, *CUTOFFS))
    for cut in (coarse, fine):
        check_bound(source, jobs["depth"], whole, cut, ROUNDING["float64"])
    assert coarse.dropped.max() > 0
    assert sum(traced(coarse).values()) < sum(traced(whole).values())
    assert all(traced(coarse)[kind] <= traced(fine)[kind] for kind in traced(fine))
    # the weights of the rays that leave a hit are at most that of the ray that came (A <= 1, k_s <= 1, R + T = 1)
    assert (coarse.dropped - fine.dropped).min() >= -ROUNDING["float64"]
    assert whole.dropped is None
    assert coarse.said.used["methods"]["cutoff"] == CUTOFFS[0]
    assert "cutoff" not in whole.said.used["methods"]


@pytest.mark.parametrize("name", by_night([MIX, "glossy"], MIX))
def test_float32(make, scenes, serial, name):
    source, jobs = scenes[name]
    whole, cut = (make(serial, name, cutoff=cutoff, precision="float32") for cutoff in (0.0, CUTOFFS[1]))
    check_bound(source, jobs["depth"], whole, cut, ROUNDING["float32"])
    exact = make(serial, name, cutoff=CUTOFFS[1])
    off = np.abs(cut.dropped - exact.dropped)
    assert off.max() > 1e-12, "float32 that agrees to 1e-12 was computed in float64"
    assert np.median(off) < 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_weights_and_counts_agree(bench, make, known, serial, name):
    """With those of the renderer to read, and its own with another's."""
    other = "cpp" if serial == "python" else "python"
    size = {"width": 10, "height": 8, "depth": 3, "cutoff": 2.0**-5}
    mine, theirs = make(serial, name, **size), make(other, name, **size)
    print(f"{serial} against {other}: off by {np.abs(mine.dropped - theirs.dropped).max():.3g}")
    np.testing.assert_allclose(mine.dropped, theirs.dropped, rtol=0, atol=1e-12)
    np.testing.assert_allclose(mine.array, theirs.array, rtol=0, atol=1e-9)
    assert mine.said.rays == theirs.said.rays
    assert theirs.dropped.max() > 0


@pytest.mark.parametrize("name", ["mix: glass, mirrors, shadows", "uniform mirrors 33", "glossy"])
def test_a_tiny_cutoff_changes_no_byte(make, serial, name):
    whole, tiny = make(serial, name), make(serial, name, cutoff=1e-300)
    assert tiny.array.tobytes() == whole.array.tobytes()
    assert tiny.said.rays == whole.said.rays
    assert tiny.dropped.shape == whole.array.shape[:2] and not tiny.dropped.any()


def test_a_region_has_the_weights_of_the_whole(make, serial):
    whole = make(serial, "uniform mirrors 33", cutoff=CUTOFFS[0])
    part = make(serial, "uniform mirrors 33", cutoff=CUTOFFS[0], region=(2, 3, 9, 7))
    assert part.dropped.tobytes() == whole.dropped[3:7, 2:9].tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", [MIRRORS, "glossy", MIX])
def test_threads_change_no_byte(bench, make, known, name):
    """Of the serial twin's picture and weights either."""
    for variant, entry in known.items():
        if entry.variant.threads == 1 or "cutoff" not in entry.renderer.manifest.features or entry.unavailable:
            continue
        if entry.variant.exhibit:  # of a fault
            continue
        twin = make(entry.renderer.manifest.variant[0].name, name, cutoff=CUTOFFS[1])
        height, width = twin.array.shape[:2]
        for threads in (1, 2, 5):
            result = make(variant, name, cutoff=CUTOFFS[1], threads=threads, width=width, height=height)
            assert result.array.tobytes() == twin.array.tobytes(), f"{variant} on {threads} threads"
            assert result.dropped.tobytes() == twin.dropped.tobytes(), f"{variant} on {threads} threads"
            assert result.said.rays == twin.said.rays


@pytest.mark.parametrize("walk", ["recursion", "table"])
def test_walks_that_know_no_weight_refuse(bench, scenes, serial, walk):
    """CUT-4"""
    entry = bench.entry(serial)
    source, jobs = scenes["media"]
    scene, wanted = text.read(source, "refused"), Parameters(width=4, height=4, **jobs, walk=walk, cutoff=0.1)
    needed = needs(scene, wanted)
    reason = repetition.unsupported(entry, wanted, needed)
    if reason:
        pytest.skip(f"{serial} {reason}")
    result = bench.run(entry, flatten(scene), wanted, needed)
    assert result.status == "unsupported", (result.status, result.reason, result.stderr)
    assert "cutoff" in result.reason or "cut-off" in result.reason


WHITE = "BACKGROUND (1,1,1)\n"
ONE = {"width": 1, "height": 1, "depth": 4}


@pytest.fixture
def turn():
    print("seed 12")
    return turned(np.random.default_rng(12))


def mirror_scene(turn, k_s, extra="", roughness=0):
    """A mirror of index 3 met at 40 degrees after a distance of 2, before a white background; its reflectance."""
    angle = math.radians(40)
    way = np.array([math.sin(angle), 0, -math.cos(angle)])
    source = camera(turn, -2 * way, 1e-9, towards=way) + WHITE + extra
    source += square(turn, (0, 0, 0), (60, 0, 0), (0, 60, 0), f"(0,0,0) {k_s} 1 (0,0,0) 9 1 {roughness}")
    return source, reflectance(3.0, math.cos(angle))


def test_one_mirror_reaches_the_bound(bench, serial, turn):
    source, share = mirror_scene(turn, 0.3)
    whole, cut = bench.result(serial, source, **ONE), bench.result(serial, source, **ONE, cutoff=0.5)
    close(cut.dropped, 0.3 * share)
    close(cut.array, 0)
    limit = bound.radiance(flatten(text.read(source, "one mirror")), ONE["depth"])
    close(limit * cut.dropped[..., None], whole.array)
    assert traced(cut) == {"reflected": 0, "transmitted": 0, "shadow": 0}


def test_the_clearest_channel_counts(bench, serial, turn):
    """ATT-1 on the way to the mirror: a ray is kept as long as one of its channels is worth it."""
    source, share = mirror_scene(turn, 0.9, "AIR 1 1 (0.3,0.8,0.5)\n")
    weight = 0.8**2 * 0.9 * share
    close(bench.result(serial, source, **ONE, cutoff=1.001 * weight).dropped, weight)
    kept = bench.result(serial, source, **ONE, cutoff=0.999 * weight)
    close(kept.dropped, 0)
    close(kept.array, np.array([0.3, 0.8, 0.5]) ** 2 * 0.9 * share)


@pytest.mark.parametrize("glossy", [{}, {"glossy_rays": 4, "seed": 3}])
def test_each_lobe_ray_is_weighed_by_itself(bench, serial, turn, glossy):
    source, share = mirror_scene(turn, 0.8, roughness=0.5)
    weight = 0.8 * share / glossy.get("glossy_rays", 1)
    cut = bench.result(serial, source, **ONE, **glossy, cutoff=1.001 * weight)
    close(cut.dropped, 0.8 * share)
    kept = bench.result(serial, source, **ONE, **glossy, cutoff=0.999 * weight)
    close(kept.dropped, 0)
    assert kept.said.rays["reflected"] == glossy.get("glossy_rays", 1)


def test_weights_multiply_and_the_cutoff_itself_is_cut(bench, serial, turn):
    """Total reflection between two parallel mirrors, R = 1: weights 1/2 and 1/4 exactly, then the white background."""
    way = np.array([math.sqrt(0.75), 0, -0.5])
    mirror = "(0,0,0) 0.5 1 (0,0,0) 1 1"
    source = camera(turn, -2 * way, 1e-9, towards=way) + WHITE + "AIR 4 1 (1,1,1)\n"
    source += square(turn, (0, 0, 0), (0.2, 0, 0), (0, 0.2, 0), mirror)
    source += square(turn, (math.sqrt(3), 0, 1), (0.2, 0, 0), (0, 0.2, 0), mirror)
    for cutoff, colour, dropped, reflected in (
        (np.nextafter(0.25, 0), 0.25, 0, 2),
        (0.25, 0, 0.25, 1),
        (np.nextafter(0.5, 0), 0, 0.25, 1),
        (0.5, 0, 0.5, 0),
    ):
        cut = bench.result(serial, source, **ONE, cutoff=float(cutoff))
        close(cut.array, colour)
        close(cut.dropped, dropped)
        assert cut.said.rays["reflected"] == reflected


def test_what_a_glass_ball_reflects_is_cut(bench, serial, turn):
    """Through its middle: R is cut where the ray enters and where it leaves, T goes on."""
    source = camera(turn, (0, 0, 5), 1e-9) + WHITE + f"SPHERE {words(turn @ (0, 0, 0))} 1 (0,0,0) 1 1 (1,1,1) 2.25 1\n"
    share = reflectance(1.5, 1.0)
    cut = bench.result(serial, source, **ONE, cutoff=0.1)
    close(cut.dropped, share + (1 - share) * share)
    close(cut.array, (1 - share) ** 2)
    assert traced(cut) == {"reflected": 0, "transmitted": 2, "shadow": 0}


@pytest.mark.parametrize("sampler", ["uniform", "jittered"])
def test_the_mean_of_the_samples(bench, serial, turn, sampler):
    """Half of a pixel's samples meet the mirror, half the background: SAM-3 for weights."""
    source = camera(turn, (0, 0, 1), 1e-3) + WHITE
    source += square(turn, (5, 0, 0), (5, 0, 0), (0, 5, 0), "(0,0,0) 0.3 1 (0,0,0) 9 1")
    cut = bench.result(serial, source, width=1, height=1, depth=2, sampler=sampler, samples=2, cutoff=0.5)
    assert abs(cut.dropped[0, 0] - 0.3 * reflectance(3.0, 1.0) / 2) < 1e-6
    assert abs(cut.array[0, 0, 0] - 0.5) < 1e-12
