"""S12: rays along the faces of an axis-aligned box, for which the slab test divides by 0."""

from fractions import Fraction

import numpy as np

from harness.scene.model import Box
from harness.stress import exact
from harness.stress.row import Row, Trial, rounded

RAYS = 6_000
BITS = 128  # fraction bits of t
WORST = 1e-3  # a hit whose relative error of t is larger is a failure


def truth(rays, low, high) -> exact.Truth:
    """The first hits of rays (R, 6) with the closed box from `low` to `high`."""
    roots = [_first([Fraction(float(x)) for x in ray], low, high) for ray in rays]
    t = [0 if first is None else (first.numerator << BITS) // first.denominator for first in roots]
    return exact.Truth(np.array([first is not None for first in roots]), np.array(t, dtype=object), BITS)


def _first(ray, low, high) -> Fraction | None:
    """The smallest t > 0 at which a ray's line enters or leaves the box; None if there is none."""
    spans = []
    for o, d, least, most in zip(ray[:3], ray[3:], low, high, strict=True):
        if d:
            spans.append(sorted(((least - o) / d, (most - o) / d)))
        elif not least <= o <= most:
            return None
    enter, leave = max(span[0] for span in spans), min(span[1] for span in spans)
    if enter > leave or leave <= 0:
        return None
    return enter if enter > 0 else leave


def make(level, precision, rng, inside=False) -> Trial:
    """The unit cube, moved by whole numbers so that its planes are exact, and rays with one or two components 0.

    Half of the rays start in the plane of a face that they run along. inside: all start in the face itself.
    """
    low = level * np.array([1.0, -1.0, 1.0])
    axes = rng.permuted(np.tile(np.arange(3), (RAYS, 1)), axis=1)
    angle, row = rng.uniform(0, 2 * np.pi, RAYS), np.arange(RAYS)
    both = rng.uniform(0, 1, RAYS) < 0.5
    d = np.copysign(0.0, rng.normal(size=(RAYS, 3)))  # 0 of both signs
    d[row, axes[:, 0]] = np.where(both, np.sign(np.cos(angle)), np.cos(angle))
    d[row, axes[:, 1]] = np.where(both, d[row, axes[:, 1]], np.sin(angle))
    reach = 0.0 if inside else 1.0
    offsets = rng.uniform(-reach, 1 + reach, (RAYS, 3))
    face = rng.integers(0, 2, RAYS)
    in_plane = np.ones(RAYS, bool) if inside else rng.uniform(0, 1, RAYS) < 0.5
    offsets[row[in_plane], axes[in_plane, 2]] = face[in_plane]
    rays = rounded(np.hstack([low + offsets, d]), precision)
    corner, edges = exact.triple(low), tuple(exact.triple(edge) for edge in np.eye(3))
    ends = low.astype(int).tolist(), (low + 1).astype(int).tolist()
    return exact.trial(rays, lambda: truth(rays, *ends), Box(exact.MATERIAL, corner, edges), worst=WORST)


ALONG = {
    "code": "S12",
    "stress": "distance of the box from (0, 0, 0) / its size",
    "failure": "rays with a wrong answer, by the closed box",
    "levels": tuple(4.0**power for power in range(10)),
    "error": "|Δt| / t",
    "method": "slab",
    "source": "Kay, Kajiya 1986; Barnes 2015 on 0·∞",
}
ROWS = (
    Row("slabs", title="Rays along the faces of a box, from anywhere", make=make, **ALONG),
    Row(
        "slabs-inside",
        title="Rays along the faces of a box, from within a face",
        make=lambda level, precision, rng: make(level, precision, rng, inside=True),
        **ALONG,
    ),
)
