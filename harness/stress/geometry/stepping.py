"""S25: solids that a ray steps through, starting anew behind each face: thin parts, and faces that it grazes."""

import numpy as np

from harness.scene.model import Box, Csg, Operator, Sphere
from harness.stress import exact
from harness.stress.row import Row, Trial, directions, in_general_position, rounded

RAYS = 10_000
SIDE = 0.7  # of the plate, whose corners lie inside of the ball
MIDDLE = 0.1, 0.9  # part of a face that rays pass through
WORST = 1e-3  # of the radius, or of the way to the hit: hits that are further off are wrong
START, END = ((-0.15, -0.15), (-0.05, 0.15)), ((0.2, -0.25), (0.4, 0.25))  # x and y of the rays, smallest and largest


def box_of(corner, edges, precision) -> Box:
    return Box(None, exact.triple(corner), tuple(exact.triple(rounded(edge, precision)) for edge in edges))


def thin_part(level: float, precision: str, rng: np.random.Generator) -> Trial:
    """A plate of thickness 1/level in a ball of radius 1, OR. Rays in the ball pass through the plate, and hit where
    they leave the ball."""
    turn, centre = in_general_position(rng), rounded(rng.uniform(-0.3, 0.3, 3), precision)
    corner = rounded(centre - (SIDE * turn[0] + SIDE * turn[1]) / 2, precision)
    plate = box_of(corner, (SIDE * turn[0], SIDE * turn[1], turn[2] / level), precision)
    aims = corner + SIDE * rng.uniform(*MIDDLE, (RAYS, 2)) @ turn[:2]
    d = directions(rng, RAYS)
    d[np.abs(d @ turn[2]) < 0.1] = turn[2]
    rays = np.hstack([rounded(aims - 0.3 * d, precision), rounded(d, precision)])
    ball = Sphere(None, exact.triple(centre), 1.0)
    solid = Csg(exact.MATERIAL, (ball, plate, Operator.OR))
    return exact.trial(rays, lambda: exact.sphere(rays, centre, 1.0), solid, unit=1.0, worst=WORST)


def grazed_face(level: float, precision: str, rng: np.random.Generator) -> Trial:
    """A part with a slanted end and a box, OR. Rays start in both, pass the slanted end, and leave the box through its
    low side z = 0 at an angle with the sine 1/level."""
    turn, place = in_general_position(rng), rng.uniform(-0.3, 0.3, 3)

    def part(corner, *edges) -> Box:
        return box_of(rounded(place + np.array(corner) @ turn, precision), np.array(edges) @ turn, precision)

    box = part([-0.5, -0.5, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1])
    slanted = part([-0.4, -0.3, 0.2], [0.3, 0, 0], [0, 0.6, 0], [0.4, 0, -0.4])  # its end is x + z = 0.1
    starts, ends = (rng.uniform([*low, 0], [*high, 0], (RAYS, 3)) for low, high in (START, END))
    way = np.linalg.norm(ends - starts, axis=1)
    starts[:, 2] = way / np.sqrt(level**2 - 1)
    d = (ends - starts) / np.linalg.norm(ends - starts, axis=1, keepdims=True)
    rays = np.hstack([rounded(place + starts @ turn, precision), rounded(d @ turn, precision)])
    solid = Csg(exact.MATERIAL, (slanted, box, Operator.OR))
    return exact.trial(rays, lambda: side(rays, box), solid, worst=WORST)


def side(rays, box: Box) -> exact.Truth:
    """Hits of the plane of a box's low side on its third axis."""
    scale, (o, d, c, a, b) = exact.whole(rays[:, :3], rays[:, 3:], box.corner, *box.edges[:2])
    normal, bits = exact.cross(a, b), scale + 64
    t = (exact.dot(c - o, normal) << bits) // exact.dot(d, normal)
    return exact.Truth((t > 0).astype(bool), t, bits)


def thickness_passed_over(_u: float, methods) -> float | None:
    """The level at which a plate is as thin as the step (OFF-1)."""
    if methods["csg"] != "stepping":
        return None
    return 1 / (methods["epsilon"] * (1.0 if methods["offset"] == "fixed" else SIDE))


def off_by_the_step(level: float, u: float, methods) -> float:
    """The error of a hit behind a slanted face (CSG-7), or of rounding, in ways of about 0.4."""
    return level * (methods["epsilon"] if methods["csg"] == "stepping" else u)


SHARED = {"code": "S25", "method": "csg", "source": "CSG-7; the study 3.2.2"}
ROWS = (
    Row(
        "thin-part",
        title="A plate inside a ball, OR, from inside",
        stress="radius of the ball / thickness of the plate",
        failure="rays that do not hit the ball's far side, or more than 0.001 beside it",
        error="of the radius",
        levels=(1e1, 1e3, 1e5, 1e6, 1e7, 1e9, 1e11, 1e13, 1e14, 1e15, 1e16),
        make=thin_part,
        limit=thickness_passed_over,
        **SHARED,
    ),
    Row(
        "grazed-face",
        title="Two parts, OR, of which one is grazed from inside behind a face of the other",
        stress="1 / sine of the angle between ray and face",
        failure="rays that do not hit the grazed face, or more than 0.001 of the way beside it",
        error="of the way",
        levels=(1e1, 3e1, 1e2, 3e2, 1e3, 3e3, 1e4, 3e4, 1e5),
        make=grazed_face,
        expected=off_by_the_step,
        **SHARED,
    ),
)
