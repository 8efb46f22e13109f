"""Places of later frames and checksums of their pictures, as SPEC.md has them."""

import numpy as np

from harness.renderer import places


def test_places_lie_about_that_of_the_job():
    """In a sixteenth of the pixel, all of one job apart."""
    found = [places.place((123, 456), frame, render, (0.5, 0.5)) for frame in (1, 2, 3) for render in range(400)]
    assert len(set(found)) == len(found)
    assert all(15 / 32 <= value < 17 / 32 for place in found for value in place)
    low, high = np.min(found, axis=0), np.max(found, axis=0)
    assert (high - low > 0.99 / 16).all(), "they fill it"
    for sample in ((0.0, 0.999), (0.25, 0.75)):
        assert all(0 <= value < 1 for value in places.place((2**32 - 1, 0), 7, 4095, sample))


def test_a_checksum_is_of_the_numbers_alone():
    picture = np.arange(24.0).reshape(2, 4, 3)
    assert places.checksum(picture) == places.checksum(picture.copy(order="F")) == places.checksum(picture.ravel())
    assert places.checksum(picture) != places.checksum(picture.astype(np.float32))
    assert places.checksum(np.frombuffer(b"123456789", np.uint8)) == "cbf43926"
    assert len(places.checksum(np.zeros(0))) == places.DIGITS
