"""Python in processes and in threads: the same bytes and counts as in one thread, whatever their number."""

import numpy as np
import pytest

from harness.process import repetition
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import shapes

PARTED = "python-processes", "python-threads"
# Glass, so that rays branch, with a soft light; seen from outside.
GLASS = (
    "CAMERA (0.1,-0.2,0) (2.1,0,-0.2) (0,2.1,0) (0.4,0.9,6.1)\nAMBIENT (0.4,0.5,0.3)\nBACKGROUND (0.5,0.6,0.8)\n"
    "LIGHT (1.1,2.3,4.2) (0.9,0.8,0.7) 0.4\nSPHERE (0.3,0.2,0.1) 1.1 (0.2,0.6,0.3) 0.8 7.5 (0.9,0.8,0.9) 2.25 1\n"
    "SPHERE (-1.2,0.9,-0.4) 0.7 (1,0,1) 0.4 9 (0,0,0) 1e9 1\n"
)
JOB = {"width": 23, "height": 17, "depth": 4, "shadows": True, "exact": True}
ADAPTIVE = JOB | {"sampler": "adaptive", "adaptive_depth": 2}
SAMPLED = JOB | {"sampler": "jittered", "samples": 2, "feelers": 2, "cutoff": 0.01, "region": (3, 2, 20, 15)}


@pytest.fixture(scope="module")
def alone(bench):
    """What one thread makes of the three jobs."""
    return [bench.result("python", GLASS, **job) for job in (JOB, ADAPTIVE, SAMPLED)]


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("variant", PARTED)
def test_no_byte_changes(bench, alone, variant, threads):
    for job, one in zip((JOB, ADAPTIVE, SAMPLED), alone, strict=True):
        result = bench.result(variant, GLASS, threads=threads, frames=1, **job)
        assert result.array.tobytes() == one.array.tobytes() and one.array.std() > 1e-3
        assert result.said.rays == one.said.rays and one.said.rays["transmitted"] > 0
        assert result.said.used["methods"]["threads"] == threads


@pytest.mark.parametrize("variant", PARTED)
def test_first_hits(bench, variant):
    """A list that is longer than a part, and no multiple of it."""
    scene = text.read(GLASS, "scene of the test")
    seed = int(np.random.SeedSequence().entropy % 2**32)
    print("seed", seed)
    rays = np.random.default_rng(seed).normal(0, 3, (601, 6))
    arrays = {**flatten(scene), "rays": rays}
    results = [
        repetition.run(bench.entry(name), arrays, Parameters(kind="rays", threads=threads), shapes(scene))
        for name, threads in (("python", 1), (variant, 2))
    ]
    assert all(result.array is not None for result in results), [result.reason for result in results]
    made = [result.array for result in results]
    assert made[0].shape == (601, 8) and made[0].tobytes() == made[1].tobytes()
    assert 0 < np.isfinite(made[0][:, 0]).sum() < 601
