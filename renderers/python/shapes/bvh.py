"""A hierarchy of bounding boxes over shapes of any kind (HIT-6).

Built by the surface-area heuristic over bins (Wald, On fast construction of SAH-based bounding volume hierarchies,
2007).
"""

import math
import sys
from itertools import groupby

from ..vector import largest
from . import sphere

BINS = 16
PADDING = 64  # in units of u: how far off a shape, relative to all coordinates, its own test may see it hit

# In units of the test of a sphere, which takes an eighth of the time of any other (NOTES.md).
LEAF = 8  # largest number of shapes in a leaf
WORTH = 64  # a tree pays from this number on


def weight(searches):
    return sum(1 if search in sphere.SEARCHES.values() else 8 for search in searches)


def pays(accel, searches):
    """Returns whether the method `accel` uses a tree over shapes that are searched by `searches`."""
    return weight(searches) >= WORTH if accel == "auto" else accel == "bvh"


class Tree:
    """`items` are pairs (search, shape) in the order of HIT-2.

    A node is (box, children, groups) with box = (x, y, z, X, Y, Z). An inner one has two children; a leaf has, instead
    of them, the search and the rows of each kind of shape in it. Shapes without bounds are a leaf without a box.
    """

    def __init__(self, items, number):
        self.sqrt = number.sqrt
        bounded, loose = [], []
        for order, (search, shape) in enumerate(items):
            shape.order = order
            bounds = shape.bounds()
            if bounds is None:
                loose.append((search, shape))
            else:
                bounded.append(Entry(search, shape, (*bounds[0], *bounds[1])))
        self.roots = [(0, grow(bounded))] if bounded else []
        extent = max(map(abs, self.roots[0][1][0])) if bounded else 0
        worst = max((entry.shape.condition for entry in bounded), default=1)
        self.padding = PADDING * number.roundoff * max(1, worst)
        self.offset = self.padding * extent
        if loose:
            self.roots.append((0, leaf(None, loose)))

    def axes(self, origin, direction):
        """Values for the test of a box, for each axis: which number of the box is the near plane and which the far one,
        where the origin is, moved away from either by what rounding can do, and the inverse direction.
        """
        pad = self.offset + self.padding * largest(origin)
        found = []
        for axis, (o, d) in enumerate(zip(origin, direction, strict=True)):
            inverse = 1 / d if d else math.inf
            if inverse > 0:
                found.append((axis, axis + 3, o + pad, o - pad, inverse))
            else:
                found.append((axis + 3, axis, o - pad, o + pad, inverse))
        return found

    def nearest(self, origin, direction, nothing):
        """Returns the first hit (t, shape, face) nearer than `nothing` = (limit, None, None), or `nothing`."""
        axes = self.axes(origin, direction)
        (nx, fx, near_x, far_x, ix), (ny, fy, near_y, far_y, iy), (nz, fz, near_z, far_z, iz) = axes
        sqrt = self.sqrt
        best = nothing
        reach = min(best[0], sys.float_info.max)  # a ray beside a slab and along it enters it at infinity
        waiting = self.roots.copy()
        while waiting:
            near, (_, children, groups) = waiting.pop()
            if near > reach:
                continue
            if children is None:
                found = nothing  # not `best`: at the same t the first wins, and its leaf may come second
                for search, rows in groups:
                    found = search(rows, origin, direction, found, sqrt)
                if found is not nothing and (
                    found[0] < best[0] or (found[0] == best[0] and found[1].order < best[1].order)
                ):
                    best = found
                    reach = best[0]
                continue
            for child in children:
                box = child[0]
                near, far = 0, reach
                t = (box[nx] - near_x) * ix  # NaN, from 0 times infinity, sets no bound
                if t > near:
                    near = t
                t = (box[fx] - far_x) * ix
                if t < far:
                    far = t
                t = (box[ny] - near_y) * iy
                if t > near:
                    near = t
                t = (box[fy] - far_y) * iy
                if t < far:
                    far = t
                t = (box[nz] - near_z) * iz
                if t > near:
                    near = t
                t = (box[fz] - far_z) * iz
                if t < far:
                    far = t
                if near <= far:
                    waiting.append((near, child))
            if len(waiting) > 1 and waiting[-1][0] > waiting[-2][0]:
                waiting[-1], waiting[-2] = waiting[-2], waiting[-1]
        return best

    def along(self, origin, direction):
        """All rows that the line may meet, before the origin or behind it, in the order of HIT-2."""
        axes = self.axes(origin, direction)
        found = []
        waiting = [node for _, node in self.roots]
        while waiting:
            box, children, groups = waiting.pop()
            first, last = -sys.float_info.max, sys.float_info.max
            for near, far, near_o, far_o, inverse in axes:
                enter, leave = (box[near] - near_o) * inverse, (box[far] - far_o) * inverse
                first = enter if enter > first else first
                last = leave if leave < last else last
            if not first <= last:
                continue
            if children is None:
                found += [row for _, rows in groups for row in rows]
            else:
                waiting += children
        found.sort(key=lambda row: row[-1].order)
        return found

    def around(self, point, reach):
        """Pairs (search, row) of all shapes whose boxes come within `reach` of a point."""
        reach += self.offset + self.padding * largest(point)
        low, high = [x - reach for x in point], [x + reach for x in point]
        waiting = [node for _, node in self.roots]
        while waiting:
            box, children, groups = waiting.pop()
            if box is not None and any(box[a] > high[a] or box[a + 3] < low[a] for a in range(3)):
                continue
            if children is None:
                yield from ((search, row) for search, rows in groups for row in rows)
            else:
                waiting += children


class Entry:
    """A shape on its way into the tree: its box, and as machine floats too, to sort it by."""

    def __init__(self, search, shape, box):
        self.search, self.shape, self.box = search, shape, box
        self.rough = tuple(map(float, box))
        x, y, z, far_x, far_y, far_z = self.rough
        self.centre = (x + far_x) / 2, (y + far_y) / 2, (z + far_z) / 2


def leaf(box, items):
    """A node of pairs (search, shape) in the order of HIT-2."""
    groups = [(search, [shape.row for _, shape in group]) for search, group in groupby(items, lambda item: item[0])]
    return box, None, groups


def grow(entries):
    """The node of `entries`, which are in the order of HIT-2."""
    if len(entries) == 1 or weight(entry.search for entry in entries) <= LEAF:
        box = entries[0].box
        for entry in entries[1:]:
            box = around(box, entry.box)
        return leaf(box, [(entry.search, entry.shape) for entry in entries])
    left, right = map(grow, split(entries))
    return around(left[0], right[0]), (left, right), None


def split(entries):
    """Splits `entries` in two, at the cheapest border of bins along the widest axis (area times number)."""
    columns = list(zip(*(entry.centre for entry in entries), strict=True))
    widths = [max(column) - min(column) for column in columns]
    axis = widths.index(max(widths))
    low, width = min(columns[axis]), widths[axis]
    halves = entries[: len(entries) // 2], entries[len(entries) // 2 :]
    if not 0 < width < math.inf:
        return halves
    places = [min(int(BINS * ((x - low) / width)), BINS - 1) for x in columns[axis]]
    counts, boxes = [0] * BINS, [None] * BINS
    for place, entry in zip(places, entries, strict=True):
        counts[place] += 1
        boxes[place] = entry.rough if boxes[place] is None else around(boxes[place], entry.rough)
    before, after = costs(counts, boxes), costs(counts[::-1], boxes[::-1])[::-1]
    border = min(range(1, BINS), key=lambda i: before[i] + after[i])
    parts = [], []
    for place, entry in zip(places, entries, strict=True):
        parts[place >= border].append(entry)
    return parts


def costs(counts, boxes):
    """For i = 0 .. BINS, the area of the first i bins times the number of shapes in them."""
    box, number, found = None, 0, [0]
    for count, more in zip(counts, boxes, strict=True):
        if more is not None:
            box = more if box is None else around(box, more)
        number += count
        found.append(number * area(box) if box else 0)
    return found


def around(a, b):
    """The box of two boxes."""
    ax, ay, az, a_far_x, a_far_y, a_far_z = a
    bx, by, bz, b_far_x, b_far_y, b_far_z = b
    return (
        ax if ax < bx else bx,
        ay if ay < by else by,
        az if az < bz else bz,
        a_far_x if a_far_x > b_far_x else b_far_x,
        a_far_y if a_far_y > b_far_y else b_far_y,
        a_far_z if a_far_z > b_far_z else b_far_z,
    )


def area(box):
    """Half the surface."""
    x, y, z = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    return x * y + y * z + z * x
