"""C++ and Numba prove most misses of SPH-1 by f·f - b²: never one that SPH-1 would hit."""

import numpy as np
import pytest

COUNT = 4000


def rays(rng):
    """Rays (COUNT, 6) from 1.01 to 1e7 radii away that pass the rim of the unit sphere by 1 to 1e-16 radii."""
    distance = 10 ** rng.uniform(0.005, 7, (COUNT, 1))
    away = rng.normal(size=(COUNT, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    aside = np.cross(away, rng.normal(size=(COUNT, 3)))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    impact = 1 + 10 ** rng.uniform(-16, 0, (COUNT, 1)) * rng.choice((-1, 1), (COUNT, 1))
    # the foot of the perpendicular from the centre is impact * aside, which the ray passes at a right angle
    origin = impact * aside + distance * away
    directions = -away
    return np.hstack((origin, directions))


@pytest.mark.parametrize("sphere", ["robust", "wide"])
@pytest.mark.parametrize("variant", ["cpp", "numba"])
def test_the_same_hits_as_without(bench, variant, sphere):
    """To the last bit those of Python, which has SPH-1 and SPH-3 alone."""
    seed = np.random.SeedSequence().entropy
    print("seed", seed)
    given = rays(np.random.default_rng(seed))
    scene = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nSPHERE (0,0,0) 1 (0.7,0.5,0.3) 0.4 20 (0,0,0) 1e6 1\n"
    found, expected = (
        bench.hits(name, scene, given, accel="none", sphere=sphere)[:, 0] for name in (variant, "python")
    )
    share = np.isfinite(expected).mean()
    assert 0.3 < share < 0.7
    assert np.array_equal(found, expected)
