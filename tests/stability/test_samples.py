"""S26 to S28: what samples of a pixel miss, and how their sum rounds."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from harness import stress
from harness.stress.job import Stressed
from harness.stress.light import samples
from harness.stress.row import ROUNDOFF

SEED = 20201107
PRECISIONS = ("float32", "float64")


def trial(row, level, precision="float64"):
    return Stressed(stress.rows()[row], level, precision, SEED).trial


def judged(made, array):
    return made.judge(SimpleNamespace(array=np.asarray(array)))


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("sampler", ["uniform", "jittered"])
@pytest.mark.parametrize("level", [0.5, 3.0, 50.0])
def test_a_grid_keeps_the_light_of_a_wire(strain, serial, level, sampler, precision):
    finding = strain(serial, "thin", level, precision, SEED, sampler=sampler)
    assert finding.failures == 0 and finding.count == 3


@pytest.mark.parametrize("precision", PRECISIONS)
def test_an_adaptive_sampler_keeps_a_wire_wider_than_a_pixel(strain, serial, precision):
    assert strain(serial, "thin", 0.5, precision, SEED, sampler="adaptive").failures == 0


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize(("level", "lost"), [(5.0, 0.3), (10.0, 0.7), (50.0, 0.9)])
def test_an_adaptive_sampler_loses_a_thin_wire(strain, serial, level, lost, precision):
    """The corners of the pixels, by which it decides, are a pixel apart."""
    finding = strain(serial, "thin", level, precision, SEED, sampler="adaptive")
    assert finding.failures == finding.count
    assert np.median(finding.errors) > lost


def test_the_light_of_wires_by_counting():
    """The areas against 3 million points of the picture: those within half a width of the middle of a wire."""
    made, side = trial("thin", 2.0), samples.SIDE
    x = (np.arange(1800) + 0.5) / 1800 * side
    places = np.stack(np.meshgrid(x, x), axis=-1)
    covered = np.zeros(3)
    for k, wire in enumerate(made.scene.objects):
        a, b, _, d = samples.places(made.scene.camera, wire.vertices)
        aside = d - a - ((d - a) @ (b - a)) / ((b - a) @ (b - a)) * (b - a)
        share = (places - a) @ aside / (aside @ aside)
        covered[k] = ((share >= 0) & (share <= 1)).mean() * side**2
    finding = judged(made, np.broadcast_to(covered / side**2, (side, side, 3)))
    assert finding.failures == 0 and finding.errors.max() < 1e-3
    dark = judged(made, np.zeros((side, side, 3)))
    assert dark.failures == 3 and dark.errors.tolist() == [1, 1, 1]
    assert judged(made, np.full((side, side, 3), np.nan)).failures == 3


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize(("sampler", "level"), [("one", 10), ("uniform", 10), ("uniform", 300), ("jittered", 30)])
def test_a_wide_highlight_is_sampled(strain, serial, sampler, level, precision):
    finding = strain(serial, "glint", level, precision, SEED, sampler=sampler)
    assert finding.failures == 0 and finding.count == 9


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize(("sampler", "level"), [("one", 300), ("uniform", 1e5), ("jittered", 1e4), ("uniform", 1e7)])
def test_a_glint_falls_between_the_samples(strain, serial, sampler, level, precision):
    finding = strain(serial, "glint", level, precision, SEED, sampler=sampler)
    assert finding.failures > 0.8 * finding.count


@pytest.mark.parametrize("exponent", [1e2, 1e4, 1e7])
def test_the_light_of_a_glint(exponent, monkeypatch):
    """That of a small highlight is known in closed form; and twice the nodes change it by less than 1e-6."""
    made = trial("glint", exponent)
    (ball,) = made.scene.objects
    middle = [[4.5, 4.5]]
    point, normal, way = samples.touched(made.scene.camera, ball, *np.transpose(middle))
    mirrored = way - 2 * (way * normal).sum() * normal
    light = SimpleNamespace(position=(point + 1e6 * mirrored)[0])
    found = samples.highlights(made.scene.camera, ball, [light], middle)
    turns = 2 + 1 / (samples.DISTANCE - 1)  # the angle between r and -d in an angle of the ball
    radius = samples.BALL * samples.DISTANCE / (samples.DISTANCE - 1)  # in pixels, as far away as the highlight
    known = radius**2 * 2 * math.pi / (exponent * turns**2)
    assert found.sum() == pytest.approx(known, rel=3 / exponent + 1e-5)
    monkeypatch.setattr(samples, "NODES", np.polynomial.legendre.leggauss(20)[0])
    monkeypatch.setattr(samples, "WEIGHTS", np.polynomial.legendre.leggauss(20)[1])
    np.testing.assert_allclose(samples.highlights(made.scene.camera, ball, [light], middle), found, rtol=0, atol=1e-6)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("level", [4, 64, int(np.random.default_rng(SEED).integers(5, 64))])
def test_a_sum_of_rows_keeps_a_colour(strain, serial, level, precision):
    finding = strain(serial, "sums", level, precision, SEED)
    assert finding.failures == 0
    if precision == "float32":
        assert finding.errors.max() < 2.1 * (level + 2) * ROUNDOFF[precision]


@pytest.mark.parametrize(("level", "off"), [(64, 1e-5), (512, 1e-3)])
def test_one_sum_of_all_samples_drifts(level, off):
    """As float32 adds up: what is added is small beside what is there."""
    made = trial("sums", level, "float32")
    colour = samples.colour.decode_exactly(made.scene.objects[0].material.diffuse).astype(np.float32)
    all_samples = np.broadcast_to(colour, (level**2, 3))
    one_sum = np.add.accumulate(all_samples, axis=0)[-1] / np.float32(level**2)
    rows = np.add.accumulate(all_samples[:level], axis=0)[-1]
    of_rows = np.add.accumulate(np.broadcast_to(rows, (level, 3)), axis=0)[-1] / np.float32(level**2)
    drifted, kept = (judged(made, np.broadcast_to(pixel, (2, 2, 3))) for pixel in (one_sum, of_rows))
    assert drifted.failures >= 8 and drifted.errors.max() > off
    assert kept.failures == 0
