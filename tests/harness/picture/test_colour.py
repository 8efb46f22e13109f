"""COL-2, COL-3. The bounds are of the two published formulas, which do not quite meet."""

import decimal

import numpy as np
import pytest

from harness.picture import colour


def test_known_values():
    half = 0.21404114048
    assert colour.decode([0, 0.04045, 0.5, 1]) == pytest.approx([0, 0.04045 / 12.92, half, 1], abs=1e-11)
    assert colour.encode([0, 0.0031308, half, 1]) == pytest.approx([0, 0.040449936, 0.5, 1], abs=1e-9)


def test_decoding_exactly_is_correctly_rounded():
    """To the last bit, against 60 digits of the decimal module; `decode` is beside it in some values."""
    seed = np.random.SeedSequence().entropy
    print("seed", seed)
    srgb = np.random.default_rng(seed).uniform(0, 2, (5, 20, 3))
    found = colour.decode_exactly(srgb)
    assert found.shape == srgb.shape and np.abs(found / colour.decode(srgb) - 1).max() < 3e-16
    exponent = decimal.Decimal.from_float(2.4)
    with decimal.localcontext(prec=60):
        for value, linear in zip(srgb.ravel().tolist(), found.ravel().tolist(), strict=True):
            base = decimal.Decimal((value + 0.055) / 1.055)
            assert linear == (value / 12.92 if value <= 0.04045 else float(base**exponent))
    assert colour.decode_exactly([0.04045, 0.0, -0.1]).tolist() == [0.04045 / 12.92, 0.0, -0.1 / 12.92]
    assert colour.decode_exactly(np.empty((0, 3))).shape == (0, 3)


def test_formulas_meet_at_the_joints():
    above = np.nextafter(0.04045, 1)
    assert 0 < colour.decode(above) - colour.decode(0.04045) < 2.4e-9
    above = np.nextafter(0.0031308, 1)
    assert 0 < colour.encode(0.0031308) - colour.encode(above) < 2.9e-8


def test_round_trip():
    x = np.linspace(0, 1, 100_001)
    assert np.abs(colour.encode(colour.decode(x)) - x).max() < 3e-8


@pytest.mark.parametrize("precision", [np.float64, np.float32])
def test_all_codes_round_trip(precision):
    codes = np.arange(256, dtype=np.uint8)
    linear = colour.decode(codes / 255).astype(precision)
    assert np.array_equal(colour.encode_8bit(linear), codes)


def test_nothing_is_clamped_before_8_bits():
    assert colour.decode(2.0) > 4
    assert colour.encode(4.0) > 1.8
    assert colour.encode(-0.1) == pytest.approx(-1.292)
    assert colour.encode_8bit([-5, 0, 1, 1e30]).tolist() == [0, 0, 255, 255]


def test_shape_is_kept():
    assert colour.decode(np.zeros((4, 5, 3))).shape == (4, 5, 3)
    assert colour.encode_8bit(np.zeros((0, 3))).shape == (0, 3)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("function", [colour.encode, colour.encode_8bit])
def test_non_finite_is_an_error(function, bad):
    with pytest.raises(ValueError, match="NaN or infinite"):
        function([0.5, bad])
