"""S18: Phong's highlight.

An exponent magnifies the error of a cosine, and makes light of one below 0. The sign of n·l switches it on and off.
"""

import math
from functools import cache

import mpmath as mp
import numpy as np

from harness.scene.model import Light, Material, Polygon, Scene
from harness.stress.exact import triple
from harness.stress.row import ROUNDOFF, Finding, Row, Trial, in_general_position, rounded
from harness.stress.view import BLACK, DIGITS, OPAQUE, WHITE, camera, cross, exact_rays, exactly, minus, sides, unit

SIDE = 16  # pixels
DISTANCE = 3.0  # of the eye from the point that it looks at
EVEN, BROKEN = 50.0, 2.5
GRAZED = 10.0  # exponent of the face whose plane the light is in
LOW = 0.3  # the sine of the eye's elevation above it


def shiny(exponent):
    return Material(BLACK, 1.0, exponent, OPAQUE, 1.0, 1.0)


def lit(elevation, exponent, precision, rng):
    """A shiny triangle, a light, and an eye so close to the light's mirror image that c^m is 0.3 or more."""
    turn, origin = in_general_position(rng), rng.uniform(-1, 1, 3)
    exponent = float(rounded(exponent, precision))

    def place(*where):
        return rounded(origin + turn @ where, precision)

    corners = [triple(place(30 * math.cos(a), 30 * math.sin(a), 0)) for a in (0.3, 2.4, 4.5)]
    cosine, sine = math.cos(elevation), math.sin(elevation)
    half = DISTANCE * min(0.3, 0.5 / math.sqrt(exponent))
    eye, centre = place(DISTANCE * cosine, 0, DISTANCE * sine), place(0, 0, 0)
    seen = camera(eye, centre, half * turn[:, 1], half * turn @ [-sine, 0, cosine], precision)
    light = Light(triple(place(-10 * cosine, 0, 10 * sine)), WHITE, 0.0)
    scene = Scene(seen, (Polygon(shiny(exponent), tuple(corners)),), (light,))
    reference = cache(lambda: powers(scene, exponent))

    def judge(result):
        value = result.array.astype(float)[..., 0]
        off = np.abs(value / reference() - 1)
        u = ROUNDOFF[precision]
        wrong = ~(off <= 16 * (exponent + 1) * u) | ~(value <= 1)  # no highlight is brighter than its light
        return Finding(off.size, wrong.sum(), off[np.isfinite(off)])

    return Trial(scene, judge, parameters={"width": SIDE, "height": SIDE, "depth": 0})


@mp.workdps(DIGITS)
def powers(scene, exponent):
    """c^m of each pixel (SIDE, SIDE); c is the cosine between the mirrored light and the direction to the eye."""
    (triangle,), (light,) = scene.objects, scene.lights
    a, b, c = map(exactly, triangle.vertices)
    normal = unit(cross(minus(b, a), minus(c, a)))
    highlights = np.empty((SIDE, SIDE))
    for j, i, eye, way in exact_rays(scene.camera, SIDE, SIDE):
        t = mp.fdot(minus(a, eye), normal) / mp.fdot(way, normal)
        p = [x + t * d for x, d in zip(eye, way, strict=True)]
        to_light = unit(minus(exactly(light.position), p))
        height = mp.fdot(normal, to_light)
        mirrored = [2 * height * n - x for n, x in zip(normal, to_light, strict=True)]
        highlights[j, i] = float((-mp.fdot(mirrored, way)) ** mp.mpf(exponent))
    return highlights


def behind(level, precision, rng):
    """The light on the eye's side, so low that its mirror image is behind the eye: c = -level. Half of the picture has
    an even exponent, half a fractional one; both must be black."""
    turn, origin = in_general_position(rng), rng.uniform(-1, 1, 3)

    def place(*where):
        return rounded(origin + turn @ where, precision)

    angle = math.acos(level) / 2  # of eye and light, above the plane
    cosine, sine = math.cos(angle), math.sin(angle)
    size = 9 * DISTANCE
    near, far = triple(place(-size, 0, 0)), triple(place(size, 0, 0))
    halves = [
        Polygon(shiny(exponent), (near, far, triple(place(0, side * size, 0))))
        for side, exponent in ((1, EVEN), (-1, BROKEN))
    ]
    half = 0.1 * min(angle, 1) * DISTANCE
    eye = place(DISTANCE * cosine, 0, DISTANCE * sine)
    seen = camera(eye, place(0, 0, 0), half * turn[:, 1], half * turn @ [-sine, 0, cosine], precision)
    light = Light(triple(place(100 * cosine, 0, 100 * sine)), WHITE, 0.0)

    def judge(result):
        value = result.array.astype(float).max(axis=-1)
        false = value[:, sides(SIDE, SIDE)[0] > 0]
        return Finding(value.size, (~(value == 0)).sum(), false[np.isfinite(false)])

    scene = Scene(seen, tuple(halves), (light,))
    return Trial(scene, judge, parameters={"width": SIDE, "height": SIDE, "depth": 0})


def in_plane(sine, precision, rng):
    """A shiny triangle, a light so low above its plane that its elevation has this sine, and an eye on the other side,
    LOW above the plane, where the highlight is some (1 - LOW²)^(GRAZED / 2) of the light.

    Of the numbers as rounded the light is above the plane, and lights all pixels, or below it, and lights none.
    """
    turn, origin = in_general_position(rng), rng.uniform(-1, 1, 3)

    def place(*where):
        return rounded(origin + turn @ where, precision)

    corners = [triple(place(5 * math.cos(a), 5 * math.sin(a), 0)) for a in (0.3, 2.4, 4.5)]
    cosine, aside = math.sqrt(1 - LOW**2), rng.uniform(-0.2, 0.2)
    half = 0.1 * DISTANCE
    seen = camera(
        place(DISTANCE * cosine, 0, DISTANCE * LOW),
        place(0, 0, 0),
        half * turn[:, 1],
        half * turn @ [-LOW, 0, cosine],
        precision,
    )
    across = math.sqrt(1 - sine**2)
    light = rng.uniform(3, 6) * np.array([-across * math.cos(aside), -across * math.sin(aside), sine])
    triangle = Polygon(shiny(GRAZED), tuple(corners))
    scene = Scene(seen, (triangle,), (Light(triple(place(*light)), WHITE, 0.0),))
    truth = cache(lambda: (above(scene), powers(scene, GRAZED)))

    def judge(result):
        value = result.array.astype(float)[..., 0]
        side, highlight = truth()
        off = np.abs(value / highlight - 1)
        lit, dark = off <= 16 * (GRAZED + 1) * ROUNDOFF[precision], value == 0
        right = {1: lit, 0: lit | dark, -1: dark}[side]
        return Finding(off.size, (~right).sum(), off[np.isfinite(off) & ~dark])

    return Trial(scene, judge, parameters={"width": SIDE, "height": SIDE, "depth": 0})


@mp.workdps(DIGITS)
def above(scene):
    """1 if the light is on the same side of the triangle's plane as the eye, -1 on the other, 0 in the plane."""
    (triangle,), (light,), seen = scene.objects, scene.lights, scene.camera
    a, b, c = map(exactly, triangle.vertices)
    normal = cross(minus(b, a), minus(c, a))
    eye = [x + y for x, y in zip(exactly(seen.centre), exactly(seen.e), strict=True)]
    of_light, of_eye = (mp.fdot(minus(place, a), normal) for place in (exactly(light.position), eye))
    return int(mp.sign(of_light) * mp.sign(of_eye))


ROWS = (
    Row(
        name="highlight",
        code="S18",
        title="Highlights by the exponent of the material",
        stress="exponent",
        failure="pixels brighter than the light, or off by more than rounding explains",
        error="|Δ highlight| / highlight",
        levels=(1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6),
        method="phong",
        make=lambda level, precision, rng: lit(rng.uniform(0.6, 1.1), level, precision, rng),
        expected=lambda level, u, methods: (level + 1) * u,
        # From this exponent on a cosine of 1 + u is visible.
        limit=lambda u, methods: 1 / u if methods["phong"] == "unclamped" else None,
    ),
    Row(
        name="highlight-behind",
        code="S18",
        title="Highlights of lights whose mirror image is behind",
        stress="-c, the cosine from the mirrored light to the eye",
        failure="pixels that are not black",
        error="false highlight",
        levels=(0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.999, 0.9999),
        logarithmic=False,
        method="phong",
        make=behind,
        expected=lambda level, u, methods: level**EVEN if methods["phong"] == "unclamped" else 0.0,
    ),
    Row(
        name="in-plane",
        code="S18",
        title="Highlights of a light in the plane of the face",
        stress="sine of the light's elevation",
        failure="pixels that are dark though the light is above the plane, lit though it is below, or off by more than "
        "rounding explains",
        error="|Δ highlight| / highlight",
        levels=(1e-1, 1e-3, 1e-5, 1e-6, 1e-7, 1e-8, 1e-10, 1e-12, 1e-14, 1e-15, 1e-16, 1e-18),
        make=in_plane,
        expected=lambda level, u, methods: (GRAZED + 1) * u,
        # n·l is a sum of three rounded products of rounded vectors.
        limit=lambda u, methods: 4 * u,
    ),
)
