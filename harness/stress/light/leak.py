"""S8: an offset that is too long skips near surfaces: the contact shadow under a panel is lost."""

import math

from harness.scene.model import Light, Polygon, Scene
from harness.stress.exact import triple
from harness.stress.row import Finding, Row, Trial, in_general_position, rounded
from harness.stress.view import MATTE, WHITE, camera

WIDTH, HEIGHT = 8, 256  # pixels: along the hinge, and from it to the panel's end
ANGLE = math.radians(10)
FAR = 1e3  # of the light, in lengths of the panel


def wedge(scale, precision, rng, parameters=()):
    """A panel of length `scale` that stands on the floor with one edge, and a camera that sees the floor below it.

    The screen lies on the floor, so a row of pixels is a line at one distance from the edge. Local axes: x away from
    the edge, y along it, z up.
    """
    turn = scale * in_general_position(rng)
    origin = scale * rng.uniform(-1, 1, 3)
    cosine, sine = math.cos(ANGLE), math.sin(ANGLE)

    def place(x, y, z):
        return rounded(origin + turn @ [x, y, z], precision)

    def polygon(*corners):
        return Polygon(MATTE, tuple(triple(place(*corner)) for corner in corners))

    floor = polygon((-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0))
    panel = polygon((0, -2, 0), (cosine, -2, sine), (cosine, 2, sine), (0, 2, 0))
    eye = place(1.5 * cosine, 0.1, 0.75 * sine)
    seen = camera(eye, place(cosine / 2, 0, 0), turn @ [0, 1, 0], turn @ [cosine / 2, 0, 0], precision)
    light = Light(triple(place(0, 0, FAR)), WHITE, 0.0)  # above the edge: feelers go into the angle

    def judge(result):
        lost = ~(result.array.max(axis=-1) == 0)  # NaN is no shadow either
        return Finding(lost.size, lost.sum(), lost.mean(axis=0))

    all_parameters = {"width": WIDTH, "height": HEIGHT, "depth": 0, "shadows": True, **dict(parameters)}
    return Trial(Scene(seen, (floor, panel), (light,)), judge, parameters=all_parameters)


def lost(length):
    """The share of the shadow above which the panel is no higher than `length`, in lengths of the panel."""
    return min(1.0, length / math.sin(ANGLE))


def lost_by_method(level, u, methods):
    epsilon = methods["epsilon"]
    size = 6.0  # of the floor; its corners are about this far from the origin
    steps = {"bounded": 9 / 8 * size * epsilon, "relative": size * epsilon, "fixed": epsilon / level, "none": 0.0}
    return lost(steps[methods["offset"]])


ERROR = "share of the shadow that is lost"

ROWS = (
    Row(
        name="leak",
        code="S8",
        title="Contact shadows that are lost, by the scale of the scene",
        stress="length of the panel",
        failure="points in the shadow that are lit",
        error=ERROR,
        levels=(1e2, 1.0, 1e-1, 1e-2, 3e-3, 1e-3, 1e-4, 1e-5, 1e-6),
        method="offset",
        make=lambda level, precision, rng: wedge(level, precision, rng),
        expected=lost_by_method,
        limit=lambda u, methods: methods["epsilon"] / math.sin(ANGLE) if methods["offset"] == "fixed" else None,
    ),
    Row(
        name="leak-epsilon",
        code="S8",
        title="Contact shadows that are lost, by the length of a fixed offset",
        stress="offset / length of the panel",
        failure="points in the shadow that are lit",
        error=ERROR,
        levels=(1e-18, 1e-16, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1e-1),
        make=lambda level, precision, rng: wedge(1.0, precision, rng, {"offset": "fixed", "epsilon": float(level)}),
        expected=lambda level, u, methods: lost(level),
        limit=lambda u, methods: math.sin(ANGLE),
    ),
)
