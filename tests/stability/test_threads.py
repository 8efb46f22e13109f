"""S24: the same bytes by 1, 2 and n threads."""

import numpy as np
import pytest

from harness.renderer import registry
from harness.stress.execution import threads

SEED = 20201107
PRECISIONS = ("float32", "float64")
PARALLEL = [name for name, entry in registry.entries().items() if entry.variant.threads == "all"]


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("variant", PARALLEL)
def test_threads_change_no_byte(strain, variant, precision, monkeypatch):
    monkeypatch.setattr(threads, "FIRST", {})
    for level in (1, 2, 3, 8, int(np.random.default_rng(SEED).integers(4, 17))):
        finding = strain(variant, "threads", level, precision)
        assert finding.failures == 0 and finding.count > 10_000
    assert len(threads.FIRST) == 1


def test_another_picture_is_noticed(strain, monkeypatch):
    monkeypatch.setattr(threads, "FIRST", {})
    strain("cpp", "threads", 1)
    (first,) = threads.FIRST.values()
    first[3, 4, 1] = np.nextafter(first[3, 4, 1], 1)
    assert strain("cpp", "threads", 1).failures >= 1
