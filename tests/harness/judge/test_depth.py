"""How deep a truth must be: by what still changes, and by the bound of what is left out (ERR-4)."""

from dataclasses import replace

import numpy as np
import pytest

from harness.judge import bound, depth, truth
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs

JOB = Parameters(width=12, height=10, shadows=True)
CAMERA = "CAMERA (0.1,0.2,0.3) (1,0,0.05) (0,0.8,0) (0.1,0,2)\n"
LIGHTS = "AMBIENT (0.4,0.5,0.6)\nLIGHT (3,5,2) (0.9,0.8,0.7) 0\nBACKGROUND (0.3,0.4,0.5)\n"
MIRROR = "(0.2,0.3,0.1) {} 20 (0,0,0) 1e30 1"  # R = 1
GLASS = "(0.1,0.1,0.1) {} 20 (0.9,0.95,0.8) 2.25 1"
BALLS = "SPHERE (-0.9,0,-1) 0.8 {0}\nSPHERE (0.9,0.1,-1.4) 0.8 {1}\nSPHERE (0.1,1.5,-1) 0.5 {0}\n"


def corridor(material, half=1e5):
    """Two slabs, above and below the eye, between which rays go on for so long."""
    return "".join(
        f"BOX (-{half},{y},-{half}) ({2 * half},0,0) (0,{y},0) (0,0,{2 * half}) {material}\n" for y in (-1.5, 1.5)
    )


class Maker:
    """Makes pictures of a scene for deep_enough, and says of which depths."""

    def __init__(self, bench, known, source):
        self.scene, self.bench, self.depths = text.read(CAMERA + LIGHTS + source), bench, []
        self.arrays = flatten(self.scene)
        self.entry = known["cpp" if known["cpp"].unavailable is None else "python"]

    def shoot(self, job, arrays):
        self.depths.append(job.depth)
        wanted = truth.needs_in(arrays, self.arrays, needs(self.scene, job))
        result = self.bench.run(self.entry, arrays, self.bench.sharing(self.entry, job, wanted), wanted)
        assert result.status == "ok", result
        return result.array, result.dropped

    def picture(self, depth):
        return self.shoot(replace(JOB, depth=depth), self.arrays)[0]


@pytest.fixture
def maker(bench, known):
    return lambda source: Maker(bench, known, source)


def test_steps():
    """Never shallower than the job, and at the end at least twice as deep."""
    assert depth.steps(0) == ((8, 2.0**-12), (16, 2.0**-16), (32, 2.0**-20), (64, 2.0**-24))
    assert [deep for deep, _ in depth.steps(20)] == [20, 40, 64, 64]
    assert [deep for deep, _ in depth.steps(100)] == [100, 200, 200, 200]


def test_weights_of_mirrors_by_hand(maker):
    """Of two mirrors that each keep k of the weight, k^n is left at order n."""
    made = maker(corridor(MIRROR.format(0.5)))
    brightest = bound.brightest(made.arrays)
    for order in (1, 3, 6):
        white = depth.all_white(made.arrays)
        np.testing.assert_allclose(
            made.shoot(replace(JOB, depth=order), white)[0], 2 - 0.5**order, rtol=1e-12
        )  # 1 + 1/2 + ..
        left = depth.left_out(replace(JOB, depth=order), made.arrays, None, made.shoot)
        assert left == pytest.approx(0.5 ** (order + 1) * (2 - 0.5 ** (order + 1)) * brightest, rel=1e-10)


@pytest.mark.parametrize("k_s", [0.3, 0.7, 0.9])
def test_nothing_is_left_out_beyond_the_bound(maker, k_s):
    """Mirrors and glass: what twice as many orders add is no more than what is said to be left."""
    made = maker(BALLS.format(MIRROR.format(k_s), GLASS.format(k_s)) + corridor(MIRROR.format(k_s)))
    deep = made.picture(24)
    for order in (2, 4, 8):
        job = replace(JOB, depth=order)
        rms = np.sqrt(np.mean((deep - made.picture(order)) ** 2))
        left = depth.left_out(job, made.arrays, None, made.shoot)
        print(k_s, order, rms, left)
        assert 0 < rms <= left


def test_it_goes_on_until_little_is_left(maker):
    made = maker(corridor(MIRROR.format(0.6)))
    job, left = depth.deep_enough(replace(JOB, depth=8), made.arrays, made.shoot)
    assert (job.depth, job.cutoff) == (32, 2.0**-20) and left <= depth.LITTLE
    assert {8, 16, 32} <= set(made.depths) and 64 not in made.depths
    assert np.sqrt(np.mean((made.picture(64) - made.picture(32)) ** 2)) <= left


@pytest.mark.parametrize("k_s", [1.0, 0.999])
def test_a_corridor_of_mirrors_cannot_be_told(maker, k_s):
    """Black mirrors, with light at the end that no depth reaches: the picture does not change with depth."""
    dark = corridor(MIRROR.replace("(0.2,0.3,0.1)", "(0,0,0)").format(k_s))
    made = maker(dark)
    made.arrays["lights"][:] = made.arrays["ambient"][:] = 0
    assert not made.picture(8).any() and not made.picture(64).any()
    _, left = depth.deep_enough(replace(JOB, depth=8), made.arrays, made.shoot)
    assert left > 0.1


def test_bright_light_behind_dim_mirrors(maker):
    """A cut-off of 2^-12 would drop a weight of 1e-6, before a background of 3e5."""
    made = maker(corridor(MIRROR.format(0.001), 40))
    made.arrays["background"][:] = 3e5
    job, left = depth.deep_enough(replace(JOB, depth=8), made.arrays, made.shoot)
    assert job.cutoff < 1e-6
    exact = made.picture(job.depth)
    close = made.shoot(job, made.arrays)[0]
    assert np.sqrt(np.mean((exact - close) ** 2)) <= left


def test_white_keeps_what_is_clear_and_what_is_opaque(maker):
    made = maker(BALLS.format(MIRROR.format(0.5), GLASS.format(0.5)))
    white = depth.all_white(made.arrays)
    before, after = made.arrays["materials"], white["materials"]
    assert (
        (after[:, :3] == 1).all() and (after[:, 3:5] == before[:, 3:5]).all() and (after[:, 8:] == before[:, 8:]).all()
    )
    np.testing.assert_array_equal(after[:, 5:8], before[:, 5:8] > 0)
    assert not white["lights"][:, 3:6].any() and made.arrays["lights"][:, 3:6].any()
