"""Naive and robust methods in python, and in numpy where it has them: what each loses, and what none may change."""

import math

import mpmath as mp
import numpy as np
import pytest
from random_scenes import MATERIAL, random_material, random_scene, random_stage

from renderers.python.number import number
from renderers.python.shapes import sphere
from renderers.python.vector import normalise

SEED = 7
STAGE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\nAMBIENT (0.1,0.2,0.3)\nLIGHT (3,4,5) (1,1,1) 0\n"
MIRROR = "(0.2,0.3,0.4) 0.7 30 (0,0,0) 400 1"
GLASS = "(0.05,0.02,0.03) 0.9 40 (1,1,1) 2.25 1"
SIZE = {"width": 12, "height": 12, "depth": 3, "shadows": True}
# Methods whose pictures are those of the default but for rounding, in general position.
SAME = {
    "sphere": ("textbook", "stable", "wide"),
    "triangle": ("moller-trumbore",),
    "slab": ("plain",),
    "csg": ("stepping",),
    "merge": ("none",),
    "offset": ("relative",),
    "renormalise": ("off",),
}
SAME = [{method: value} for method, values in SAME.items() for value in values]
OTHER = [{"offset": "fixed"}, {"offset": "none"}, {"fresnel": "unclamped"}, {"phong": "unclamped"}]


def mixed(folder):
    """Every kind of shape in general position, glass and mirrors."""
    (folder / "tent.obj").write_text("v 0 0 0\nv 1 0.1 0\nv 0.2 1 0.1\nv 0.3 0.2 0.9\nf 1 2 3\nf 1 2 4\n")
    rng = np.random.default_rng(SEED)
    source = random_scene(rng, 3, 2, 1, 2, material=random_material, rest=random_stage(rng))
    source += f'MESH "{folder / "tent.obj"}" (0.2,-0.6,0.4) (10,20,30) 1.2 {MIRROR}\nSPHERE (0.3,0.2,0.1) 0.9 {GLASS}\n'
    return (
        source
        + f"AND SPHERE (-1,0.5,0.3) 0.7 NOT ELLIPSOID (-0.8,0.7,0.6) (0.5,0,0) (0,0.4,0) (0,0,0.3) END END {GLASS}\n"
    )


@pytest.mark.parametrize("precision", ["float64", "mp20"])
def test_what_rays_from_one_eye_share_changes_no_bit(precision):
    """Aimed at rims, past them and into spheres that the eye is in, from 1e-6 to 1e8 radii away."""
    with mp.workdps(20):  # of which number() changes the digits for all
        kind, rng = number(precision), np.random.default_rng(SEED)
        many, hits = 300 if precision == "float64" else 20, 0
        for _ in range(many):
            size = 10.0 ** rng.uniform(-6, 8)
            origin = tuple(map(kind.real, rng.normal(size=3) * rng.choice([0, 1, size])))
            centres = rng.normal(size=(12, 3)) * size
            radii = 10.0 ** rng.uniform(-8, 0.5, 12) * size
            rows = [
                (*map(kind.real, c), kind.real(r) ** 2, n) for n, (c, r) in enumerate(zip(centres, radii, strict=True))
            ]
            seen = sphere.seen_from(origin, rows, kind.roundoff)
            for row in rows:
                towards = [c - o for c, o in zip(row[:3], origin, strict=True)]
                across = np.cross(rng.normal(size=3), np.array(towards, dtype=float))
                rim = (
                    float(row[3]) ** 0.5
                    * (1 + rng.choice([0, 1e-16, 1e-12, 1e-3, -1e-16, -1e-12, -0.5]))
                    / np.linalg.norm(across)
                )
                direction = normalise([f + kind.real(a * rim) for f, a in zip(towards, across, strict=True)], kind.sqrt)
                nothing = math.inf, None, None
                found = sphere.nearest(rows, origin, direction, nothing, kind.sqrt)
                assert sphere.nearest_seen(seen, origin, direction, nothing, kind.sqrt) == found
                hits += found is not nothing
        assert hits > many


@pytest.mark.parametrize("choice", SAME, ids=str)
@pytest.mark.parametrize("variant", ["python", "numpy"])
def test_an_ordinary_picture_is_the_same(bench, variant, choice, tmp_path):
    jobs, source = {**SIZE, "depth": 2}, mixed(tmp_path)
    result, usual = bench.result(variant, source, **jobs, **choice), bench.result(variant, source, **jobs)
    assert np.abs(result.array - usual.array).max() <= 1e-9
    assert result.said.rays == usual.said.rays
    assert result.said.used["methods"].items() >= choice.items()


def test_every_method_with_60_digits(bench, tmp_path):
    """What is the same but for rounding is the same to the last of float64; the others are what float64 gives."""
    source, jobs = mixed(tmp_path), {"width": 6, "height": 6, "depth": 2, "shadows": True}
    usual = bench.picture("python", source, precision="mp60", **jobs)
    for choice in SAME:
        np.testing.assert_array_equal(bench.picture("python", source, precision="mp60", **choice, **jobs), usual)
    for choice in OTHER:
        if choice != {"offset": "none"}:  # a lottery
            in_float64 = bench.picture("python", source, **choice, **jobs)
            exact = bench.picture("python", source, precision="mp60", **choice, **jobs)
            np.testing.assert_allclose(in_float64, exact, rtol=0, atol=1e-9)


@pytest.mark.parametrize("variant, precision", [("python", "float64"), ("numpy", "float64"), ("numpy", "float32")])
def test_wide_sees_the_rim_of_a_far_sphere(bench, variant, precision):
    """Rays aimed at the rim, as near as their origins are coarse: SPH-1 rounds what decides, `wide` does not.

    In float32 SPH-1 asks again.
    """
    u, distance = {"float64": (2.0**-53, 1e8), "float32": (2.0**-24, 1e3)}[precision]
    rng = np.random.default_rng(SEED)
    ways = rng.normal(size=(200, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    ways = ways.astype(precision).astype(float)
    side = np.cross(ways, rng.normal(size=(200, 3)))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    centre = np.array([0.3, -0.7, 0.2]).astype(precision).astype(float)
    rays = np.hstack([(centre + side - distance * ways).astype(precision), ways])
    with mp.workdps(50):
        f = [[mp.mpf(a) - mp.mpf(b) for a, b in zip(ray, centre, strict=False)] for ray in rays]
        d = [[mp.mpf(x) for x in way] for way in ways]
        squares = [mp.fdot(a, a) - mp.fdot(a, b) ** 2 / mp.fdot(b, b) for a, b in zip(f, d, strict=True)]
        margins = np.array([float(1 - square) for square in squares])
    sure = np.abs(margins) > 100 * (u + (u * distance) ** 2)
    source = STAGE + "SPHERE ({},{},{}) 1 ".format(*map(repr, map(float, centre))) + MATERIAL + "\n"
    wrong = {}
    for method in ("robust", "wide"):
        found = np.isfinite(bench.hits(variant, source, rays, precision=precision, sphere=method)[:, 0])
        wrong[method] = (found != (margins > 0))[sure].mean()
    print(f"{variant}, {precision}: {wrong}, {sure.mean():.2f} of the rays")
    assert sure.mean() > 0.5 and wrong["wide"] == 0
    assert wrong["robust"] == 0 if precision == "float32" else wrong["robust"] > 0.02


def test_wide_from_just_off_a_huge_sphere(bench):
    """k of SPH-1 is u r² off, a length of u r: where a ray leaves the ground says how high it started."""
    source = STAGE + f"SPHERE (0.1,-1e8,0.3) 1e8 {MATERIAL}\n"
    heights = np.array([1.23e-7, 3.37e-7, 1.01e-6])
    rays = [[0.1, h, 0.3, 0, -1, 0] for h in heights]
    off = {
        (variant, method): np.abs(bench.hits(variant, source, rays, sphere=method)[:, 0] - heights).max()
        for variant in ("python", "numpy")
        for method in ("robust", "wide")
    }
    print(off)
    for variant in ("python", "numpy"):
        assert off[variant, "wide"] < 1e-15 < 1e-9 < off[variant, "robust"]


def test_a_plain_slab_loses_rays_in_a_face(bench):
    source = STAGE + f"BOX (0,0,0) (1,0,0) (0,1,0) (0,0,1) {MATERIAL}\n"
    rays = [[x, 0.5, 5, 0, 0, -1] for x in (0, 0.5, 1)]
    assert list(bench.hits("python", source, rays)[:, 0]) == [4, 4, 4]
    assert list(bench.hits("python", source, rays, slab="plain")[:, 0]) == [4, 4, np.inf]  # 0·∞: one side stays
    assert list(bench.hits("python", source, rays, slab="plain", precision="mp60")[:, 0]) == [4, 4, np.inf]


@pytest.mark.parametrize("offset, dark", [("bounded", False), ("relative", False), ("fixed", True), ("none", True)])
@pytest.mark.parametrize("variant", ["python", "numpy"])
def test_a_point_shadows_itself(bench, variant, offset, dark):
    """Without an offset by rounding; with a fixed one where it is shorter than rounding at 1e13 from the origin."""
    where = "1e13" if offset == "fixed" else "3"
    source = f"CAMERA (0,0,{where}) (1,0,0) (0,1,0) (0,0,5)\nLIGHT (2,3,2e13) (1,1,1) 0\n"
    source += f"SPHERE (0,0,{where}) 0.9 {MATERIAL}\n"
    lit, light = (bench.picture(variant, source, **{**SIZE, "shadows": on}, offset=offset) for on in (True, False))
    assert (np.abs(lit - light).max() > 0.01) == dark


def test_what_is_not_clamped(bench):
    glass = STAGE + f"BOX (-0.3,-2,-4) (0.6,0,0) (0,4,0) (0,0,4) {GLASS}\n"
    assert bench.result("python", glass, **SIZE).said.rays["non_finite"] == 0
    assert bench.result("python", glass, fresnel="unclamped", **SIZE).said.rays["non_finite"] > 0
    for precision in ("float64", "mp60"):
        back = STAGE + f"SPHERE (0,0,0) 0.9 {MIRROR.replace(' 30 ', ' 2.5 ')}\n"
        jobs = {**SIZE, "width": 6, "height": 6, "precision": precision}
        assert bench.result("python", back, **jobs).said.rays["non_finite"] == 0
        assert bench.result("python", back, phong="unclamped", **jobs).said.rays["non_finite"] > 0


def test_every_face_kept_leaves_slivers(bench):
    """A and not A: nothing, but for the last bits of two boxes that are one; seen from near, where t is no larger."""
    box = "BOX (0.1,0.2,0.3) (0.7,0.1,0) (-0.1,0.6,0) (0,0.1,0.5)"
    same = "BOX (0.8,0.3,0.3) (-0.7,-0.1,0) (-0.1,0.6,0) (0,0.1,0.5)"
    source = STAGE + f"AND {box} NOT {same} END END {MATERIAL}\n"
    rng = np.random.default_rng(SEED)
    rays = np.hstack([rng.normal(size=(200, 3)) * 0.1, np.zeros((200, 3))])
    rays[:, 3:] = [0.4, 0.6, 0.55] + rng.normal(size=(200, 3)) * 0.1 - rays[:, :3]
    seen = {
        merge: np.isfinite(bench.hits("python", source, rays, merge=merge)[:, 0]).sum()
        for merge in ("tolerant", "none")
    }
    assert seen["tolerant"] == 0 < seen["none"]


@pytest.mark.parametrize("variant", ["python", "numpy"])
def test_a_ray_of_unit_length_keeps_its_bits(bench, variant):
    """t to a plane tells the direction; one that is longer is normalised (NUM-4)."""
    direction = np.array([0.6, 0.48, -0.64])  # 1 to rounding
    source = STAGE + f"POLYGON 3 (-1e9,-1e9,0) (1e9,-1e9,0) (0,1e9,0) {MATERIAL}\n"
    rays = [[0, 0, 1e8, *(direction * scale)] for scale in (1, 1 + 2**-52, 1.5)]
    t = bench.hits(variant, source, rays)[:, 0]
    assert t[0] == 1e8 / -direction[2] and t[1] == 1e8 / (-direction[2] * (1 + 2**-52))
    assert t[2] == pytest.approx(t[0], rel=1e-15)
