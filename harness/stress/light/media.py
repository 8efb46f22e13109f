"""S16: the medium that a ray is in.

Balls with the index of the air, balls in balls, balls that overlap; a pane cut in slices; glass on a floor.
"""

import itertools
import math
from functools import cache

import mpmath as mp
import numpy as np

from harness.scene.model import Air, Box, Material, Polygon, Scene, Sphere
from harness.stress.exact import triple
from harness.stress.light.optics import reflectance, white_light
from harness.stress.row import ROUNDOFF, Row, Trial, directions, in_general_position, rounded, within
from harness.stress.view import (
    BLACK,
    DIGITS,
    MATTE,
    OPAQUE,
    WHITE,
    camera,
    cross,
    exact_rays,
    exactly,
    eye_rays,
    glass,
    minus,
    unit,
)

SIDE, FEW = 12, 4  # pixels
DEPTH, SHALLOW = 9, 2  # SHALLOW: what a pane needs, whatever it is cut into
WIDE, THICK = 4.0, 0.8  # of the pane
TINT = 0.5  # the attenuation of the glass on the floor
WATER, GLASS, AIR = (1.75, 1.0), (2.25, 1.0), (1.0, 1.0)
GATE = {"float32": 1e-5, "float64": 1e-12}
CERTAIN = 1e-3  # pixels whose ray passes an edge closer than this are not judged


def not_there(count, precision, rng):
    """`count` balls with the index of the air, between the eye and four opaque balls in a bright world.

    They must be invisible, though each of their faces that a ray passes raises its order by one (REF-7).
    """
    turn, middle = in_general_position(rng), rng.uniform(-1, 1, 3)
    eps, mu = rounded([rng.uniform(1.1, 3), rng.uniform(0.9, 1.5)], precision)

    def place(where):
        return rounded(middle + turn @ where, precision)

    def sphere(material, where, radius):
        return Sphere(material, triple(place(where)), float(rounded(radius, precision)))

    shades = [Material((s, 1 - s, 0.0), 0.0, 1.0, OPAQUE, eps, mu) for s in (0.0, 1.0)]
    seen_through = [
        sphere(shade, [x + rng.uniform(-0.2, 0.2), y, -6], rng.uniform(0.7, 1.1))
        for shade, (x, y) in zip([*shades, *shades], [(-1.5, -1.5), (1.5, -1.5), (-1.5, 1.5), (1.5, 1.5)], strict=True)
    ]
    matched = glass(eps, mu)
    balls = [sphere(matched, rng.uniform((-1, -1, -2), (1, 1, 2)), rng.uniform(0.5, 2)) for _ in range(count)]
    view = camera(place([0, 0, 5]), place([0, 0, 0]), 1.5 * turn[:, 0], 1.5 * turn[:, 1], precision)
    scene = Scene(view, (*seen_through, *balls), (), WHITE, (0.0, 0.0, 1.0), Air(eps, mu))

    def judge(result):
        expected, certain = opaque(scene, seen_through)
        off = np.abs(result.array.astype(float) - expected).max(axis=-1)[certain]
        return within(off, GATE[precision])

    return Trial(scene, judge, parameters={"width": SIDE, "height": SIDE, "depth": 2 * count})


def opaque(scene, spheres):
    """The picture (SIDE, SIDE, 3) of these opaque spheres alone, and which pixels are certain, bool (SIDE, SIDE)."""
    eye, way = eye_rays(scene.camera, SIDE, SIDE)
    picture = np.broadcast_to(scene.background, way.shape).copy()
    certain = np.ones(way.shape[:2], bool)
    for ball in spheres:  # side by side: no ray meets two
        to_centre = np.subtract(ball.centre, eye)
        impact = np.linalg.norm(np.cross(to_centre, way), axis=-1)
        picture[impact < ball.radius] = ball.material.diffuse
        certain &= np.abs(impact - ball.radius) > CERTAIN
    return picture, certain


def nested(count, precision, rng):
    """Balls with one centre, of water and glass in turn, in a white world."""
    turn, centre = in_general_position(rng), rounded(rng.uniform(-1, 1, 3), precision)
    radii = rounded(2 * np.cumprod([1, *rng.uniform(0.8, 0.9, count - 1)]), precision)
    balls = [
        Sphere(glass(*medium), triple(centre), float(radius))
        for radius, medium in zip(radii, itertools.cycle((WATER, GLASS)), strict=False)
    ]
    half = 0.3 * radii[-1]  # rays meet all balls
    eye = centre + 6 * turn[:, 2]
    seen = camera(eye, centre, half * turn[:, 0], half * turn[:, 1], precision)
    scene = Scene(seen, tuple(balls[k] for k in rng.permutation(count)), background=WHITE)

    def truth(eye, way):
        """n times the distance of a ray from the centre is constant (Bouguer), which gives the angles at all faces."""
        aside = cross(minus(eye, exactly(centre)), way)
        square = mp.fdot(aside, aside)
        faces, outer = [], AIR
        for ball in balls:
            medium = ball.material.eps_r, ball.material.mu_r
            index2 = mp.mpf(outer[0]) * mp.mpf(outer[1])
            cosine = mp.sqrt(1 - square / (index2 * mp.mpf(ball.radius) ** 2))
            faces.append(reflectance(outer, medium, cosine))
            outer = medium
        return white_light([*faces, *reversed(faces)], DEPTH)

    return judged(scene, precision, truth, FEW)


def overlapping(count, precision, rng):
    """Balls on a line, each overlapping the one before, of glass and water in turn; the eye looks along the line.

    Where two overlap, the medium is that of the smaller (MED-2). Every ray meets every face at right angles.
    """
    (axis,), origin = directions(rng, 1), rng.uniform(-1, 1, 3)
    radii = np.sort(rng.uniform(0.5, 1.0, count))[rng.permutation(count)]
    places = np.cumsum([0, *((radii[1:] + radii[:-1]) * rng.uniform(0.5, 0.9, count - 1))])
    balls = [
        Sphere(glass(*medium), triple(rounded(origin + place * axis, precision)), float(rounded(radius, precision)))
        for place, radius, medium in zip(places, radii, itertools.cycle((GLASS, WATER)), strict=False)
    ]
    across = 1e-9 * np.cross(axis, directions(rng, 1)[0])
    seen = camera(origin - 4 * axis, origin, across, np.cross(axis, across), precision)
    scene = Scene(seen, tuple(balls), background=WHITE)
    ends = sorted([*(places - radii), *(places + radii)])

    def medium(place):
        around = [k for k in range(count) if abs(place - places[k]) < radii[k]]
        if not around:
            return AIR
        inner = balls[min(around, key=radii.__getitem__)].material
        return inner.eps_r, inner.mu_r

    media = [AIR, *(medium((a + b) / 2) for a, b in itertools.pairwise(ends)), AIR]

    def truth(*_):
        return white_light([reflectance(i, t, mp.mpf(1)) for i, t in itertools.pairwise(media)], DEPTH)

    return judged(scene, precision, truth, 1)


def cut(count, precision, rng):
    """A pane of glass in general position, cut by `count` planes along it, in a white world. No cut may be seen."""
    turn, middle = in_general_position(rng), rng.uniform(-1, 1, 3)
    parts = np.diff([0, *np.sort(rng.uniform(0, 1, count)), 1]) if count else [1.0]
    places = THICK * np.cumsum([0, *parts[:-1]])

    def vector(values):
        return triple(rounded(values, precision))

    slices = [
        Box(
            glass(*GLASS),
            vector(middle + turn @ [-WIDE / 2, -WIDE / 2, place]),
            (vector(WIDE * turn[:, 0]), vector(WIDE * turn[:, 1]), vector(THICK * part * turn[:, 2])),
        )
        for place, part in zip(places, parts, strict=True)
    ]
    seen = camera(middle - 3 * turn[:, 2], middle, 0.5 * turn[:, 0], 0.5 * turn[:, 1], precision)
    scene = Scene(seen, tuple(slices[k] for k in rng.permutation(len(slices))), background=WHITE)

    def truth(_, way):
        r = reflectance(AIR, GLASS, abs(mp.fdot(exactly(turn[:, 2]), way)))
        return white_light([r, r], SHALLOW)

    return judged(scene, precision, truth, FEW, SHALLOW)


def on_floor(level, precision, rng):
    """A block of tinted glass on a white floor, `level` from the origin, in a black world with ambient light.

    All numbers are multiples of a power of two that is so large that sums of them are exact: the floor's corners lie in
    the plane of the block's lower face. A ray that misses the floor sees black.
    """
    turn, away = in_general_position(rng), directions(rng, 1)[0]
    step = 2.0 ** np.ceil(np.log2(level + 4 * WIDE)) * 4 * ROUNDOFF[precision]

    def vector(values):
        return np.round(np.asarray(values) / step) * step

    a, b, up = vector(WIDE * turn[:, 0]), vector(WIDE * turn[:, 1]), vector(THICK * turn[:, 2])
    middle = level * away
    corner = vector(middle - (a + b) / 2)
    tinted = Material(BLACK, 1.0, 1.0, (TINT, TINT, TINT), *GLASS)
    block = Box(tinted, triple(corner), (triple(a), triple(b), triple(up)))
    floor = Polygon(MATTE, tuple(triple(corner + i * a + j * b) for i, j in ((-1, -1), (2, -1), (2, 2), (-1, 2))))
    seen = camera(middle + 3 * turn[:, 2] + 0.6 * turn[:, 0], middle, 0.5 * turn[:, 0], 0.5 * turn[:, 1], precision)
    scene = Scene(seen, (block, floor), ambient=WHITE, background=BLACK)

    def truth(_, way):
        """The floor's white through the upper face, attenuated by the way through the block."""
        normal = unit(cross(exactly(a), exactly(b)))
        cosine = abs(mp.fdot(normal, way))
        beyond = mp.sqrt(1 - (1 - cosine**2) / (mp.mpf(GLASS[0]) * GLASS[1]))
        length = abs(mp.fdot(normal, exactly(up))) / beyond
        return (1 - reflectance(AIR, GLASS, cosine)) * mp.mpf(TINT) ** length

    return judged(scene, precision, truth, FEW, SHALLOW, GATE[precision] * level)


def seen_short(level, u, methods):
    """The error of a pixel whose ray starts ε of OFF-1 beyond the upper face, and is attenuated over that less."""
    if methods["merge"] == "none" or methods["offset"] != "bounded":
        return None
    return -math.log(TINT) * TINT**THICK * methods["epsilon"] * (WIDE + level / 8)


def judged(scene, precision, truth, side, depth=DEPTH, gate=None):
    """The Trial of a picture whose pixels are truth(eye, direction) in every channel. gate: None for that of GATE."""

    @cache
    @mp.workdps(DIGITS)
    def picture():
        pixels = [float(truth(eye, way)) for _, _, eye, way in exact_rays(scene.camera, side, side)]
        return np.reshape(pixels, (side, side, 1))

    def judge(result):
        off = np.abs(result.array.astype(float) - picture()).max(axis=-1)
        return within(off, gate or GATE[precision])

    return Trial(scene, judge, parameters={"width": side, "height": side, "depth": depth})


def row(name, title, stress, levels, make, method="", failure="pixels off by more than 1e-12 (float32: 1e-5)", **more):
    return Row(
        name=name,
        code="S16",
        title=title,
        stress=stress,
        failure=failure,
        error="|Δ pixel|",
        levels=levels,
        method=method,
        source="Schmidt and Budge, Simple nested dielectrics, JGT 7(2), 2002",
        make=lambda level, precision, rng: make(int(level), precision, rng),
        **{"expected": lambda level, u, methods: 4 * u, **more},
    )


ROWS = (
    row(
        "media-matched",
        "Balls with the index of the air, which must be invisible",
        "balls before the scene",
        (1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 16.0, 24.0, 32.0),
        not_there,
    ),
    row("media-nested", "Balls in balls, of water and glass", "balls", (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0), nested),
    row("media-overlap", "Balls that overlap", "balls in a row", (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0), overlapping),
    row(
        "media-cut",
        "A pane of glass cut in slices that touch",
        "cuts",
        (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0),
        cut,
        "merge",
    ),
    row(
        "glass-on-floor",
        "A block of glass that stands on a floor",
        "distance from (0, 0, 0), in the scene's unit",
        (1.0, 1e1, 1e2, 1e3, 1e4),
        on_floor,
        "merge",
        "pixels off by more than 1e-12 (float32: 1e-5) times the distance",
        expected=seen_short,
    ),
)
