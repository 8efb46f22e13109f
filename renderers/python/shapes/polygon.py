"""Convex planar polygons (POL-1 to POL-4)."""

from itertools import pairwise

from ..vector import add, corners, cross, dot, largest, length, normalise, scale, subtract
from .mesh import shear
from .shapes import Shape

GRAZING = 2.0**-10  # |w| of POL-1 below which rounding can move t past the polygon


class Polygon(Shape):
    """A polygon; `edges` holds, for each edge, a point on it and the vector in the plane that points inside (POL-4)."""

    flat = True

    def __init__(self, vertices, material, identity, number):
        super().__init__(material, identity)
        self.vertices = vertices
        self.first = vertices[0]
        arms = [subtract(vertex, self.first) for vertex in vertices]
        self.size = max(largest(arm) for arm in arms)
        normal = (number.real(0),) * 3
        for a, b in pairwise(arms):
            normal = add(normal, cross(a, b))
        self.normal = normalise(normal, number.sqrt)
        self.slack = tuple(8 * number.roundoff * abs(n) for n in self.normal)
        edges = [subtract(after, v) for v, after in zip(vertices, vertices[1:] + vertices[:1], strict=True)]
        self.edges = [(v, cross(self.normal, edge)) for v, edge in zip(vertices, edges, strict=True)]
        # beyond a sharp corner both edges are still near
        lengths = [length(edge, number.sqrt) for edge in edges]
        sines = [length(cross(edges[i - 1], edges[i]), number.sqrt) for i in range(len(edges))]
        self.condition = max((lengths[i - 1] * lengths[i] / s for i, s in enumerate(sines) if s), default=1)

    def rounding(self, origin):
        """The most that rounding can make of the distance of `origin` from the plane, where it lies in it (POL-1)."""
        return sum(s * (abs(o) + abs(v)) for s, o, v in zip(self.slack, origin, self.first, strict=True))

    def bounds(self):
        return corners(self.vertices)

    def surface(self, origin, direction, t, _face):
        """Point and normal, towards the origin, of the hit at distance t (POL-3)."""
        p = add(origin, scale(direction, t))
        point = subtract(p, scale(self.normal, dot(subtract(p, self.first), self.normal)))
        return point, self.normal if dot(direction, self.normal) < 0 else scale(self.normal, -1)


def nearest(polygons, origin, direction, best, _sqrt):
    """The nearest hit closer than `best` = (t, shape, face), or `best` (POL-1, POL-2)."""
    for polygon in polygons:
        w = dot(direction, polygon.normal)
        if w == 0:
            continue
        height = dot(subtract(polygon.first, origin), polygon.normal)
        t = height / w
        grazes = abs(w) < GRAZING
        if grazes or 0 < t < best[0]:
            crossing = cross_fan(polygon.vertices, origin, direction)
            if crossing is None or abs(height) <= polygon.rounding(origin):
                continue
            if grazes:
                t = crossing
            if 0 < t < best[0]:
                best = t, polygon, None
    return best


def cross_fan(vertices, origin, direction):
    """Where the line crosses a triangle v_0, v_i, v_(i+1), by TRI-1; None if it crosses none (POL-2)."""
    kx, ky, kz, sx, sy, sz = shear(direction)
    ox, oy, oz = origin[kx], origin[ky], origin[kz]
    places = []
    for vertex in vertices:
        z = vertex[kz] - oz
        places.append((vertex[kx] - ox - sx * z, vertex[ky] - oy - sy * z, z))
    (ax, ay, az), (bx, by, bz) = places[:2]
    w = ax * by - ay * bx
    for cx, cy, cz in places[2:]:
        u = bx * cy - by * cx
        v = cx * ay - cy * ax
        if (u >= 0 and v >= 0 and w >= 0) or (u <= 0 and v <= 0 and w <= 0):
            det = u + v + w
            if det != 0:
                return (u * (sz * az) + v * (sz * bz) + w * (sz * cz)) / det
        w, bx, by, bz = -v, cx, cy, cz
    return None


def nearest_in_plane(polygons, origin, direction, best, _sqrt):
    """As `nearest`, each polygon in its own plane (POL-4)."""
    for polygon in polygons:
        w = dot(direction, polygon.normal)
        if w == 0:
            continue
        t = dot(subtract(polygon.first, origin), polygon.normal) / w
        if 0 < t < best[0]:
            p = add(origin, scale(direction, t))
            if all(dot(inward, subtract(p, vertex)) >= 0 for vertex, inward in polygon.edges):
                best = t, polygon, None
    return best


SEARCHES = {"watertight": nearest, "moller-trumbore": nearest_in_plane}
