"""numba's naive and robust methods: what each does to a picture, on the processor and in the simulator of a GPU, and
what they are there for."""

import mpmath as mp
import numpy as np
import pytest
from nightly import by_night
from random_scenes import MATERIAL, random_rays
from tessellate import ball, obj

pytest.importorskip("numba")
METHODS = {
    "sphere": ("wide", "textbook", "stable"),
    "offset": ("relative", "fixed", "none"),
    "triangle": ("moller-trumbore", "watertight-kahan"),
    "slab": ("plain",),
    "merge": ("none",),
    "fresnel": ("unclamped",),
    "phong": ("unclamped",),
    "renormalise": ("off",),
}
PAIRS = "test_every_pair has these methods by day; Numba compiles 2 kernels or more for each case"
FEW = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\n"


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """scene(*names): text of some of the things that a method is of. The boxes of the solid share a face."""
    path = tmp_path_factory.mktemp("mesh") / "ball.obj"
    path.write_text(obj(*ball(1)))
    things = {
        "glass": "SPHERE (-0.9,0.6,0.3) 0.83 (0.1,0.1,0.1) 0.9 4.5 (0.9,0.8,1) 0.36 1\n",
        "sphere": "SPHERE (0.2,-0.9,0.9) 0.6 (0.1,0.1,0.1) 0.9 4.5 (0,0,0) 16 1\n",
        "ellipsoid": "ELLIPSOID (1.2,0.8,-0.4) (0.9,0.1,0) (-0.1,0.5,0) (0,0,0.7) (0.3,0.4,0.2) 0.6 3 (0,0,0) 30 1\n",
        "box": "BOX (-2.2,-1.7,-1) (1.3,0,0.2) (0,1,0) (0,0.1,1.1) (0.5,0.3,0.2) 0.5 2.5 (0,0,0) 40 1\n",
        "mesh": f'MESH "{path}" (0.2,-0.4,0.4) (10,20,30) 0.6 (0.1,0.2,0.1) 0.8 5 (0,0,0) 20 1\n',
        "csg": "AND BOX (0.9,-1.7,-0.3) (1.2,0,0) (0,1.1,0) (0,0,1.1) "
        "NOT BOX (1.1,-1.9,0.2) (0.6,0,0) (0,1.1,0) (0,0,0.6) END END (0.2,0.5,0.3) 0.4 9 (0,0,0) 20 1\n",
    }

    def of(*names):
        return (
            "CAMERA (0.1,0,0) (2.4,0,0) (0,1.9,0) (0.3,0.4,6)\nAMBIENT (0.2,0.25,0.3)\nBACKGROUND (0.1,0.12,0.2)\n"
            "LIGHT (3,5,6) (0.8,0.7,0.6) 0\nLIGHT (-4,2,3) (0.4,0.5,0.6) 0\n"
        ) + "".join(things[name] for name in names or things)

    return of


OF = {"triangle": "mesh", "slab": "box", "merge": "csg", "fresnel": "glass"}  # else spheres and ellipsoids


def small(bench, variant, scene, **methods):
    return bench.result(variant, scene, exact=True, width=40, height=32, depth=2, shadows=True, **methods)


@pytest.mark.nightly(PAIRS)
@pytest.mark.slow
@pytest.mark.parametrize(("method", "value"), [(method, value) for method in METHODS for value in METHODS[method]])
def test_a_method_is_what_python_makes_of_it(bench, scene, method, value):
    source = scene(OF[method]) if method in OF else scene("sphere", "ellipsoid")
    usual, found = (small(bench, "numba", source, **chosen) for chosen in ({}, {method: value}))
    assert found.said.used["methods"][method] == value != usual.said.used["methods"][method]
    assert not np.array_equal(found.array, usual.array)
    assert (found.said.rays["non_finite"] > 0) == (value == "unclamped")
    expected = small(bench, "python", source, **{method: value})
    np.testing.assert_allclose(found.array, expected.array, rtol=0, atol=1e-10)
    assert found.said.rays == expected.said.rays


@pytest.mark.nightly(PAIRS)
@pytest.mark.parametrize("floating_point", ["contract", "fast"])
def test_all_run_with_floating_point_that_is_not_strict(bench, scene, floating_point):
    for which, precision in ((0, "float32"), (-1, "float64")):
        methods = {method: values[which] for method, values in METHODS.items()}
        small(bench, "numba", scene(), precision=precision, floating_point=floating_point, **methods)


@pytest.mark.slow
@pytest.mark.parametrize("which", by_night([0, 1, 2], "0", "1"))
def test_the_simulator_of_a_gpu_agrees(bench, scene, monkeypatch, which):
    monkeypatch.setenv("RAYRACE_CUDASIM", "1")
    methods = {method: values[min(which, len(values) - 1)] for method, values in METHODS.items()}
    jobs = {"width": 9, "height": 7, "depth": 2, "shadows": True, "exact": True, "block_width": 4, "block_height": 2}
    on_gpu, here = (bench.result(name, scene(), **jobs, **methods) for name in ("numba-cuda", "numba"))
    np.testing.assert_allclose(on_gpu.array, here.array, rtol=0, atol=1e-12)
    assert on_gpu.said.rays == here.said.rays
    used = on_gpu.said.used["methods"]
    assert {method: used[method] for method in methods} == methods


@pytest.mark.slow
@pytest.mark.parametrize(("precision", "unit"), [("float32", 2.0**-24), ("float64", 2.0**-53)])
def test_wide_is_right_close_to_a_huge_sphere(bench, precision, unit):
    """SPH-3: f·f - r² of a point close to it is nothing but the rounding of f·f, unless in twice the digits."""
    radius, rng = 1e6, np.random.default_rng(3)
    origins = np.column_stack([rng.uniform(-9, 9, (40, 2)), rng.uniform(1, 2, 40)])
    directions = np.column_stack([rng.uniform(-0.5, 0.5, (40, 2)), np.full(40, -1)])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    rays = np.hstack([origins, directions]).astype(precision).astype(float)
    source = FEW + f"SPHERE (0,0,{-radius!r}) {radius!r} {MATERIAL}\n"
    mp.mp.dps = 50
    errors = {}
    for method in ("robust", "wide"):
        hits = bench.hits("numba", source, rays, precision=precision, sphere=method)
        errors[method] = max(abs(hit[0] / exact(ray, radius) - 1) for hit, ray in zip(hits, rays, strict=True))
    print({method: float(error / unit) for method, error in errors.items()})
    assert errors["wide"] < 32 * unit and errors["robust"] > 1e4 * unit


def exact(ray, radius):
    """Distance to a sphere whose lowest z is 0, in 50 digits."""
    f, d = mp.matrix([ray[0], ray[1], mp.mpf(ray[2]) + radius]), mp.matrix(ray[3:].tolist())
    d /= mp.sqrt(mp.fdot(d, d))
    b, k = -mp.fdot(f, d), mp.fdot(f, f) - mp.mpf(radius) ** 2
    return k / (b + mp.sqrt(b * b - k))


def test_ellipsoids_follow_the_spheres(bench):
    """ELL-3: from afar the discriminant loses one; wide is the default."""
    source = FEW + f"ELLIPSOID (0,0,0) (0.5,0,0) (0,0.6,0) (0,0,0.7) {MATERIAL}\n"
    rays = np.array([[1e9 * x + 0.2, 1e9, 2e9, -x, -1, -2] for x in np.linspace(-1, 1, 50)])
    found = {method: bench.hits("numba", source, rays, sphere=method) for method in ("robust", *METHODS["sphere"])}
    np.testing.assert_array_equal(found["wide"], found["robust"])
    assert np.isfinite(found["robust"][:, 0]).all()
    for method in ("textbook", "stable"):
        assert not np.isfinite(found[method][:, 0]).all()
        with_tree = bench.hits("numba", source, rays, sphere=method, accel="bvh")
        np.testing.assert_array_equal(with_tree, found[method])


@pytest.mark.slow
@pytest.mark.parametrize("triangle", ["watertight", "watertight-kahan"])
def test_no_ray_passes_between_two_triangles(bench, tmp_path, triangle):
    """TRI-3, in float32: rays that start inside a closed mesh at points of its edges. Fused, only Kahan's keeps it."""
    vertices, faces = ball(2)
    (tmp_path / "ball.obj").write_text(obj(vertices, faces))
    source = FEW + f'MESH "{tmp_path / "ball.obj"}" (0,0,0) (0,0,0) 1 {MATERIAL}\n'
    rng = np.random.default_rng(5)
    edges = vertices[faces[rng.integers(0, len(faces), 4000)][:, :2]]
    share = rng.uniform(0, 1, (4000, 1))
    origins = rng.uniform(-0.3, 0.3, (4000, 3))
    rays = np.hstack([origins, share * edges[:, 0] + (1 - share) * edges[:, 1] - origins])
    jobs = {"precision": "float32", "triangle": triangle}
    lost = {
        mode: np.count_nonzero(~np.isfinite(bench.hits("numba", source, rays, floating_point=mode, **jobs)[:, 0]))
        for mode in ("strict", "contract")
    }
    print(triangle, lost)
    assert lost["strict"] == 0
    assert (lost["contract"] == 0) == (triangle == "watertight-kahan")


def test_a_ray_in_the_plane_of_a_face_is_lost_by_the_plain_slab(bench):
    """BOX-3. The answers come from one folder of compiled code, so its key tells methods apart."""
    source = FEW + f"BOX (0,0,0) (1,0,0) (0,1,0) (0,0,1) {MATERIAL}\n"
    rays = np.vstack([[[1, 0.5, 5, 0, 0, -1], [0, 0.5, 5, 0, 0, -1]], random_rays(np.random.default_rng(4), 200)])
    branch, plain, again = (bench.hits("numba", source, rays, slab=slab) for slab in ("branch", "plain", "branch"))
    np.testing.assert_array_equal(branch, again)
    assert branch[:2, 0].tolist() == [4, 4] and plain[:2, 0].tolist() == [np.inf, 4]
    np.testing.assert_allclose(plain[2:], branch[2:], rtol=1e-13, atol=1e-13)


def test_a_given_ray_of_unit_length_is_not_turned(bench):
    """NUM-4: 1e9 away, where the plane z = 0 is met, the last bit of a direction can be seen."""
    directions = np.random.default_rng(6).normal(size=(200, 3)) - (0, 0, 3)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    turned = directions / np.sqrt((directions**2).sum(axis=1, keepdims=True))
    directions = directions[(turned != directions).any(axis=1) & (directions[:, 2] < 0)]
    assert len(directions) > 20
    origins = np.tile((0.0, 0.0, 1e9), (len(directions), 1))
    source = FEW + f"POLYGON 4 (-9e9,-9e9,0) (9e9,-9e9,0) (9e9,9e9,0) (-9e9,9e9,0) {MATERIAL}\n"
    hits = bench.hits("numba", source, np.hstack([origins, directions]))
    np.testing.assert_array_equal(hits[:, 1:3], hits[:, :1] * directions[:, :2])
