"""Concave polygons in the renderers: where they are hit, between their triangles too, and how they are shaded."""

import numpy as np
import outlines
import pytest

from harness.scene import nff

VIEW = "v\nfrom {}\nat {}\nup {}\nangle 40\nhither 1\nresolution 9 9\n"
HEAD = VIEW.format("0 0 8", "0 0 0", "0 1 0")
FILL = "f 1 0.5 0.25 0.8 {} 17 {} 1.5\n"


def words(vector):
    return " ".join(map(repr, np.asarray(vector, float).tolist()))


@pytest.mark.parametrize("kind", outlines.KINDS)
@pytest.mark.parametrize("seed", [1, 2])
def test_rays_hit_what_is_inside_and_pass_what_is_not(bench, serial, kind, seed):
    """Against an even-odd count of crossings, in random frames, at scales from 1e-6 to 1e6."""
    rng = np.random.default_rng([seed, list(outlines.KINDS).index(kind)])
    scale, far = 10.0 ** rng.uniform(-6, 6), rng.choice([0, 1, 100])
    print("seed", seed, "scale", scale, "far", far)
    outline = outlines.KINDS[kind](rng, bench.by_speed(serial, 24, 150))
    vertices, place, frame = outlines.placed(rng, outline, scale, far)
    scene = nff.read(HEAD + FILL.format(0.5, 0) + outlines.polygon(vertices))
    (mesh,) = scene.objects

    count = bench.by_speed(serial, 300, 3000)
    aims = rng.uniform(outline.min(axis=0) - 0.1, outline.max(axis=0) + 0.1, (count, 2))
    aims = aims[outlines.clear(outline, aims, 1e-6)]
    expected = outlines.inside(outline, aims)
    assert 0.05 < expected.mean() < 0.95
    # On the edges between triangles, where a crack would be.
    edges = np.concatenate([mesh.triangles[:, :2], mesh.triangles[:, 1:], mesh.triangles[:, ::2]])
    local = ((mesh.vertices - place) @ frame.T / scale**2)[:, :2]
    share = rng.random((len(edges), 1))
    between = share * local[edges[:, 0]] + (1 - share) * local[edges[:, 1]]
    between = between[outlines.clear(outline, between, 1e-6)]
    assert outlines.inside(outline, between).all()

    points = place + np.vstack([aims, between]) @ frame[:2]
    offsets = scale * rng.normal(size=points.shape)
    offsets += np.sign(offsets @ frame[2])[:, None] * frame[2]
    hits = bench.hits(serial, scene, np.hstack([points + offsets, -offsets]))
    hit = np.isfinite(hits[:, 0])
    assert np.array_equal(hit, np.concatenate([expected, np.ones(len(between), bool)]))
    assert np.abs(hits[hit, 1:4] - points[hit]).max() < 1e-11 * scale * (1 + far)
    normals = hits[hit, 4:7]
    assert np.abs(np.abs(normals @ frame[2]) / scale - 1).max() < 1e-9
    assert (np.einsum("ij,ij->i", normals, offsets[hit]) > 0).all()


@pytest.mark.parametrize("k_s, clear", [(0.5, 0), (0.3, 0.7)], ids=["opaque", "glass"])
def test_pictures_as_of_convex_polygons(bench, serial, k_s, clear):
    """A comb is its back and its teeth, as polygons of their own: the same light, shadows and flat glass (MED-4)."""
    rng = np.random.default_rng(4)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    teeth = [(0.13 + 0.31 * i, 0.27 + 0.31 * i) for i in range(3)]
    outline = [(1.0, 0.0), (1.0, 0.3)]
    parts = [[(0, 0), (1, 0), (1, 0.3), (0, 0.3)]]
    for left, right in reversed(teeth):
        outline += [(right, 0.3), (right, 0.9), (left, 0.9), (left, 0.3)]
        parts.append([(left, 0.3), (right, 0.3), (right, 0.9), (left, 0.9)])
    outline += [(0.0, 0.3), (0.0, 0.0)]

    def space(points):
        points = np.array(points, float) - 0.5
        return np.column_stack([points, np.zeros(len(points))]) @ turn

    def scene(*shapes):
        eye, at, up = np.array([(0.2, -0.5, 2.4), (0.02, 0.03, 0), (0.1, 1, 0.2)]) @ turn
        text = VIEW.format(words(eye), words(at), words(up))
        text += "".join(f"l {words(np.array(light) @ turn)} 0.7 0.6 0.5\n" for light in ((1, 2, 3), (-2, 1, -3)))
        text += FILL.format(k_s, clear) + "".join(outlines.polygon(space(shape)) for shape in shapes)
        back = [(-1, -1, -0.7), (2, -1, -0.7), (2, 2, -0.9), (-1, 2, -0.9)]
        return nff.read(text + FILL.format(0.4, 0) + outlines.polygon(np.array(back) @ turn))

    jobs = {"width": 24, "height": 24, "depth": 3, "shadows": True}
    found, expected = (bench.result(serial, scene(*shapes), **jobs) for shapes in ([outline], parts))
    assert np.ptp(expected.array, axis=(0, 1)).min() > 0.1
    np.testing.assert_allclose(found.array, expected.array, rtol=0, atol=1e-9)
    assert found.said.rays == expected.said.rays


def test_gears_in_every_renderer(bench, serial):
    """As Haines' gears: a mirror, glass between concave faces, shadows; the same picture as C++ makes."""
    scene = nff.read(outlines.gears(2, bench.by_speed(serial, 5, 36)))
    jobs = {"width": 16, "height": 16, "depth": 4, "shadows": True}
    found, expected = (bench.result(variant, scene, **jobs) for variant in (serial, "cpp"))
    np.testing.assert_allclose(found.array, expected.array, rtol=0, atol=1e-9)
    assert found.said.rays == expected.said.rays
