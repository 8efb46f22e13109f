"""The CPU time of a frame, from a series whose numbers can be checked by hand."""

import pytest

from harness.race import row
from harness.renderer.events import Said


def said(*frames):
    """frames: (start, end, renders) on the clock."""
    return Said(frames=[{"start": start, "end": end, "renders": renders} for start, end, renders in frames])


@pytest.fixture
def series(tmp_path):
    """A function that writes a series of (t, cpu_s)."""

    def write(*rows):
        path = tmp_path / "series.csv"
        path.write_text("t,cpu_s\n" + "".join(f"{t},{cpu}\n" for t, cpu in rows))
        return path

    return write


SPAWNED = 100.0
# Frame 0, then four of 2 renders: the second was interrupted, and took three times as long.
FRAMES = (100.0, 109.0, 1), (110.0, 111.0, 2), (111.0, 114.0, 2), (114.0, 115.0, 2), (115.0, 116.0, 2)


def test_the_cpu_time_between_the_first_and_the_last_reading_within_frames(series):
    """From the middle of frame 1 to that of frame 4 are 6 renders; readings before and after do not count."""
    path = series((9.9, 8.0), (10.5, 9.0), (12.5, 10.0), (15.5, 12.0), (16.5, 90.0))
    assert row.frame_cpu(said(*FRAMES), SPAWNED, path) == pytest.approx(3 / 6)


def test_too_few_readings_tell_nothing(series, tmp_path):
    assert row.frame_cpu(said(*FRAMES), SPAWNED, series((9.9, 8.0), (12.5, 10.0), (17.0, 12.0))) is None
    assert row.frame_cpu(said(*FRAMES[:1]), SPAWNED, series((1.0, 1.0), (2.0, 2.0))) is None
    assert row.frame_cpu(said(*FRAMES), SPAWNED, tmp_path / "none.csv") is None


def test_warm_up_is_no_part_of_it(series):
    """The first five of thirty frames take ten times as long; the rest take 1 s, of which 0.5 s on the processor."""
    begun, frames = 100.0, [(99.0, 100.0, 1)]
    for length in [10.0] * 5 + [1.0] * 25:
        frames.append((begun, begun + length, 1))
        begun += length
    ticks = [(t, 3.0 * t) for t in range(50)] + [(t, 150.0 + 0.5 * (t - 50)) for t in range(50, 76)]
    assert row.frame_cpu(said(*frames), SPAWNED, series(*ticks)) == pytest.approx(0.5)
