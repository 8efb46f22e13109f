"""S11: triangles that are all but lines, and triangles that are lines."""

from fractions import Fraction

import numpy as np
import pytest

from harness.scene.flatten import flatten
from harness.scene.mesh import mesh
from harness.scene.model import Mesh
from harness.stress import exact
from harness.stress.geometry.slivers import ROWS
from harness.stress.row import ROUNDOFF

SEED = 20201107
PRECISIONS = ("float32", "float64")
(ROW,) = ROWS
SEGMENT = np.array([[0.125, 0.25, 0.375], [1.125, 0.75, -0.375]])  # with an exact middle


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("method", ["watertight", "moller-trumbore"])
def test_misses_grow_as_the_height_falls(strain, serial, method, precision):
    """No method helps: rounding moves a ray by u, whatever tests it. Some 2 u / height of the rays are lost."""
    u = ROUNDOFF[precision]
    plain = strain(serial, "slivers", 1e5 * u, precision, SEED, triangle=method)
    thin = strain(serial, "slivers", 10 * u, precision, SEED, triangle=method)
    assert plain.failures < 1e-3 * plain.count
    assert 0.01 * thin.count < thin.failures < thin.count


@pytest.mark.parametrize("precision", PRECISIONS)
def test_triangles_as_thin_as_rounding_are_a_matter_of_chance(strain, serial, precision):
    finding = strain(serial, "slivers", 0.1 * ROUNDOFF[precision], precision, SEED)
    assert 0.3 * finding.count < finding.failures < finding.count


@pytest.mark.parametrize("precision", PRECISIONS)
def test_all_rays_go_through_their_triangles(precision):
    """In other words than those of exact.outline: the crossing has barycentric coordinates from 0 to 1."""
    print("seed", SEED)
    trial = ROW.make(1e-6, precision, np.random.default_rng(SEED))
    (slivers,) = trial.scene.objects
    corners = [
        [[Fraction(x) for x in v] for v in triangle] for triangle in slivers.vertices[slivers.triangles].tolist()
    ]
    for ray in trial.rays[:40].tolist():
        o, d = [Fraction(x) for x in ray[:3]], [Fraction(x) for x in ray[3:]]
        assert any(crossed(o, d, *triangle) for triangle in corners)


def crossed(o, d, a, b, c):
    """o + t d = a + u (b - a) + v (c - a) with t > 0 and u, v, 1 - u - v >= 0, by Cramer's rule."""
    e1, e2, f = ([y - x for x, y in zip(*pair, strict=True)] for pair in ((a, b), (a, c), (a, o)))
    back = [-x for x in d]
    whole = det(e1, e2, back)
    if not whole:
        return False
    u, v, t = det(f, e2, back) / whole, det(e1, f, back) / whole, det(e1, e2, f) / whole
    return t > 0 and u >= 0 and v >= 0 and u + v <= 1


def det(a, b, c):
    return sum(a[i] * (b[i - 2] * c[i - 1] - b[i - 1] * c[i - 2]) for i in range(3))


def test_triangles_that_are_lines_are_gone_before_a_renderer_sees_them(tmp_path):
    """Among proper ones; a vertex twice, three in line, and one whose area is lost to rounding."""
    a, b = SEGMENT
    corners = np.array([[a, b, [0, 0, 1]], [a, a, b], [a, (a + b) / 2, b], [a, b, a + 1e-170]])
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in corners.reshape(-1, 3).tolist()]
    lines += [f"f {i} {i + 1} {i + 2}" for i in (1, 4, 7, 10)]
    (tmp_path / "lines.obj").write_text("\n".join(lines))
    vertices, triangles, closed = mesh.Files(tmp_path).placed("lines.obj", (0, 0, 0), (0, 0, 0), 1)
    assert len(triangles) == 1 and not closed
    arrays = flatten(exact.scene(Mesh(exact.MATERIAL, vertices, triangles, closed)))
    assert len(arrays["mesh_triangles"]) == 1


def test_reject_style_takes_a_nan_for_a_hit():
    """u < 0 or u > 1 is false of a NaN, and so is u >= 0. No renderer is written the first way."""
    a, b = SEGMENT
    o, d = np.array([0.2, 0.1, 2.0]), np.array([0.0, 0.0, -1.0])
    e1, e2 = b - a, np.zeros(3)
    p = np.cross(d, e2)
    with np.errstate(invalid="ignore", divide="ignore"):
        u = (o - a) @ p / (e1 @ p)
        v = d @ np.cross(o - a, e1) / (e1 @ p)
    assert np.isnan(u)
    assert not (u < 0 or u > 1 or (v < 0 and u + v > 1))
    assert not (u >= 0 and v >= 0 and u + v <= 1)
