"""PSNR, SSIM and FLIP against numbers that are known otherwise, and where they are blind or undefined."""

import math
import os

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from harness.picture import colour
from harness.picture.perception import C1, C2, SIGMA, WINDOW, perceive

SIZE = 64
RAMP = np.stack(np.broadcast_arrays(*np.meshgrid(*[np.linspace(0.1, 0.9, SIZE)] * 2), 0.5), axis=-1)  # of sRGB
LINEAR = colour.decode(RAMP)


def test_equal_pictures():
    found = perceive(LINEAR, LINEAR.copy())
    assert found.record() == {
        "psnr_db": {"unavailable": "infinite: the display shows no difference"}, "ssim": 1.0, "flip": 0.0,
    }  # fmt: skip
    assert found.flip_map.shape == (SIZE, SIZE) and not found.flip_map.any()


def test_psnr_by_hand():
    """One channel of one pixel off by half of the range."""
    codes = RAMP.copy()
    codes[10, 20, 1] += 0.5 if codes[10, 20, 1] < 0.5 else -0.5
    found = perceive(colour.decode(codes), LINEAR)
    assert found.psnr_db == pytest.approx(10 * math.log10(3 * SIZE**2 / 0.25), abs=1e-9)
    assert 0.99 < found.ssim < 1 and found.flip < 0.005
    assert np.unravel_index(found.flip_map.argmax(), found.flip_map.shape) == (10, 20)
    assert found.flip == pytest.approx(found.flip_map.mean(), rel=1e-5)


def test_one_step_everywhere_is_hardly_seen():
    found = perceive(colour.decode(RAMP + 1 / 255), LINEAR)
    assert found.psnr_db == pytest.approx(20 * math.log10(255), abs=1e-6) and found.ssim > 0.999 and found.flip < 0.05


def test_ssim_is_that_of_scipy_s_filter():
    seed = int.from_bytes(os.urandom(4))
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    a = rng.random((40, 57, 3))
    b = np.clip(a + rng.normal(0, 0.2, a.shape), 0, 1)
    half = WINDOW // 2

    def blur(values):
        return gaussian_filter(values, (SIGMA, SIGMA, 0), radius=(half, half, 0))[half:-half, half:-half]

    x, y = blur(a), blur(b)
    variances, covariance = blur(a * a) - x**2 + blur(b * b) - y**2, blur(a * b) - x * y
    truth = ((2 * x * y + C1) * (2 * covariance + C2) / ((x**2 + y**2 + C1) * (variances + C2))).mean()
    assert perceive(a, b, "srgb").ssim == pytest.approx(truth, abs=1e-12) and truth < 0.95


def test_black_beside_white():
    found = perceive(np.zeros((SIZE, SIZE, 3)), np.ones((SIZE, SIZE, 3)))
    assert found.psnr_db == pytest.approx(0, abs=1e-9) and found.ssim < 0.01 and found.flip > 0.9


def test_what_no_display_shows_is_no_difference():
    """Beyond the range, and what arithmetic on sRGB holds is shown as it is."""
    bright, brighter = np.full((SIZE, SIZE, 3), 1.5), np.full((SIZE, SIZE, 3), 40.0)
    assert perceive(bright, brighter).flip == 0 and perceive(-bright, -brighter).flip == 0
    codes = perceive(RAMP + 1 / 255, RAMP, "srgb")
    assert codes.psnr_db == pytest.approx(20 * math.log10(255), abs=1e-6)


@pytest.mark.parametrize("shape", [(1, 1), (10, 40), (40, 10)])
def test_small_pictures_have_no_ssim(shape):
    found = perceive(LINEAR[: shape[0], : shape[1]] * 0.9, LINEAR[: shape[0], : shape[1]])
    assert "smaller than its window of 11 x 11" in found.ssim["unavailable"]
    assert found.flip > 0 and found.psnr_db > 0


def test_the_picture_may_be_float32():
    found = perceive(LINEAR.astype(np.float32), LINEAR)
    assert found.psnr_db > 100 and found.flip < 1e-4
