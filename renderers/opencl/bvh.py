"""Builds a bounding-volume hierarchy level by level with NumPy (HIT-6); kernel/shapes/bvh.h walks it."""

import numpy as np

BINS = 16  # of a node's extent, between which it may be split
LEAF = 4  # a node of no more shapes is a leaf
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
