"""Drawn cases have a budget of time by day (tests/support/hostile.py)."""

import hostile
import pytest


@pytest.fixture(autouse=True)
def no_time(monkeypatch):
    monkeypatch.setattr(hostile, "BUDGET", 0.0)
    monkeypatch.setattr(hostile, "CASES", 1000)


def test_the_least_is_tried_and_counted():
    drawn, properties = [], []
    hostile.fuzz("numbers", lambda random: drawn.append(random.random()), lambda *words: properties.append(words))
    assert len(drawn) == hostile.LEAST and properties == [("hostile", ("numbers", hostile.LEAST, hostile.SEED))]


def test_what_fails_is_made_small_after_the_time_too(monkeypatch):
    """Cases that pass while it is made small do not end it."""
    monkeypatch.setattr(hostile, "LEAST", 10)

    def try_one(random):
        assert random.randint(0, 999) < 700

    with pytest.raises(AssertionError):
        hostile.fuzz("numbers", try_one, lambda *_: pytest.fail("it passed"))


def test_at_night_there_is_none(monkeypatch):
    monkeypatch.setattr(hostile, "CASES", 1100)
    properties = []
    hostile.fuzz("numbers", lambda random: random.random(), lambda *words: properties.append(words))
    assert properties == [("hostile", ("numbers", 1100, hostile.SEED))]
