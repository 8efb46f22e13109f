"""Faces of a mesh as triangles: they cover the face, in its turn, and only it."""

import numpy as np
import outlines
import pytest

from harness.scene.mesh.faces import Faces, Fault, triangles


def cut(points):
    points = np.asarray(points, float)
    ring = np.arange(len(points))
    return triangles(points, Faces(ring, np.array([len(points)]), np.array([7])))


def areas(points, cut, normal):
    a, b, c = (np.asarray(points, float)[corner] for corner in cut.T)
    return np.cross(b - a, c - a) @ normal / 2


def turned(rng, outline):
    """The outline in a plane in general position; its normal."""
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    frame[:, 2] *= np.linalg.det(frame)
    return 10.0 ** rng.uniform(-3, 3) * (outline @ frame[:2] + rng.normal(size=3)), frame[2] * np.linalg.det(frame)


@pytest.mark.parametrize("kind", outlines.KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_concave_faces(kind, seed):
    rng = np.random.default_rng(seed)
    print("seed", seed)
    outline = outlines.KINDS[kind](rng, int(rng.integers(12, 60)))[:, :2]
    for ring in (outline, outline[::-1]):
        points, _ = turned(rng, ring)
        arms = points - points[0]
        whole = np.cross(arms[:-1], arms[1:]).sum(axis=0)
        parts = areas(points, cut(points), whole / np.linalg.norm(whole))
        assert (parts > 0).all() and len(parts) == len(points) - 2
        assert parts.sum() == pytest.approx(np.linalg.norm(whole) / 2, rel=1e-9)


@pytest.mark.parametrize("seed", range(40))
def test_quadrilaterals(seed):
    """Any corner may be the one that turns inward; one corner may be off the plane of the others."""
    rng = np.random.default_rng(seed)
    print("seed", seed)
    dart = np.roll([[-1.0, -1], [0, -0.5], [1, -1], [0, 1]], seed, axis=0)
    points, normal = turned(rng, dart[:: rng.choice([1, -1])])
    parts = areas(points, cut(points), normal)
    assert len(parts) == 2 and (np.sign(parts) == np.sign(parts[0])).all()
    scale = np.linalg.norm(points[0] - points[2])
    bent = points + 0.05 * scale * np.array([1, 0, 0, 0])[:, None] * normal
    parts = areas(bent, cut(bent), normal)
    assert len(parts) == 2 and (np.sign(parts) == np.sign(parts[0])).all()


def test_a_convex_face_is_a_fan_round_its_first_corner():
    angles = np.linspace(0, 2 * np.pi, 8)[:-1]
    points = np.stack([np.cos(angles), np.sin(angles), 0.01 * np.cos(5 * angles)], axis=1)
    assert cut(points).tolist() == [[0, i, i + 1] for i in range(1, 6)]


def test_triangles_keep_the_order_of_the_faces():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1.0]])
    corners = [[0, 1, 2, 3], [0, 1, 4], [0, 0, 1, 4], [1, 2, 3], [0, 1, 2, 2, 3]]
    counts = np.array(list(map(len, corners)))
    found = triangles(points, Faces(np.concatenate(corners), counts, np.arange(5)))
    assert found.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 4], [0, 1, 4], [1, 2, 3], [0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    "points",
    [
        [(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)],
        [(0, 0, 0), (2, 2, 0), (2, 0, 0), (0, 1, 0)],
        [(np.cos(0.8 * np.pi * i), np.sin(0.8 * np.pi * i), 0) for i in range(5)],
        [(0, 0, 0), (3, 0, 0), (3, 3, 0), (1, -1, 0), (0, 3, 0)],
        [(0, 0, 0), (3, 0, 0), (3, 3, 0), (0, 3, 0), (0, 0, 1), (1, 1, 0), (1, 2, 0), (1, 1, 0)],
    ],
    ids=["a bow tie", "an uneven one", "a pentagram", "a side through another", "a corner twice"],
)
def test_faces_that_cross_or_touch_themselves(points):
    with pytest.raises(Fault, match=r"a face (crosses|touches) itself") as caught:
        cut(points)
    assert caught.value.place == "line 7"
