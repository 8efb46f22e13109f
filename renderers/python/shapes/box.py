"""Boxes of a corner and three edges, at any angle (BOX-1 to BOX-3)."""

import math
from functools import partial

from ..vector import add, corners, dot, largest, normalise, reciprocal, scale, subtract
from .shapes import Shape


class Box(Shape):
    """A box; `axes` holds the reciprocal vectors, `faces` the point and outward normal of each side."""

    def __init__(self, corner, edges, material, identity, number):
        super().__init__(material, identity)
        self.size = max(largest(edge) for edge in edges)
        self.corner, self.edges = corner, edges
        self.axes = reciprocal(*edges)
        self.condition = self.size * max(largest(g) for g in self.axes)
        self.faces = []
        for edge, g in zip(edges, self.axes, strict=True):
            normal = normalise(g, number.sqrt)
            self.faces.append(((corner, scale(normal, -1)), (add(corner, edge), normal)))

    def bounds(self):
        vertices = [self.corner]
        for edge in self.edges:
            vertices += [add(vertex, edge) for vertex in vertices]
        return corners(vertices)

    def surface(self, origin, direction, t, face):
        """Point and outward normal of the hit at distance t on face (axis, side) (BOX-2)."""
        on_face, normal = self.faces[face[0]][face[1]]
        p = add(origin, scale(direction, t))
        return subtract(p, scale(normal, dot(subtract(p, on_face), normal))), normal

    def crossings(self, origin, direction):
        """The boundaries (t, shape, face) on the whole line, in rising order (CSG-1)."""
        span = slabs(self, origin, direction)
        if span is None:
            return ()
        enter, enter_face, leave, leave_face = span
        return (enter, self, enter_face), (leave, self, leave_face)


def slabs(box, origin, direction):
    """Returns t and face (axis, side) where the line enters and leaves the box, or None (BOX-1).

    Side 0 is low, 1 is high.
    """
    f = subtract(origin, box.corner)
    enter, leave = None, None
    enter_face = leave_face = None
    for axis, g in enumerate(box.axes):
        s, w = dot(g, f), dot(g, direction)
        if w == 0:
            if not 0 <= s <= 1:
                return None
            continue
        low, high = (0 - s) / w, (1 - s) / w
        near, far, near_side = (low, high, 0) if w > 0 else (high, low, 1)
        if enter is None or near > enter:
            enter, enter_face = near, (axis, near_side)
        if leave is None or far < leave:
            leave, leave_face = far, (axis, 1 - near_side)
    if enter is None or not enter <= leave:
        return None
    return enter, enter_face, leave, leave_face


def plain(box, origin, direction):
    """As `slabs`, without a test whether the line is parallel to a slab (BOX-3)."""
    f = subtract(origin, box.corner)
    enter, leave = -math.inf, math.inf
    enter_face = leave_face = None
    for axis, g in enumerate(box.axes):
        s, w = dot(g, f), dot(g, direction)
        inverse = 1 / w if w else math.copysign(math.inf, w)
        x, y = (0 - s) * inverse, (1 - s) * inverse
        near, far = y if y < x else x, y if x < y else x
        if enter < near:
            enter, enter_face = near, (axis, 0 if w > 0 else 1)
        if far < leave:
            leave, leave_face = far, (axis, 1 if w > 0 else 0)
    if not enter <= leave:
        return None
    return enter, enter_face, leave, leave_face


def nearest(boxes, origin, direction, best, _sqrt, slabs=slabs):
    """The nearest hit closer than `best` = (t, shape, face), or `best`."""
    for box in boxes:
        span = slabs(box, origin, direction)
        if span is not None:
            enter, enter_face, leave, leave_face = span
            t, face = (enter, enter_face) if enter > 0 else (leave, leave_face)
            if 0 < t < best[0]:
                best = t, box, face
    return best


SEARCHES = {"branch": nearest, "plain": partial(nearest, slabs=plain)}
