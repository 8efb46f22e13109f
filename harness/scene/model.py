"""Defines a scene as its file describes it: numbers as written, colours in sRGB, lengths in the scene's own unit.

A `Vector` is three floats: a point, a direction or red, green, blue. Scenes from the readers are valid: finite, in
range and of proper shapes (check.py).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Camera:
    """Centre of the screen, its half-extents `u` and `v`, and the eye at `centre + e` (CAM-1).

    `line` is that of `e` in the file, from 1; 0 if it came from no file.
    """

    centre: Vector
    u: Vector
    v: Vector
    e: Vector
    line: int = field(default=0, compare=False, kw_only=True)


@dataclass(frozen=True, slots=True)
class Light:
    """A point light, or with a radius a sphere. `line` is its line in the file, from 1; 0 if it came from no file."""

    position: Vector
    colour: Vector
    radius: float
    line: int = field(default=0, compare=False, kw_only=True)


@dataclass(frozen=True, slots=True)
class Air:
    """The medium around all objects. attenuation: the transmitted share of light, per channel, for a unit of length."""

    eps_r: float = 1.0
    mu_r: float = 1.0
    attenuation: Vector = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Material:
    """Attenuation is as in `Air`; (0, 0, 0) is opaque. Course files mark mirrors by eps_r = 1e6, mu_r = 1.

    roughness: 0 of a perfect mirror, up to 1 of a glossy one: the width of its lobe (GLO-2).
    """

    diffuse: Vector
    k_s: float
    exponent: float
    attenuation: Vector
    eps_r: float
    mu_r: float
    roughness: float = 0.0


@dataclass(frozen=True, slots=True)
class Object:
    """The base of all shapes. `line` is its line in the file, from 1; 0 if it came from no file.

    A part of a CSG solid has no material of its own: None.
    """

    material: Material | None
    line: int = field(default=0, compare=False, kw_only=True)


@dataclass(frozen=True, slots=True)
class Sphere(Object):
    """A centre and a radius."""

    centre: Vector
    radius: float


@dataclass(frozen=True, slots=True)
class Box(Object):
    """A corner and the three edges that leave it, at any angle to each other."""

    corner: Vector
    edges: tuple[Vector, Vector, Vector]


@dataclass(frozen=True, slots=True)
class Polygon(Object):
    """A convex, planar polygon; vertices in order, in either direction."""

    vertices: tuple[Vector, ...]


@dataclass(frozen=True, slots=True)
class Ellipsoid(Object):
    """A centre and three semi-axes, at any angle to each other."""

    centre: Vector
    axes: tuple[Vector, Vector, Vector]


@dataclass(frozen=True, slots=True, eq=False)
class Mesh(Object):
    """Triangles in the scene's frame, as mesh.py makes them: float64 `vertices` (V, 3), int32 `triangles` (T, 3).

    A closed mesh is a solid, its triangles turned outward; an open one is flat. path: its file; position, rotation and
    scale: how it was placed, T * Rx * Ry * Rz * S, angles in degrees. Meshes are equal if their triangles are.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    closed: bool
    path: str = ""
    position: Vector = (0.0, 0.0, 0.0)
    rotation: Vector = (0.0, 0.0, 0.0)
    scale: float = 1.0

    def _key(self):
        return self.material, self.closed, self.vertices.tobytes(), self.triangles.tobytes()

    def __eq__(self, other):
        return isinstance(other, Mesh) and self._key() == other._key()

    def __hash__(self):
        return hash((self.material, self.closed, self.vertices.shape, self.triangles.shape))


class Operator(Enum):
    """OR and AND take the two operands before them, NOT takes one."""

    OR = "OR"
    AND = "AND"
    NOT = "NOT"


@dataclass(frozen=True, slots=True)
class Csg(Object):
    """A solid made of others: a tree in postfix notation, so that any depth of nesting is read without recursion.

    Parts are spheres, boxes, ellipsoids and closed meshes, of material None.
    """

    code: tuple[Object | Operator, ...]

    def parts(self):
        """The solids in the tree."""
        return [word for word in self.code if not isinstance(word, Operator)]

    def fold(self, part: Callable, either: Callable, both: Callable, other: Callable) -> Any:
        """Evaluates the tree: `part` for each part; `either`, `both` and `other` for OR, AND and NOT."""
        stack = []
        for word in self.code:
            if word is Operator.NOT:
                stack.append(other(stack.pop()))
            elif isinstance(word, Operator):
                second = stack.pop()
                stack.append((either if word is Operator.OR else both)(stack.pop(), second))
            else:
                stack.append(part(word))
        (whole,) = stack
        return whole


@dataclass(frozen=True, slots=True)
class Scene:
    """A scene. objects: in the order of the file; file: its path, if it came from one."""

    camera: Camera
    objects: tuple[Object, ...] = ()
    lights: tuple[Light, ...] = ()
    ambient: Vector = (0.0, 0.0, 0.0)
    background: Vector = (0.0, 0.0, 0.0)
    air: Air = Air()
    file: Any = field(default=None, compare=False, kw_only=True)
