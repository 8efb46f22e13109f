"""S7: rays that leave a sphere and hit it again, by its size, its distance from the origin, and a fixed offset."""

import numpy as np

from harness.scene.model import Light, Scene, Sphere
from harness.stress.exact import triple
from harness.stress.row import Finding, Row, Trial, directions, rounded
from harness.stress.view import MATTE, camera, eye_rays

SIDE = 100  # pixels
LIT = 0.02  # least n·l at which a light must be seen
RIM = 0.15  # least -d·n at which a pixel is judged
FAR = 1e3  # radii to the lights


def ball(radius, away, precision, rng, parameters=()):
    """A matte ball `away` radii from the origin, and three lights: one red, one green, one blue."""
    radius, (to_centre, to_eye, *to_lights) = float(rounded(radius, precision)), directions(rng, 5)
    centre = rounded(away * radius * to_centre, precision)
    lights = []
    for channel, way in enumerate(to_lights):
        way *= np.sign(way @ to_eye)  # else it may light only what the eye does not see
        place = rounded(centre + FAR * radius * way, precision)
        lights.append(Light(triple(place), triple(np.eye(3)[channel]), 0.0))
    across = np.cross(to_eye, directions(rng, 1)[0])
    across /= np.linalg.norm(across)
    u, v = 1.05 * radius * across, 1.05 * radius * np.cross(to_eye, across)
    view = camera(centre + 4 * radius * to_eye, centre, u, v, precision)
    scene = Scene(view, (Sphere(MATTE, triple(centre), radius),), tuple(lights))

    def judge(result):
        lit = must_be_lit(scene)
        return Finding(lit.sum(), (~(result.array > 0) & lit).sum())

    all_parameters = {"width": SIDE, "height": SIDE, "depth": 0, "shadows": True, **dict(parameters)}
    return Trial(scene, judge, parameters=all_parameters)


def must_be_lit(scene):
    """The channels of pixels, bool (SIDE, SIDE, 3), that see a light by a margin larger than any rounding."""
    eye, way = eye_rays(scene.camera, SIDE, SIDE)
    (sphere,) = scene.objects
    f = eye - np.array(sphere.centre)
    b = -way @ f
    square = sphere.radius**2 - ((f + b[..., None] * way) ** 2).sum(-1)
    t = b - np.sqrt(np.maximum(square, 0))
    normal = (f + t[..., None] * way) / sphere.radius
    facing = (square > 0) & (-(way * normal).sum(-1) > RIM)
    lit = np.empty((SIDE, SIDE, 3), bool)
    for channel, light in enumerate(scene.lights):
        to_light = np.subtract(light.position, sphere.centre) - sphere.radius * normal
        cosine = (normal * to_light).sum(-1) / np.linalg.norm(to_light, axis=-1)
        lit[..., channel] = facing & (cosine > LIT)
    return lit


def displacement(radius, away, methods):
    """The largest displacement of a ray's origin by OFF-1, in radii, on a ball `away` radii from the origin."""
    epsilon = methods["epsilon"]
    reach = max(1.0, away + 1)
    return {
        "bounded": epsilon * (1 + reach / 8),
        "relative": epsilon * reach,
        "fixed": epsilon / radius,
        "none": 0.0,
    }[methods["offset"]]


def too_small(u, methods):
    """The coordinate, in the scene's unit, from which on rounding swallows a fixed offset."""
    return methods["epsilon"] / u if methods["offset"] == "fixed" else None


ACNE = {
    "code": "S7",
    "failure": "lit points that are shadowed by their own surface",
    "error": "displacement of the ray's origin / radius",
}
OFFSETS = {
    "method": "offset",
    "source": "Wächter and Binder, Ray Tracing Gems, ch. 6; pbrt 4e, 6.8",
    "limit": too_small,
    **ACNE,
}
ROWS = (
    Row(
        name="acne-scale",
        title="Surfaces that shadow themselves, by the scale of the scene",
        stress="radius of the sphere",
        levels=(1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e3, 1e4, 1e6, 1e9, 1e13),
        make=lambda level, precision, rng: ball(level, 0.0, precision, rng),
        expected=lambda level, u, methods: displacement(level, 0.0, methods),
        **OFFSETS,
    ),
    Row(
        name="acne-offset",
        title="Surfaces that shadow themselves, by their distance from the origin",
        stress="distance from the origin / radius",
        levels=(1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4),
        make=lambda level, precision, rng: ball(1.0, level, precision, rng),
        expected=lambda level, u, methods: displacement(1.0, level, methods),
        **OFFSETS,
    ),
    Row(
        name="acne-epsilon",
        title="Surfaces that shadow themselves, by the length of a fixed offset",
        stress="offset / radius",
        levels=(1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14, 1e-16, 1e-18),
        make=lambda level, precision, rng: ball(1.0, 3.0, precision, rng, {"offset": "fixed", "epsilon": float(level)}),
        expected=lambda level, u, methods: level,
        limit=lambda u, methods: 4 * u,  # the rounding of a point four radii away
        **ACNE,
    ),
)
