"""What tests of a hostile world share."""

import hostile
import pytest


@pytest.fixture
def fuzz(record_property):
    """fuzz(kind, try_one): hostile.fuzz, counted."""
    return lambda kind, try_one: hostile.fuzz(kind, try_one, record_property)


@pytest.fixture
def place():
    """A folder for the files of many cases."""
    with hostile.scratch() as folder:
        yield folder


@pytest.fixture
def injected(record_property):
    """injected(kind, count=1): so many faults of a kind were injected, and the test has looked at what came of them."""
    return lambda kind, count=1: record_property("fault", (kind, count))
