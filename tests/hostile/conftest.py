"""What tests of a hostile world share; and how many cases and faults there were, at the end of pytest's output."""

from collections import Counter

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


def pytest_terminal_summary(terminalreporter):
    for name, what in (("hostile", "hostile cases"), ("fault", "faults injected")):
        counts = Counter()
        for report in terminalreporter.getreports("passed"):
            if report.when == "call":
                for key, value in report.user_properties:
                    if key == name:
                        counts[value[0]] += value[1]
        if counts:
            told = ", ".join(f"{kind}: {count}" for kind, count in sorted(counts.items()))
            terminalreporter.write_line(f"{what}: {sum(counts.values())}: {told}")
