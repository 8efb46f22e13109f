"""A bounding-volume hierarchy over all bounded shapes (HIT-6): built level by level with NumPy, walked with a stack."""

import numpy as np

from ..target import kernel

BINS = 16  # of a node's extent, between which it may be split
LEAF = 4  # a node of no more shapes is a leaf
LEVELS = 64  # of the walk's stack
HALVED = 36  # from this level on nodes are cut in half, so that 2²⁸ shapes cannot use up the stack


def build(low, high):
    """Bounds (n, 3) and (n, 3) of the shapes to a tree of flat arrays.

    Returns bounds (N, 2, 3), links int32 (N, 2) and items int32 (n,). Links are the first child, which the second
    follows, and 0; or for a leaf the first of its items and their number.
    """
    order = np.arange(len(low))
    centre = (low + high) / 2
    bounds, links = [], []
    first, count = np.array([0]), np.array([len(low)])
    made, level = 1, 0
    while len(first):
        items = order[_rows(first, count)]
        edges = np.cumsum(count) - count
        bounds.append(
            np.stack([np.minimum.reduceat(low[items], edges), np.maximum.reduceat(high[items], edges)], axis=1)
        )
        split = count > LEAF
        link = np.stack([first, count], axis=1)
        link[split, 0], link[split, 1] = made + 2 * np.arange(np.count_nonzero(split)), 0
        links.append(link)
        made += 2 * np.count_nonzero(split)
        first, count = first[split], count[split]
        if len(first):
            places = _rows(first, count)
            items, node = order[places], np.repeat(np.arange(len(first)), count)
            right = _sides(low[items], high[items], centre[items], node, count, level >= HALVED)
            order[places] = items[np.lexsort((right, node))]
            rights = np.bincount(node, right, len(first)).astype(np.int64)
            first = np.stack([first, first + count - rights], axis=1).ravel()
            count = np.stack([count - rights, rights], axis=1).ravel()
        level += 1
    return np.concatenate(bounds), np.concatenate(links).astype(np.int32), order.astype(np.int32)


def _rows(first, count):
    """The rows first, first + 1, .. of each range, one range after the other."""
    return np.repeat(first - np.cumsum(count) + count, count) + np.arange(count.sum())


def _sides(low, high, centre, node, count, halve):
    """1 for the shapes of the right child of their node, by the surface area heuristic."""
    nodes, edges = len(count), np.cumsum(count) - count
    start, end = np.minimum.reduceat(centre, edges), np.maximum.reduceat(centre, edges)
    width = np.where(end > start, end - start, 1)
    bins = np.minimum((centre - start[node]) / width[node] * BINS, BINS - 1).astype(np.int64)
    cost, cut = np.full(nodes, np.inf), np.zeros((nodes, 2), np.int64)
    for axis in range(3):
        key = node * BINS + bins[:, axis]
        ranked = np.argsort(key, kind="stable")
        filled, begin, number = np.unique(key[ranked], return_index=True, return_counts=True)
        lows, highs = np.full((nodes * BINS, 3), np.inf), np.full((nodes * BINS, 3), -np.inf)
        lows[filled] = np.minimum.reduceat(low[ranked], begin)
        highs[filled] = np.maximum.reduceat(high[ranked], begin)
        numbers = np.zeros(nodes * BINS)
        numbers[filled] = number
        shape = nodes, BINS, 3
        left = _costs(lows.reshape(shape), highs.reshape(shape), numbers.reshape(nodes, BINS))
        back = slice(None, None, -1)
        right = _costs(
            lows.reshape(shape)[:, back], highs.reshape(shape)[:, back], numbers.reshape(nodes, BINS)[:, back]
        )
        total = left[:, :-1] + right[:, back][:, 1:]
        best = np.argmin(total, axis=1)
        found = total[np.arange(nodes), best]
        cut[found < cost] = np.stack([np.full(nodes, axis), best], axis=1)[found < cost]
        cost = np.minimum(cost, found)
    side = bins[np.arange(len(node)), cut[node, 0]] > cut[node, 1]
    half = np.arange(len(node)) - edges[node] >= count[node] // 2
    return np.where(np.isinf(cost[node]) | halve, half, side)


def _costs(lows, highs, numbers):
    """Area times number of shapes of the first 1, 2, .. bins of each node; inf where they are empty."""
    size = np.maximum.accumulate(highs, axis=1) - np.minimum.accumulate(lows, axis=1)
    size = np.maximum(size, 0)
    area = size[..., 0] * size[..., 1] + size[..., 1] * size[..., 2] + size[..., 2] * size[..., 0]
    total = np.cumsum(numbers, axis=1)
    return np.where(total > 0, area * total, np.inf)


@kernel
def ends(origin, inverse, pad):
    """Along one axis, the origin to measure from to the side that is met first, and to the other."""
    if inverse > 0:
        return origin + pad, origin - pad
    return origin - pad, origin + pad


@kernel
def slopes(origin, direction, pad):
    """For a ray: 1/d, which side of a box it meets first, and the origin to measure from to that side and to the other.

    1/d tells one side from the other where d is 0 or -0 too: both are then infinitely far, one behind and one ahead.
    The shapes' own tests may find a hit a little beside their bounds, as they are rounded too. So bounds are widened by
    what rounding can do, `pad`: the two origins differ by twice that.
    """
    one = type(pad)(1)
    x, y, z = one / direction[0], one / direction[1], one / direction[2]
    near_x, far_x = ends(origin[0], x, pad)
    near_y, far_y = ends(origin[1], y, pad)
    near_z, far_z = ends(origin[2], z, pad)
    sides = 0 if x > 0 else 1, 0 if y > 0 else 1, 0 if z > 0 else 1
    return (x, y, z), sides, (near_x, near_y, near_z), (far_x, far_y, far_z)


@kernel
def slab(bounds, node, axis, inverse, side, near, far, start, end):
    """The part from `start` to `end` of a ray that is between two sides of a node. A NaN bounds nothing."""
    t0 = (bounds[node, side, axis] - near) * inverse
    t1 = (bounds[node, 1 - side, axis] - far) * inverse
    return t0 if t0 > start else start, t1 if t1 < end else end


@kernel
def clip(bounds, node, ray, start, end):
    """The part from `start` to `end` of a ray that is in a node; none if start > end then. ray: of `slopes`."""
    inverse, side, near, far = ray
    start, end = slab(bounds, node, 0, inverse[0], side[0], near[0], far[0], start, end)
    start, end = slab(bounds, node, 1, inverse[1], side[1], near[1], far[1], start, end)
    return slab(bounds, node, 2, inverse[2], side[2], near[2], far[2], start, end)


@kernel
def enter(bounds, node, ray, best):
    """Distance at which the ray enters a node; -1 if nothing in it can be hit as near as `best`."""
    start, end = clip(bounds, node, ray, type(best)(0), best)
    if start <= end:
        return start
    return type(best)(-1)
