"""S14: beside the edges of a polygon, and level with its vertices."""

from itertools import pairwise

import numpy as np
import pytest

from harness.stress import exact
from harness.stress.geometry.polygons import AWAY, DIAMOND, ROWS
from harness.stress.row import ROUNDOFF

BY_NAME = {row.name: row for row in ROWS}
SEED = 20201107
PRECISIONS = ("float32", "float64")
CORNERS = [tuple(corner[:2]) for corner in DIAMOND.tolist()]


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", BY_NAME)
def test_edges_are_where_they_are(strain, serial, name, precision):
    for level in (10 ** np.random.default_rng([SEED, len(name)]).uniform(-4, -1), 50 * ROUNDOFF[precision]):
        finding = strain(serial, name, float(level), precision, SEED)
        assert finding.failures == 0


@pytest.mark.parametrize("precision", PRECISIONS)
def test_nearer_than_rounding_nobody_knows(strain, serial, precision):
    finding = strain(serial, "polygon-edges", 0.01 * ROUNDOFF[precision], precision, SEED)
    assert 0.05 * finding.count < finding.failures < 0.5 * finding.count


def crossings(x, y, counts):
    """Is the point inside by the number of edges to its right? counts(y0, y1, y): is an edge level with the point?"""
    odd = False
    for (x0, y0), (x1, y1) in pairwise([*CORNERS, CORNERS[0]]):
        if y0 != y1 and counts(y0, y1, y) and x0 + (y - y0) / (y1 - y0) * (x1 - x0) > x:
            odd = not odd
    return odd


def test_counting_a_vertex_twice_puts_the_inside_outside():
    """The naive crossing test, closed at both ends of an edge, and the half-open one. No renderer counts crossings."""

    def closed(y0, y1, y):
        return min(y0, y1) <= y <= max(y0, y1)

    def half_open(y0, y1, y):
        return (y0 > y) != (y1 > y)

    assert not crossings(1, 0, closed)
    assert crossings(1, 0, half_open) and not crossings(-1, 0, half_open)
    assert crossings(1, 0.1, closed)


def test_every_renderer_has_that_point(bench, serial):
    """Level with two vertices and inside, and outside before, behind, above and below."""
    places = np.array([(1, 0), (3, 0), (-1, 0), (5, 0), (1, 1), (3, -1)], float)
    rays = np.hstack([places, np.full((6, 1), AWAY), np.tile([0, 0, -1.0], (6, 1))])
    corners = " ".join(f"({x},{y},0)" for x, y in CORNERS)
    source = f"CAMERA (0,0,0) (1,0,0) (0,1,0) 5\nPOLYGON 4 {corners} (0.5,0.5,0.5) 0 1 (0,0,0) 1 1\n"
    assert (bench.hits(serial, source, rays)[:, 7] >= 0).tolist() == [True, True, False, False, False, False]


def test_truth_has_the_edge_on_the_inside():
    places = np.array([(1, 0), (1, -0.5), (0, 0), (1, np.nextafter(-0.5, -1)), (-1e-300, 0), (6, 1)])
    rays = np.hstack([places, np.full((6, 1), AWAY), np.tile([0, 0, -1.0], (6, 1))])
    assert exact.outline(rays, DIAMOND[None]).tolist() == [True, True, True, False, False, False]
