"""Solids made of others by OR, AND and NOT (CSG-1 to CSG-7)."""

from ..vector import add, corners, dot, largest, scale, subtract
from . import bvh, mesh
from .shapes import Shape

OR, AND, NOT = "OR", "AND", "NOT"


class Mesh:
    """A closed mesh as a part."""

    condition = 1

    def __init__(self, triangles, accelerate, number):
        self.triangles = triangles
        self.rows = [triangle.row for triangle in triangles]
        self.accelerate, self.number, self.tree = accelerate, number, None

    def build(self):
        """Builds its hierarchy, if the job asks for one (HIT-6)."""
        if self.accelerate:
            self.tree = bvh.Tree([(None, triangle) for triangle in self.triangles], self.number)

    def bounds(self):
        return corners([vertex for row in self.rows for vertex in row[:3]])

    def crossings(self, origin, direction):
        """The boundaries (t, shape, face) on the whole line, in rising order (CSG-1)."""
        rows = self.rows if self.tree is None else self.tree.along(origin, direction)
        found = mesh.crossings(rows, origin, direction)
        found.sort(key=lambda boundary: boundary[0])
        return found


class Boundary:
    """A crossing of the surface of a solid; `nearest` returns it in place of a shape."""

    flat, sets = False, None

    def __init__(self, solid, t, shape, face, leaves, origin, direction):
        self.material, self.identity, self.bit, self.order = solid.material, solid.identity, solid.bit, solid.order
        self.t, self.size = t, shape.size
        self.point, normal = shape.surface(origin, direction, t, face)
        slope = dot(direction, normal)
        self.normal = normal if (slope > 0) == leaves else scale(normal, -1)  # CSG-5
        self.slope = abs(slope)
        self.reach = max(largest(add(origin, scale(direction, t))), largest(origin), self.size)

    def surface(self, _origin, _direction, _t, _face):
        return self.point, self.normal


class Solid(Shape):
    """`code` is postfix: parts, each with `crossings`, and OR, AND and NOT."""

    order = 0

    def __init__(self, code, material, identity, number, merge="tolerant", sliver=None):
        super().__init__(material, identity)
        self.parts, self.code = [], []
        for word in code:
            if word in (OR, AND, NOT):
                self.code.append(word)
            else:
                self.code.append(len(self.parts))
                self.parts.append(word)
        self.condition = max(part.condition for part in self.parts)
        self.meshes = [part for part in self.parts if isinstance(part, Mesh)]
        self.has_tree = any(part.accelerate for part in self.meshes)
        self.tolerance = sliver or 16 * number.roundoff  # CSG-4
        if merge == "none":
            self.tolerance = -1  # nothing is so near

    def value(self, inside):
        """Returns whether a point is inside the solid; `inside` says so for each part."""
        stack = []
        for word in self.code:
            if word is NOT:
                stack[-1] = not stack[-1]
            elif word is OR:
                right = stack.pop()
                stack[-1] = stack[-1] or right
            elif word is AND:
                right = stack.pop()
                stack[-1] = stack[-1] and right
            else:
                stack.append(inside[word])
        return stack[0]

    def crossings(self, origin, direction):
        """The boundaries (t, part, shape, face) of all parts on the whole line, in the order of CSG-3."""
        found = []
        for index, part in enumerate(self.parts):
            found += [(t, index, shape, face) for t, shape, face in part.crossings(origin, direction)]
        found.sort(key=lambda crossing: crossing[0])
        return found

    def boundaries(self, origin, direction):
        """Returns the solid's boundaries on the whole line, without slivers and gaps (CSG-3, CSG-4)."""
        found = self.crossings(origin, direction)
        if not found:
            return found
        inside = [False] * len(self.parts)
        value = self.value(inside)
        kept = []
        for t, index, shape, face in found:
            inside[index] = not inside[index]
            before, value = value, self.value(inside)
            if value == before:
                continue
            boundary = Boundary(self, t, shape, face, before, origin, direction)
            if kept and self.coincide(kept[-1], boundary):
                kept.pop()
            else:
                kept.append(boundary)
        return kept

    def coincide(self, a, b):
        """Returns whether two boundaries are closer than rounding can resolve (CSG-4, without its division)."""
        return (b.t - a.t) * min(a.slope, b.slope) <= self.tolerance * max(a.reach, b.size)

    def bounds(self):
        """Bounds of a box that contains the solid; None if it is unbounded."""
        stack = []  # bounds of the set and of its complement
        for word in self.code:
            if word is NOT:
                stack[-1] = stack[-1][::-1]
            elif word in (OR, AND):
                (right, not_right), (left, not_left) = stack.pop(), stack.pop()
                if word is OR:
                    stack.append((union(left, right), intersection(not_left, not_right)))
                else:
                    stack.append((intersection(left, right), union(not_left, not_right)))
            else:
                stack.append((self.parts[word].bounds(), None))
        return stack[0][0]


class Stepping(Solid):
    """A solid that a ray finds by starting anew behind each face, until it is in it or out of it (CSG-7).

    leave: of shade.leaving.
    """

    def __init__(self, code, material, identity, number, leave):
        super().__init__(code, material, identity, number)
        self.leave = leave
        self.most = sum(len(part.rows) if isinstance(part, Mesh) else 2 for part in self.parts)
        self.common = not self.meshes and not {OR, NOT} & set(self.code)  # an AND of convex parts alone

    def boundaries(self, origin, direction):
        """Returns the hit alone, if there is one."""
        start, inside = origin, None
        for _ in range(self.most):
            found = self.crossings(start, direction)
            if inside is None:
                inside = [False] * len(self.parts)
                for t, part, _, _ in found:
                    inside[part] ^= t <= 0
                value = self.value(inside)
            crossed = next((crossing for crossing in found if crossing[0] > 0), None)
            if crossed is None:
                break
            t, part, shape, face = crossed
            inside[part] = not inside[part]
            if self.value(inside) != value:
                hit = Boundary(self, t, shape, face, value, start, direction)
                hit.t += dot(subtract(start, origin), direction)
                return [hit]
            if self.common and not inside[part]:
                break
            point, normal = shape.surface(start, direction, t, face)
            start = self.leave(point, normal, shape.size, 1 if dot(direction, normal) > 0 else -1)
        return []

    def bounds(self):
        """None: a ray that steps is moved off its line."""


def union(a, b):
    if a is None or b is None:
        return None
    (a_low, a_high), (b_low, b_high) = a, b
    return tuple(map(min, a_low, b_low)), tuple(map(max, a_high, b_high))


def intersection(a, b):
    if a is None or b is None:
        return a or b
    (a_low, a_high), (b_low, b_high) = a, b
    return tuple(map(max, a_low, b_low)), tuple(map(min, a_high, b_high))


def nearest(solids, origin, direction, best, _sqrt):
    """The nearest hit closer than `best` = (t, shape, face), or `best` (CSG-5)."""
    for solid in solids:
        for boundary in solid.boundaries(origin, direction):
            if boundary.t > 0:
                if boundary.t < best[0]:
                    best = boundary.t, boundary, None
                break
    return best
