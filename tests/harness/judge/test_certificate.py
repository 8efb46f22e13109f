"""Spots in 60 digits: a right picture is certified, and a wrong one is not."""

import numpy as np
import pytest

from harness.judge import certificate, reference
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.generate.comparison import comparison
from harness.scene.needs import needs

JOB = Parameters(width=24, height=20, depth=3, shadows=True, region=(3, 2, 21, 19))


@pytest.fixture(scope="module")
def made(known, tmp_path_factory):
    scene = text.read(comparison(12, 2))
    needed, arrays = needs(scene, JOB), flatten(scene)
    maker = reference.choose(known["python"], known, JOB, needed)
    return reference.make(maker, arrays, JOB, needed, tmp_path_factory.mktemp("cache")), arrays, needed


def ask(known, made, picture, mask, asked=20, seconds=60.0):
    _, arrays, needed = made
    return certificate.certify(picture, mask, known, arrays, reference.job_of(JOB), needed, asked, seconds)


def test_a_right_picture_is_certified(known, made):
    found = ask(known, made, made[0].picture, made[0].mask)
    assert (found["spots"], found["asked"], found["wrong"], found["digits"]) == (20, 20, 0, 60)
    assert 0 < found["largest"] < 1e-12


def test_a_wrong_pixel_is_found(known, made):
    """All pixels but one are in the mask, so that one is the spot."""
    picture, mask = made[0].picture.copy(), np.ones(made[0].mask.shape, bool)
    mask[5, 7] = False
    assert ask(known, made, picture, mask)["wrong"] == 0
    picture[5, 7, 1] += 1e-9
    found = ask(known, made, picture, mask)
    assert found["spots"] == 1 and found["wrong"] == 1 and found["largest"] == pytest.approx(1e-9, rel=1e-3)


def test_no_more_than_there_is_time_for(known, made):
    found = ask(known, made, made[0].picture, made[0].mask, seconds=1e-3)
    assert found == {"unavailable": "no spot was done in 0.001 s"}


def test_why_there_is_none(known, made):
    reference_made, *_ = made
    everything = np.ones(reference_made.mask.shape, bool)
    assert ask(known, made, reference_made.picture, everything) == {"unavailable": "every pixel is in the mask"}
    blind = {"cpp": known["cpp"]}
    assert "no renderer here" in ask(blind, made, reference_made.picture, reference_made.mask)["unavailable"]
