"""The C++ renderer's naive and robust methods: the same as Python's, and what those that cost more are there for."""

import numpy as np
import pytest
from random_scenes import MATERIAL
from tessellate import ball, obj

EMPTY = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)\n"
ALL = (
    {
        **{"sphere": "textbook", "offset": "relative", "triangle": "moller-trumbore", "slab": "plain"},
        **{"merge": "none", "fresnel": "unclamped", "phong": "unclamped", "renormalise": "off"},
    },
    {"sphere": "stable", "offset": "fixed"},
    {"sphere": "wide"},
)


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    path = tmp_path_factory.mktemp("mesh") / "ball.obj"
    path.write_text(obj(*ball(3)))
    return f'MESH "{path}" (0,0,0) (0,0,0) 1 {MATERIAL}\n'


@pytest.mark.slow
@pytest.mark.parametrize("methods", ALL, ids=[methods["sphere"] for methods in ALL])
def test_pictures_are_those_of_python(bench, tmp_path, methods):
    """Glass and mirrors of all shapes, and a solid of two boxes that share a face."""
    (tmp_path / "ball.obj").write_text(obj(*ball(1)))
    scene = (
        "CAMERA (0.1,0,0) (2.4,0,0) (0,1.9,0) (0.3,0.4,6)\nAMBIENT (0.2,0.25,0.3)\nBACKGROUND (0.1,0.12,0.2)\n"
        "LIGHT (3,5,6) (0.8,0.7,0.6) 0\nSPHERE (-0.9,0.6,0.3) 0.83 (0.1,0.1,0.1) 0.9 4.5 (0.9,0.8,1) 2.25 1\n"
        "ELLIPSOID (1.2,0.8,-0.4) (0.9,0.1,0) (-0.1,0.5,0) (0,0,0.7) (0.3,0.4,0.2) 0.6 3 (0,0,0) 30 1\n"
        "BOX (-2.2,-1.7,-1) (1.3,0,0.2) (0,1,0) (0,0.1,1.1) (0.5,0.3,0.2) 0.5 2.5 (0,0,0) 40 1\n"
        f'MESH "{tmp_path}/ball.obj" (0.2,-0.4,0.4) (10,20,30) 0.6 (0.1,0.2,0.1) 0.8 5 (0.9,0.9,1) 2 1\n'
        "AND BOX (0.9,-1.7,-0.3) (1,0,0) (0,1.1,0) (0,0,1) BOX (0.9,-1.7,0.7) (1,0,0) (0,1.1,0) (0,0,0.3)\n"
        "END (0.2,0.5,0.3) 0.4 9 (0,0,0) 20 1\n"
    )
    job = {"width": 40, "height": 30, "depth": 3, "shadows": True, **methods}
    found, wanted = (bench.result(variant, scene, **job) for variant in ("cpp", "python"))
    assert {key: found.said.used["methods"][key] for key in methods} == methods
    assert found.said.rays == wanted.said.rays
    np.testing.assert_allclose(found.array, wanted.array, rtol=0, atol=1e-11)
    assert found.said.rays["non_finite"] > 0 or "fresnel" not in methods


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_no_ray_is_lost_between_triangles_that_a_compiler_fuses(bench, mesh, precision):
    """TRI-3: from inside a ball, aimed at its edges. Without Kahan's differences hundreds get out."""
    vertices, faces = ball(3)
    rng = np.random.default_rng(1)
    edges = vertices[faces[rng.integers(0, len(faces), 20000)][:, :2]]
    share = rng.random((20000, 1))
    origins = rng.normal(0, 0.1, (20000, 3))
    rays = np.hstack([origins, share * edges[:, 0] + (1 - share) * edges[:, 1] - origins])
    job = {"precision": precision, "floating_point": "contract"}
    lost = [
        np.isinf(bench.hits("cpp", EMPTY + mesh, rays, triangle=triangle, **job)[:, 0]).sum()
        for triangle in ("watertight-kahan", "watertight")
    ]
    print("lost", lost)
    assert lost[0] == 0 < lost[1]


@pytest.mark.slow
@pytest.mark.parametrize(("precision", "u"), [("float32", 2.0**-24), ("float64", 2.0**-53)])
def test_wide_is_right_beside_a_huge_sphere_and_far_from_a_small_one(bench, precision, u):
    """SPH-3. Many rays miss, as SPH-1 is asked first and may not take a hit for a miss; Python asks nothing first."""
    rng = np.random.default_rng(2)
    small = tuple(float(np.float32(x)) for x in (0.37, -1.21, 0.83))
    errors = {}
    for centre, radius, target, away in ((small, 1.0, small, 1e-3 / u), ((0.0, 0.0, -1e6), 1e6, (0.0, 0.0, 0.0), 2.0)):
        towards = np.column_stack([rng.uniform(-1, 1, (1000, 2)), np.full(1000, -1.0)])
        towards /= np.linalg.norm(towards, axis=1, keepdims=True)
        origins = target - away * towards + rng.uniform(-1.2, 1.2, (1000, 3)) * (1, 1, 0)
        rays = np.hstack([origins, towards]).astype(precision).astype(float)
        source = EMPTY + f"SPHERE ({','.join(map(repr, centre))}) {radius!r} {MATERIAL}\n"
        wanted = bench.hits("python", source, rays, sphere="wide")[:, 0]
        for method in ("wide", "robust"):
            found = bench.hits("cpp", source, rays, precision=precision, sphere=method)[:, 0]
            both = np.isfinite(found) & np.isfinite(wanted)
            missed = np.count_nonzero(both != np.isfinite(wanted))
            errors[radius, method] = np.abs(found[both] / wanted[both] - 1).max() / u, missed
            assert both.mean() > 0.3
    print(precision, errors)
    for radius in (1.0, 1e6):
        assert errors[radius, "wide"][1] == 0 and errors[radius, "wide"][0] < 64
    assert errors[1e6, "robust"][0] > 1e4


def test_given_directions_of_unit_length_are_taken_as_they_are(bench):
    """NUM-4: what is off by 2 u is not turned: t goes with it."""
    rays = np.array([[0, 0, 9, 0, 0, -1 - 2.0**-52], [0, 0, 9, 0, 0, -1 - 2.0**-48]])
    t = bench.hits("cpp", EMPTY + f"SPHERE (0,0,0) 1 {MATERIAL}\n", rays)[:, 0]
    assert t[1] == 8 and abs(t[0] - 8) <= 1e-14
