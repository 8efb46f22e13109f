"""Boxes: a corner and three edges, at any angle to each other."""

import numpy as np

from ..needs import FAR, SLAB
from ..target import kernel
from ..vector import add, along, dot, negate, row_of, subtract

# What a row of the table holds, three of each but the corner.
CORNER, EDGE, RECIPROCAL, NORMAL = 0, 1, 4, 7


def reciprocal(axes):
    """Reciprocal vectors g of three axes: (n, 3, 3) to (n, 3, 3), in float64 (NUM-1)."""
    a1, a2, a3 = axes[:, 0], axes[:, 1], axes[:, 2]
    crosses = np.stack([np.cross(a2, a3), np.cross(a3, a1), np.cross(a1, a2)], axis=1)
    return crosses / np.sum(a1 * crosses[:, 0], axis=1)[:, None, None]


def box_table(boxes):
    """(B, 12), corner and edges, to the (B, 10, 3) that the kernel reads."""
    parts = boxes.reshape(-1, 4, 3)
    g = reciprocal(parts[:, 1:])
    return np.concatenate([parts, g, g / np.linalg.norm(g, axis=2, keepdims=True)], axis=1)


@kernel
def span_box(boxes, i, origin, direction):
    """Where the line enters and leaves box `i`, and by which faces: t₀, t₁, face₀, face₁ (BOX-1); FAR, -FAR for a miss.

    A face is 2 axis, plus 1 on the high side.
    """
    real = type(direction[0])
    one = real(1)
    infinity = real(FAR)
    t0, t1 = -infinity, infinity
    face0, face1 = 0, 0
    from_corner = subtract(origin, row_of(boxes, i, CORNER))
    for axis in range(3):
        g = row_of(boxes, i, RECIPROCAL + axis)
        s = dot(g, from_corner)
        w = dot(g, direction)
        low, high = 2 * axis, 2 * axis + 1
        if w > 0:
            enter, leave = -s / w, (one - s) / w
        elif w < 0:
            enter, leave = (one - s) / w, -s / w
            low, high = high, low
        elif w == 0 and 0 <= s <= 1:
            continue
        else:
            return infinity, -infinity, 0, 0
        if enter > t0:
            t0, face0 = enter, low
        if leave < t1:
            t1, face1 = leave, high
    return t0, t1, face0, face1


@kernel
def span_plain(boxes, i, origin, direction):
    """The same without a branch, as often written: it may miss a ray in the plane of a face (BOX-3)."""
    real = type(direction[0])
    one, infinity = real(1), real(FAR)
    t0, t1 = -infinity, infinity
    face0, face1 = 0, 0
    from_corner = subtract(origin, row_of(boxes, i, CORNER))
    for axis in range(3):
        g = row_of(boxes, i, RECIPROCAL + axis)
        s = dot(g, from_corner)
        w = dot(g, direction)
        inverse = one / w
        x, y = (real(0) - s) * inverse, (one - s) * inverse
        enter = y if y < x else x
        leave = y if x < y else x
        high = 0 if w > 0 else 1  # whether it is entered on the high side
        if t0 < enter:
            t0, face0 = enter, 2 * axis + high
        if leave < t1:
            t1, face1 = leave, 2 * axis + 1 - high
    return t0, t1, face0, face1


span_of_hit = span_plain if SLAB == "plain" else span_box


@kernel
def hit_box(boxes, i, origin, direction):
    """Distance to box `i`, FAR for a miss, and the face (BOX-1)."""
    t0, t1, face0, face1 = span_of_hit(boxes, i, origin, direction)
    if t0 <= t1:
        if t0 > 0:
            return t0, face0
        return t1, face1
    return type(t0)(FAR), 0


@kernel
def nearest_box(boxes, origin, direction, best, index, first):
    """The nearer of the hit (`best`, `index`) so far and the boxes', numbered from `first` (HIT-2)."""
    for i in range(len(boxes)):
        t, _ = hit_box(boxes, i, origin, direction)
        if t < best and t > 0:
            best, index = t, first + i
    return best, index


@kernel
def any_box(boxes, origin, direction, limit):
    """HIT-5."""
    for i in range(len(boxes)):
        t, _ = hit_box(boxes, i, origin, direction)
        if t < limit and t > 0:
            return True
    return False


@kernel
def face_of_box(boxes, i, face, origin, direction, t):
    """Point and normal of the hit at `t` on a face of box `i` (BOX-2)."""
    axis = face // 2
    normal = row_of(boxes, i, NORMAL + axis)
    on_face = row_of(boxes, i, CORNER)
    if face % 2 == 0:
        normal = negate(normal)
    else:
        on_face = add(on_face, row_of(boxes, i, EDGE + axis))
    p = along(origin, t, direction)
    return along(p, -dot(subtract(p, on_face), normal), normal), normal


@kernel
def box_surface(boxes, i, origin, direction):
    """Point and normal of the hit on box `i`."""
    t, face = hit_box(boxes, i, origin, direction)
    return face_of_box(boxes, i, face, origin, direction, t)
