"""S1, S10, S13 as pictures to look at: a far sphere, edges of a mesh, two solids that touch.

The rows of the same codes that are lists of rays measure these failures.
"""

import numpy as np

from harness.scene.generate.icosphere import icosphere
from harness.scene.model import Box, Camera, Csg, Light, Material, Mesh, Operator, Scene, Sphere
from harness.stress.row import Finding, Row, Trial, directions, in_general_position, rounded

SIDE = 96  # pixels
WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
MATTE = Material((0.75, 0.6, 0.4), 0.0, 1.0, BLACK, 1.0, 1.0)
GLOW = (0.25, 0.25, 0.25)
RIM = 0.02  # of the radius: pixels closer to the silhouette are not judged


def far_sphere(level: float, precision: str, rng: np.random.Generator) -> Trial:
    """A sphere of radius 1 near the origin, seen from `level` radii away through a screen of 3 by 3."""
    turn, centre = in_general_position(rng), rounded(rng.uniform(-1, 1, 3), precision)
    u, v, e = rounded(1.5 * turn[0], precision), rounded(1.5 * turn[1], precision), rounded(level * turn[2], precision)
    light = tuple(centre + 3 * (turn[0] + turn[1] + 2 * turn[2]))
    scene = Scene(
        Camera(tuple(centre), tuple(u), tuple(v), tuple(e)),
        (Sphere(MATTE, tuple(centre), 1.0),),
        (Light(light, WHITE, 0.0),),
        ambient=GLOW,
        background=BLACK,
    )
    x, y = (2 * np.arange(SIDE) + 1) / SIDE - 1, 1 - (2 * np.arange(SIDE) + 1) / SIDE
    d = x[None, :, None] * u + y[:, None, None] * v - e
    impact = np.linalg.norm(np.cross(e, d), axis=-1) / np.linalg.norm(d, axis=-1)

    def judge(result):
        judged = np.abs(impact - 1) > RIM
        seen = np.asarray(result.array).max(axis=-1) > 0
        wrong = judged & (seen != (impact < 1)) | ~np.isfinite(result.array).all(axis=-1)
        return Finding(int(judged.sum()), int(wrong.sum()))

    return Trial(scene, judge, parameters={"width": SIDE, "height": SIDE, "depth": 0})


def along_an_edge(level: float, precision: str, rng: np.random.Generator) -> Trial:
    """A closed mesh, `level` radii from the origin, seen from inside: the middle row of pixels looks along an edge."""
    vertices, triangles = icosphere(2)
    vertices = vertices * rng.uniform(1, 1.3, (len(vertices), 1)) @ in_general_position(rng)
    grid = 8 * np.spacing(np.float32(level + 2) if precision == "float32" else level + 2)  # sums on it are exact
    eye = np.round(level * directions(rng, 1)[0] / grid) * grid
    vertices = eye + np.round(vertices / grid) * grid
    edges = sorted({tuple(sorted(pair)) for a, b, c in triangles.tolist() for pair in ((a, b), (b, c), (c, a))})
    first, last = vertices[list(edges[rng.integers(len(edges))])]
    ahead, aside = (first + last) / 2 - eye, (last - first) / 2
    up = rounded(np.cross(aside, ahead) * 0.35 / np.linalg.norm(ahead), precision)
    scene = Scene(
        Camera(tuple(eye + ahead), tuple(aside), tuple(up), tuple(-ahead)),  # the eye is C + e
        (Mesh(MATTE, vertices, triangles, False),),  # without gaps, but open, so that it is lit from inside
        (Light(tuple(rounded(eye + 0.3 * directions(rng, 1)[0], precision)), (0.8, 0.8, 0.8), 0.0),),
        ambient=GLOW,
        background=WHITE,
    )
    width, height = 2 * SIDE + 1, 25

    def judge(result):
        """The background is brighter than anything inside."""
        lit = ~(np.asarray(result.array).min(axis=-1) < 0.5)
        return Finding(lit.size, int(lit.sum()))

    return Trial(scene, judge, parameters={"width": width, "height": height, "depth": 0})


def touching(level: float, precision: str, rng: np.random.Generator) -> Trial:
    """The intersection of two boxes with a common face, which is empty, `level` box sizes from the origin."""
    turn, centre = in_general_position(rng), level * directions(rng, 1)[0]
    corner = rounded(centre, precision)
    a, b, c = (rounded(edge, precision) for edge in turn)
    beside = rounded(corner - a, precision)  # its high face on axis a is the low face of the other
    boxes = tuple(
        Box(None, tuple(place), (tuple(edge), tuple(b), tuple(c)))
        for place, edge in ((corner, a), (beside, rounded(corner - beside, precision)))
    )
    middle = corner + (b + c) / 2
    scene = Scene(
        Camera(
            *(tuple(rounded(vector, precision)) for vector in (middle, 0.8 * b, 0.8 * c, 3 * a + 0.4 * b + 0.3 * c))
        ),
        (Csg(MATTE, (*boxes, Operator.AND)),),
        ambient=WHITE,
        background=BLACK,
    )

    def judge(result):
        seen = ~(np.asarray(result.array).max(axis=-1) <= 0)
        return Finding(seen.size, int(seen.sum()))

    return Trial(scene, judge, parameters={"width": SIDE, "height": SIDE, "depth": 0})


def limit_of_spheres(u: float, methods) -> float | None:
    """The distance in radii at which a method for spheres breaks, as far_limit() of geometry/spheres.py."""
    return {"textbook": u**-0.5, "stable": u**-0.5, "robust": 1 / u}.get(methods["sphere"])


ROWS = (
    Row(
        name="far-picture",
        code="S1",
        title="A picture of a far sphere",
        stress="distance / radius",
        failure="pixels that show the sphere where it is not, or not where it is",
        levels=(1e1, 1e2, 1e3, 4e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9),
        make=far_sphere,
        method="sphere",
        limit=limit_of_spheres,
        source="Haines, Günther, Akenine-Möller, Ray Tracing Gems ch. 7",
    ),
    Row(
        name="cracks-picture",
        code="S10",
        title="A picture along an edge of a closed mesh",
        stress="distance of the mesh from the origin / radius",
        failure="pixels through which the background shines",
        levels=(1.0, 1e1, 1e2, 1e3, 1e4),
        make=along_an_edge,
        method="triangle",
        source="Woop, Benthin, Wald, JCGT 2(1), 2013",
    ),
    Row(
        name="coincident-picture",
        code="S13",
        title="A picture of what two touching boxes have in common",
        stress="distance from the origin / size",
        failure="pixels that show a solid that is empty",
        levels=(1.0, 1e1, 1e2, 1e3, 1e4),
        make=touching,
        method="merge",
        source="regularised sets: Requicha 1980",
    ),
)
