"""A scene as its file says it: numbers as written, colours in sRGB, lengths in the scene's own unit.

A `Vector` is three floats: a point, a direction or red, green, blue. What the readers hand out is valid:
finite, in range and of proper shapes (check.py).
"""

from dataclasses import dataclass, field

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Camera:
    """Centre of the screen, its half-extents `u` and `v`, and the eye at `centre + e` (CAM-1)."""

    centre: Vector
    u: Vector
    v: Vector
    e: Vector


@dataclass(frozen=True, slots=True)
class Light:
    position: Vector
    colour: Vector
    radius: float


@dataclass(frozen=True, slots=True)
class Air:
    """The medium around everything. Attenuation is what is left, per channel, after a unit of length."""

    eps_r: float = 1.0
    mu_r: float = 1.0
    attenuation: Vector = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Material:
    """Attenuation is as in `Air`; (0, 0, 0) is opaque. Course files mark mirrors by eps_r = 1e6, mu_r = 1."""

    diffuse: Vector
    k_s: float
    exponent: float
    attenuation: Vector
    eps_r: float
    mu_r: float
    roughness: float = 0.0


@dataclass(frozen=True, slots=True)
class Object:
    """What all shapes have. `line` is where the file has it, from 1; 0 if it came from no file."""

    material: Material
    line: int = field(default=0, compare=False, kw_only=True)


@dataclass(frozen=True, slots=True)
class Sphere(Object):
    centre: Vector
    radius: float


@dataclass(frozen=True, slots=True)
class Box(Object):
    """A corner and the three edges that leave it, at any angle to each other."""

    corner: Vector
    edges: tuple[Vector, Vector, Vector]


@dataclass(frozen=True, slots=True)
class Polygon(Object):
    """Convex and planar; vertices in order round it, either way."""

    vertices: tuple[Vector, ...]


@dataclass(frozen=True, slots=True)
class Ellipsoid(Object):
    """A centre and three semi-axes, at any angle to each other."""

    centre: Vector
    axes: tuple[Vector, Vector, Vector]


@dataclass(frozen=True, slots=True)
class Scene:
    """`objects` are in the order of the file."""

    camera: Camera
    objects: tuple[Object, ...] = ()
    lights: tuple[Light, ...] = ()
    ambient: Vector = (0.0, 0.0, 0.0)
    background: Vector = (0.0, 0.0, 0.0)
    air: Air = Air()
