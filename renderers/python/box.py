"""Boxes of a corner and three edges, at any angle (BOX-1, BOX-2)."""

from .vector import add, dot, largest, normalise, reciprocal, scale, subtract


class Box:
    """A box; `axes` holds (g, g · corner) of the three axes, `faces` the point and outward normal of each side."""

    def __init__(self, corner, edges, material, identity, number):
        self.material, self.identity = material, identity
        self.size = max(largest(edge) for edge in edges)
        self.corner = corner
        self.axes = reciprocal(*edges)
        self.faces = []
        for edge, g in zip(edges, self.axes, strict=True):
            normal = normalise(g, number.sqrt)
            self.faces.append(((corner, scale(normal, -1)), (add(corner, edge), normal)))

    def surface(self, origin, direction, t, face):
        """Point and outward normal of the hit at distance t on face (axis, side) (BOX-2)."""
        on_face, normal = self.faces[face[0]][face[1]]
        p = add(origin, scale(direction, t))
        return subtract(p, scale(normal, dot(subtract(p, on_face), normal))), normal


def nearest(boxes, origin, direction, best, _sqrt):
    """The nearest hit closer than `best` = (t, shape, face), or `best`."""
    for box in boxes:
        hit = slabs(box, origin, direction)
        if hit is not None and 0 < hit[0] < best[0]:
            best = hit[0], box, hit[1]
    return best


def slabs(box, origin, direction):
    """(t, (axis, side)) of the box's first hit with t > 0, or None (BOX-1). Side 0 is low, 1 is high."""
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
    if enter > 0:
        return enter, enter_face
    return (leave, leave_face) if leave > 0 else None
