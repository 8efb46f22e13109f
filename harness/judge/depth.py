"""Finds how deep the rays of a truth must go: until a bound says that little light is left out (ERR-1, CUT-3)."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from harness.judge import bound
from harness.renderer.parameters import Parameters

# The depth is doubled and the cut-off divided by 16, so many times at most.
STAGES, SHALLOWEST, DEEPEST, LARGEST_CUTOFF = 4, 8, 64, 2.0**-12
UNCHANGED = 1e-4  # RMS, linear RGB, by which the last step may change the picture
LITTLE = 1e-3  # RMS, linear RGB, that what is left out may add by the bound: a quarter of 1/255
SETTINGS = STAGES, SHALLOWEST, DEEPEST, LARGEST_CUTOFF, UNCHANGED, LITTLE  # by what truths are kept

Shoot = Callable[[Parameters, dict[str, np.ndarray]], tuple[np.ndarray, np.ndarray | None]]


def steps(first: int) -> tuple[tuple[int, float], ...]:
    """Depths and cut-offs, the shallowest first. first: the depth of the deepest picture under test, or less."""
    first = max(first, SHALLOWEST)
    most = max(DEEPEST, 2 * first)
    return tuple((min(first * 2**step, most), LARGEST_CUTOFF / 16**step) for step in range(STAGES))


def deep_enough(
    wanted: Parameters,
    arrays: dict[str, np.ndarray],
    shoot: Shoot,
    unchanged: float = UNCHANGED,
    little: float = LITTLE,
) -> tuple[Parameters, float]:
    """Returns `wanted`, whose depth is where to begin, with the first depth and cut-off at which the last step has
    changed the picture by at most `unchanged`, and what is left out adds at most `little`; then how much that is at
    most, RMS, linear RGB: the larger one of that change and that bound.

    It looks at one sample a pixel, by `shoot`: the picture and the dropped weights of a job and the arrays of a scene.
    After the last of `steps` it stops, however much is left.
    """
    parameters = replace(wanted, sampler="one", samples=1, spp=1)
    (depth, cutoff), *deeper = steps(wanted.depth)
    before, _ = shoot(replace(parameters, depth=depth, cutoff=cutoff), arrays)
    for depth, cutoff in deeper:
        job = replace(parameters, depth=depth, cutoff=cutoff)
        picture, dropped = shoot(job, arrays)
        change = float(np.sqrt(np.mean((picture - before) ** 2)))
        left = left_out(job, arrays, dropped, shoot) if change <= unchanged or depth == deeper[-1][0] else np.inf
        if change <= unchanged and left <= little:
            break
        before = picture
    return replace(wanted, depth=depth, cutoff=cutoff), max(change, left)


def left_out(job: Parameters, arrays: dict[str, np.ndarray], dropped: np.ndarray | None, shoot: Shoot) -> float:
    """Returns what rays beyond the depth and the cut-off of a job could add at most, RMS, linear RGB.

    In a scene that is white, on all surfaces and behind them, without lights and attenuation, the picture of depth n is
    the weight W_0 + ... + W_n of all rays of a pixel up to that order. So pictures of two depths give the weight of the
    rays that the depth leaves out; CUT-2 has that of those that the cut-off does. No hit is brighter than
    `bound.brightest`, and what follows a ray that is left out is taken to have at most the weight that follows the eye
    ray of any pixel.
    """
    white = all_white(arrays)
    dark = replace(job, shadows=False)
    (whole, cut), (more, cut_more) = (shoot(replace(dark, depth=job.depth + step), white) for step in (0, 1))
    weights = [
        (picture.mean(axis=-1) + (0.0 if lost is None else lost)) for picture, lost in ((whole, cut), (more, cut_more))
    ]
    weight = np.maximum(weights[1] - weights[0], 0.0) + (0.0 if dropped is None else dropped)
    following = max(1.0, float(more.max()))
    return float(np.sqrt(np.mean((weight * following * bound.brightest(arrays)) ** 2)))


def all_white(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The scene where every hit, and the background, gives light of 1, nothing else does, and nothing is attenuated.

    What is clear stays clear, and what is opaque opaque (MED-1).
    """
    materials, lights, air = (arrays[name].copy() for name in ("materials", "lights", "air"))
    materials[:, bound.DIFFUSE], lights[:, bound.COLOUR] = 1.0, 0.0
    for attenuation in (*materials[:, bound.ATTENUATION], air[2:5]):
        attenuation[:] = 1.0 if attenuation.any() else 0.0
    light = {name: np.ones_like(arrays[name]) for name in ("ambient", "background")}
    return {**arrays, "materials": materials, "lights": lights, "air": air, **light}
