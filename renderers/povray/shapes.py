"""The shapes: their POV-Ray text, point-inside test and bounding box.

Arrays come in the scene's unit and are kept multiplied by the scale of the export (scene.py).
"""

from itertools import pairwise

import numpy as np

INSIDE_VECTOR = (0.5377, 0.2113, 0.8163)  # along no axis and no edge that people write


def number(value):
    """The shortest text that is the same float64."""
    return repr(float(value)).removesuffix(".0")


def vector(values):
    return "<" + ", ".join(map(number, values)) + ">"


class Sphere:
    solid = True

    def __init__(self, row, scale):
        *self.centre, self.radius = row * scale

    def text(self, words=""):
        return f"sphere {{ {vector(self.centre)}, {number(self.radius)}{words} }}"

    def contains(self, point):
        return np.linalg.norm(point - self.centre) < self.radius

    def bounds(self):
        return np.subtract(self.centre, self.radius), np.add(self.centre, self.radius)


class Frame:
    """A unit shape with three vectors for its axes: POV-Ray's `matrix` takes them and the origin as its rows."""

    solid = True

    def __init__(self, row, scale):
        self.origin, self.axes = row[:3] * scale, row[3:].reshape(3, 3) * scale

    def text(self, words=""):
        rows = ", ".join(number(value) for value in (*self.axes.ravel(), *self.origin))
        return f"{self.UNIT} matrix <{rows}>{words} }}"

    def local(self, point):
        return np.linalg.solve(self.axes.T, point - self.origin)


class Box(Frame):
    UNIT = "box { 0, 1"

    def contains(self, point):
        at = self.local(point)
        return bool(((at > 0) & (at < 1)).all())

    def bounds(self):
        return self.origin + np.minimum(self.axes, 0).sum(axis=0), self.origin + np.maximum(self.axes, 0).sum(axis=0)


class Ellipsoid(Frame):
    UNIT = "sphere { 0, 1"

    def contains(self, point):
        return np.linalg.norm(self.local(point)) < 1

    def bounds(self):
        reach = np.linalg.norm(self.axes, axis=0)
        return self.origin - reach, self.origin + reach


class Polygon:
    """A fan of triangles: POV-Ray's own polygon is left out without a word if it is not planar to 1e-10."""

    solid = False

    def __init__(self, vertices, scale):
        self.vertices = vertices * scale

    def text(self, words=""):
        first = vector(self.vertices[0])
        rest = [vector(v) for v in self.vertices[1:]]
        fan = [f"triangle {{ {first}, {b}, {c}" for b, c in pairwise(rest)]
        return f"{fan[0]}{words} }}" if len(fan) == 1 else f"union {{ {' } '.join(fan)} }}{words} }}"

    def bounds(self):
        return self.vertices.min(axis=0), self.vertices.max(axis=0)


class Mesh:
    def __init__(self, vertices, triangles, scale, solid=True):
        used, rows = np.unique(triangles, return_inverse=True)
        self.vertices, self.triangles = vertices[used] * scale, rows.reshape(triangles.shape)
        self.solid = solid

    def text(self, words=""):
        places = ",\n  ".join(vector(v) for v in self.vertices)
        faces = ",\n  ".join(f"<{a}, {b}, {c}>" for a, b, c in self.triangles)
        inside = f"\n inside_vector {vector(INSIDE_VECTOR)}" if self.solid else ""
        return (
            f"mesh2 {{\n vertex_vectors {{ {len(self.vertices)},\n  {places} }}"
            f"\n face_indices {{ {len(self.triangles)},\n  {faces} }}{inside}{words} }}"
        )

    def contains(self, point):
        """Odd number of triangles crossed by the half-line along INSIDE_VECTOR (Möller and Trumbore)."""
        a, b, c = self.vertices[self.triangles].swapaxes(0, 1)
        edge, other, arm = b - a, c - a, point - a
        across = np.cross(INSIDE_VECTOR, other)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / (edge * across).sum(axis=1)
            u = (arm * across).sum(axis=1) * inverse
            turned = np.cross(arm, edge)
            v = turned @ np.array(INSIDE_VECTOR) * inverse
            t = (other * turned).sum(axis=1) * inverse
            return bool(np.count_nonzero((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)) % 2)

    def bounds(self):
        return self.vertices.min(axis=0), self.vertices.max(axis=0)
