"""S26 to S28: what samples of a pixel miss: wires thinner than it, glints smaller than it; and how their sum rounds."""

import math
from functools import cache

import numpy as np

from harness.picture import colour
from harness.scene.model import Light, Material, Polygon, Scene, Sphere
from harness.stress.exact import triple
from harness.stress.row import ROUNDOFF, Finding, Row, Trial, in_general_position, rounded, within
from harness.stress.view import BLACK, OPAQUE, WHITE, camera

GRID = 8  # samples of a side, and squares of the lattice that a side of a pixel has at most
SAMPLES = {"samples": GRID, "adaptive_depth": 3, "adaptive_threshold": 0.1, "depth": 0}

# Thin wires.
SIDE = 32  # pixels
APART = 8.0  # pixels, from wire to wire
LENGTH = 30.0  # pixels of a wire in the picture, about
COLOURS = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
SLANTS = (29, 43), (47, 61)  # degrees: not 45, nor 1 to 2, where a wire lies between two rows of a grid of samples
CHANCE = 1e-9  # that honest samples fail

# Glints.
ACROSS = 9  # pixels
BALL = 12.0  # pixels that the ball's radius has
GLINTS = 3  # of a side of the picture
DISTANCE = 20.0  # of the eye, in radii
LIGHT = 0.5  # of a glint, in pixels of 1
VISIBLE = 1 / 255
NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)

# Sums.
FEW = 2  # pixels
OTHER_ROUNDINGS = 4  # of a pixel: of its colour and of the division by n²


def wires(level, precision, rng):
    """Three wires, 1/level pixels wide, that cross the picture side by side in a plane that is not the screen's.

    They have no light in common: each has a channel of its own. No pixel sees two.
    """
    turn, centre = in_general_position(rng), rng.uniform(-1, 1, 3)
    seen = camera(centre + 3 * turn[:, 2], centre, turn[:, 0], turn[:, 1], precision)
    eye, facing = np.add(seen.centre, seen.e), turn @ [*rng.uniform(-0.3, 0.3, 2), 1.0]
    slant = math.radians(rng.uniform(*SLANTS[rng.integers(2)])) * rng.choice([-1, 1])
    along, aside = np.array([[math.cos(slant), math.sin(slant)], [-math.sin(slant), math.cos(slant)]])

    def lift(place):
        """The point of the plane of the wires that is seen at this place, in pixels."""
        x, y = 2 * place[0] / SIDE - 1, 1 - 2 * place[1] / SIDE
        way = x * np.array(seen.u) + y * np.array(seen.v) - seen.e
        return triple(rounded(eye + (seen.centre - eye) @ facing / (way @ facing) * way, precision))

    polygons = []
    for number, shade in enumerate(COLOURS):
        middle = SIDE / 2 + ((number - 1) * APART + rng.uniform(-1, 1)) * aside
        end, edge = SIDE * along, aside / (2 * level)
        loop = [middle - end - edge, middle + end - edge, middle + end + edge, middle - end + edge]
        polygons.append(Polygon(Material(shade, 0.0, 1.0, OPAQUE, 1.0, 1.0), tuple(map(lift, loop))))
    scene = Scene(seen, tuple(polygons), ambient=WHITE, background=BLACK)
    areas = np.array([area(clipped(places(seen, wire.vertices))) for wire in polygons])

    def judge(result):
        """Of N samples that each hit a wire with a probability of its own, m are expected to. That r m do has at most
        a probability of e^-D, D = m (r ln r - r + 1) (Chernoff)."""
        share = result.array.astype(float).sum(axis=(0, 1)) / areas
        unlikely = areas * GRID**2 * (share * np.log(np.maximum(share, 1e-300)) - share + 1)
        off = np.abs(share - 1)
        return Finding(off.size, int((~(unlikely <= -math.log(CHANCE))).sum()), off[np.isfinite(off)])

    return Trial(scene, judge, parameters={"width": SIDE, "height": SIDE, **SAMPLES})


def places(seen, points):
    """Where points (n, 3) are seen in the picture, in pixels from its top left (n, 2)."""
    positions = []
    for point in points:
        way = np.subtract(point, np.add(seen.centre, seen.e))
        x, y, _ = np.linalg.solve(np.column_stack([seen.u, seen.v, -way]), seen.e)
        positions.append([(x + 1) / 2 * SIDE, (1 - y) / 2 * SIDE])
    return np.array(positions)


def clipped(loop):
    """The part of a convex loop of places (n, 2) that lies in the picture (Sutherland and Hodgman)."""
    for axis in (0, 1):
        for sign, edge in ((1, 0), (-1, SIDE)):
            inside, kept = sign * (loop[:, axis] - edge), []
            for k in range(len(loop)):
                if inside[k - 1] * inside[k] < 0:
                    kept.append(loop[k] + inside[k] / (inside[k] - inside[k - 1]) * (loop[k - 1] - loop[k]))
                if inside[k] >= 0:
                    kept.append(loop[k])
            loop = np.array(kept).reshape(-1, 2)
    return loop


def area(loop):
    (x, y), (x1, y1) = loop.T, np.roll(loop, -1, axis=0).T
    return abs(x @ y1 - y @ x1) / 2


def corners_passed(u, methods):
    """The level from which on a wire can pass between the corners of a pixel, which then is not divided.

    The corners lie at 0, sin a, cos a and both together across a wire of the slant a (or 90° - a): the largest gap is
    sin a from 27° to 45°, and 1 of a wire along the rows of pixels.
    """
    return 1 / math.sin(math.radians(SLANTS[0][1])) if methods["sampler"] == "adaptive" else None


def light_lost(level, u, methods):
    """The standard deviation of a wire's share of light in jittered samples.

    Those of m hits that are left to chance: all of a wire that is narrower than the squares of the grid, and else those
    of squares that its two sides cut, with a variance of about 0.14 each.
    """
    if methods["sampler"] != "jittered":
        return None
    hits = GRID**2 * LENGTH / level
    return math.sqrt(min(hits, 0.38 * GRID * LENGTH)) / hits


def glint(exponent, precision, rng):
    """A shiny ball with nine lights, each of which makes a highlight of the same light in a pixel of its own."""
    turn, centre = in_general_position(rng), rounded(rng.uniform(-1, 1, 3), precision)
    exponent = float(rounded(exponent, precision))
    half = ACROSS / 2 / BALL
    seen = camera(centre + DISTANCE * turn[:, 2], centre, half * turn[:, 0], half * turn[:, 1], precision)
    ball = Sphere(Material(BLACK, 1.0, exponent, OPAQUE, 1.0, 1.0), triple(centre), 1.0)
    where = 3 * np.stack(np.meshgrid(*2 * [np.arange(GLINTS)]), axis=-1).reshape(-1, 2)
    where = where + rng.uniform(0.5, 2.5, where.shape)  # pixels from the top left
    point, normal, way = touched(seen, ball, *where.T)
    mirrored = way - 2 * (way * normal).sum(axis=-1, keepdims=True) * normal
    positions = point + rng.uniform(5, 10, (len(where), 1)) * mirrored
    # A small highlight on a ball of radius 1 is exp(-2 m β²), β the angle from its middle: its light is π/(2 (m + 1)).
    brightness = LIGHT / (BALL**2 * math.pi / (2 * (exponent + 1)))
    shade = triple(3 * [float(colour.encode(brightness))])
    lights = tuple(Light(triple(rounded(position, precision)), shade, 0.0) for position in positions)
    truth = cache(lambda: brightness * highlights(seen, ball, lights, where))
    column, row = where.astype(int).T

    def judge(result):
        off = np.abs(result.array.astype(float)[row, column] - truth()[row, column, None]).max(axis=-1)
        return within(off, VISIBLE)

    return Trial(Scene(seen, (ball,), lights), judge, parameters={"width": ACROSS, "height": ACROSS, **SAMPLES})


def touched(seen, ball, x, y):
    """Where eye rays through the places (x, y), in pixels, first meet a ball of radius 1: points, normals and the
    directions of the rays (..., 3)."""
    x, y = np.expand_dims(2 * x / ACROSS - 1, -1), np.expand_dims(1 - 2 * y / ACROSS, -1)
    way = x * np.array(seen.u) + y * np.array(seen.v) - seen.e
    way = way / np.linalg.norm(way, axis=-1, keepdims=True)
    middle = np.add(seen.centre, seen.e) - ball.centre
    nearest = middle - (way @ middle)[..., None] * way
    normal = nearest - np.sqrt(1 - (nearest * nearest).sum(axis=-1, keepdims=True)) * way
    return ball.centre + normal, normal, way


def highlights(seen, ball, lights, where):
    """The light of the highlights in each pixel (ACROSS, ACROSS), for lights of 1: the integral of LOC-4.

    By Gauss and Legendre in panels that double from the middle `where` of each highlight, and end at edges of pixels.
    """
    picture, deviation = np.zeros((ACROSS, ACROSS)), width_of(ball.material.exponent)
    steps = deviation / 2 * np.concatenate([[0], 2.0 ** np.arange(6)])  # up to 16 deviations
    for light, middle in zip(lights, where, strict=True):
        (i, x, across), (j, y, down) = (panels(place, steps) for place in middle)
        point, normal, way = touched(seen, ball, *np.meshgrid(x, y))
        to_light = light.position - point
        to_light = to_light / np.linalg.norm(to_light, axis=-1, keepdims=True)
        height = (normal * to_light).sum(axis=-1)
        cosine = (to_light * way).sum(axis=-1) - 2 * height * (normal * way).sum(axis=-1)
        value = np.where(height > 0, np.clip(cosine, 0, 1) ** ball.material.exponent, 0)
        np.add.at(picture, (j[:, None], i[None, :]), down[:, None] * across * value)
    return picture


def panels(middle, steps):
    """Pixels, places and weights of the quadrature along one side of the picture, around `middle`."""
    ends = np.concatenate([np.arange(ACROSS + 1.0), middle + steps, middle - steps])
    least, most = max(0, middle - steps[-1]), min(ACROSS, middle + steps[-1])
    ends = np.unique(np.concatenate([[least, most], ends[(ends > least) & (ends < most)]]))
    half, mean = np.diff(ends)[:, None] / 2, (ends[1:] + ends[:-1])[:, None] / 2
    pixel = np.repeat(mean.astype(int), len(NODES))
    return pixel, (mean + half * NODES).ravel(), (half * WEIGHTS).ravel()


def width_of(exponent):
    """The standard deviation of a small highlight on the ball, in pixels: exp(-2 m β²) has 1/(2 √m) radii."""
    return BALL / (2 * math.sqrt(exponent))


def light_missed(exponent, u, methods):
    """The error of a pixel with a glint of the deviation s, sampled n × n times.

    By a grid: 1/(24 n²) of the integral of Δf over the pixel, which is that of the slope along its border (the rule of
    midpoints): with s above a pixel LIGHT/(π s⁴), and else on average over the places of the glint some 4/√(2π)
    LIGHT/s; and where s is less than 1/n, the first harmonics of a Gaussian. By jittered samples: the standard
    deviation, of a slope in each square; ∫ |∇f|² is LIGHT²/(4 π s⁴).
    """
    if methods["sampler"] == "adaptive":
        return None
    s, n = width_of(exponent), 1 if methods["sampler"] == "one" else GRID
    if methods["sampler"] == "jittered":
        return min(LIGHT, LIGHT / (math.sqrt(48 * math.pi) * n**2 * s**2))
    border = LIGHT / (24 * n**2) * min(1 / (math.pi * s**4), 1.6 / s)
    return min(LIGHT, border + 4 * LIGHT * math.exp(-2 * (math.pi * s * n) ** 2))


def glint_limit(u, methods):
    """The exponent from which on `light_missed` is VISIBLE."""
    if methods["sampler"] == "adaptive":
        return None
    return next(m for m in np.logspace(0, 8, 801) if light_missed(m, u, methods) > VISIBLE)


def sums(n, precision, rng):
    """A pane of one colour that fills the picture, sampled n × n times a pixel. Its colour has all digits.

    A sum in float64 may be one of all samples (SAM-3), whatever the precision.
    """
    turn, centre = in_general_position(rng), rng.uniform(-1, 1, 3)
    shade = triple(rng.uniform(0.4, 1, 3))
    linear = rounded(colour.decode_exactly(shade), precision)

    def place(x, y):
        return triple(rounded(centre + turn @ [x, y, 0.3 * x + 0.2 * y], precision))

    pane = Polygon(Material(shade, 0.0, 1.0, OPAQUE, 1.0, 1.0), tuple(place(*c) for c in ((-9, -7), (9, -8), (1, 9))))
    seen = camera(centre + 3 * turn[:, 2], centre, turn[:, 0], turn[:, 1], precision)
    scene = Scene(seen, (pane,), ambient=WHITE, background=BLACK)

    def judge(result):
        off = np.abs(result.array.astype(float) / linear - 1).ravel()
        return within(off, (2 * n + OTHER_ROUNDINGS) * ROUNDOFF[precision] + n**2 * ROUNDOFF["float64"])

    parameters = {"width": FEW, "height": FEW, "depth": 0, "sampler": "uniform", "samples": n}
    return Trial(scene, judge, parameters=parameters)


ROWS = (
    Row(
        name="thin",
        code="S26",
        title="Wires thinner than a pixel",
        stress="pixels / width of the wire",
        failure="wires whose light is off by more than chance explains in 8 x 8 jittered samples (once in 1e9)",
        error="|Δ light| / light of the wire",
        levels=(0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0),
        method="sampler",
        source="study 3.1.2; Whitted 1980",
        make=wires,
        expected=light_lost,
        limit=corners_passed,
    ),
    Row(
        name="glint",
        code="S27",
        title="Highlights smaller than a pixel",
        stress="exponent",
        failure="pixels with a highlight that are off by more than 1/255, in linear light",
        error="|Δ pixel|",
        levels=(10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4, 1e5, 1e6, 1e7),
        method="sampler",
        make=glint,
        expected=light_missed,
        limit=glint_limit,
    ),
    Row(
        name="sums",
        code="S28",
        title="The sum of many samples of one colour",
        stress="samples of a side of a pixel",
        failure="channels off by more than 2 n + 4 roundings, and n² of float64",
        error="|Δ channel| / channel",
        levels=(4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0),
        source="Higham, Accuracy and stability of numerical algorithms, 2002, 4.2",
        make=lambda level, precision, rng: sums(int(level), precision, rng),
        expected=lambda level, u, methods: 2 * level * u,
    ),
)
