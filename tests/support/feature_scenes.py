"""Scenes in general position: each feature alone, and several that mix them; text and the job's parameters."""

import numpy as np
from random_scenes import random_material, random_scene, random_stage, words
from tessellate import ball, block, obj

MATTE = "(0.7,0.5,0.3) 0 20 (0,0,0) 9 1"
MIRROR = "(0.2,0.3,0.4) 0.7 30 (0,0,0) 400 1"
GLASS = "(0.05,0.02,0.03) 0.9 40 (1,1,1) 2.25 1"
TINTED = "(0.05,0.02,0.03) 0.9 40 (0.8,0.6,0.9) 1.9 1.3"
WATER = "(0,0,0) 0.95 40 (0.95,0.97,0.99) 1.77 1"


def glassy(rng):
    """A material that may be opaque, clear or tinted."""
    if rng.random() < 0.5:
        return random_material(rng)
    attenuation = words(rng.uniform(0.5, 1, 3)) if rng.random() < 0.6 else "(1,1,1)"
    optics = f"{attenuation} {rng.uniform(1.3, 3)} {rng.uniform(0.9, 1.2)}"
    return f"{words(rng.uniform(0, 0.2, 3))} {rng.uniform(0.6, 1)} 20 {optics}"


def some_rough(material, rng):
    """`material`, as its function of a random generator, with a roughness in two of three cases."""
    return lambda scene_rng: material(scene_rng) + (f" {rng.uniform(0.05, 0.6)}" if rng.random() < 2 / 3 else "")


def lights(rng, radius=0.0):
    return random_stage(rng).replace(" 0\n", f" {radius}\n")


def features(folder):
    """{name: (scene text, parameters)}; meshes are written to `folder`."""
    rng, widths = np.random.default_rng(2020), np.random.default_rng(51)
    rough = some_rough(random_material, widths)
    for name, (vertices, triangles) in {
        "ball": ball(2),
        "block": block(),
        "open": (block()[0], block()[1][:-1]),
    }.items():
        (folder / f"{name}.obj").write_text(obj(vertices, triangles))

    def mesh(name, place, material):
        return f'MESH "{folder / name}.obj" {place} {material}\n'

    def crowd(material=lambda _: MATTE, radius=0.0, extra="", count=3):
        return random_scene(rng, count, count, count, count, material=material, rest=lights(rng, radius)) + extra

    def solid(material):
        return (
            "AND OR SPHERE (0.1,0.2,0.3) 1.1 ELLIPSOID (0.9,0.1,-0.4) (0.9,0.2,0) (-0.1,0.5,0.2) (0.1,-0.1,0.8) END\n"
            "NOT BOX (-0.3,-0.1,0.2) (1.1,0.2,0.1) (-0.1,0.9,0.1) (0.2,-0.1,1.3) END END " + material + "\n"
        )

    stage = lights(rng)
    cut = f'AND MESH "{folder / "ball"}.obj" (0.2,-0.1,0.3) (20,30,40) 1.2 NOT SPHERE (0.8,0.7,0.9) 0.8 END END '
    nested = (
        f"SPHERE (0.1,0,0.2) 1.7 {WATER}\nSPHERE (0.3,0.2,0.4) 0.8 {GLASS}\n"
        f"BOX (-1.1,-0.9,-0.7) (1,0.1,0) (0,0.9,0.2) (0.1,0,1) {TINTED}\n"
        f"SPHERE (-0.6,0.5,0.9) 0.3 {MIRROR}\nSPHERE (1.6,0.3,0.1) 0.8 {TINTED}\n"
    )
    full = {"shadows": True, "depth": 5}
    own = np.random.default_rng(71)
    return {
        "spheres": (random_scene(own, 7, material=lambda _: MIRROR, rest=lights(own)), full),
        "transmission": (crowd(lambda _: GLASS), {"depth": 5}),
        "attenuation": (crowd(lambda _: TINTED) + "", {"depth": 4}),
        "air": (crowd(random_material).replace("AIR 1.21 1.1 (1,1,1)", "AIR 1.21 1.1 (0.9,0.95,0.8)"), {"depth": 3}),
        "media": (stage + nested, {"depth": 6}),
        "mesh": (stage + mesh("ball", "(0,0,0) (10,20,30) 1.5", MIRROR), full),
        "open mesh": (stage + mesh("open", "(-0.9,-0.8,-0.7) (11,22,33) 1.6", GLASS), full),
        "csg": (stage + solid(MIRROR), full),
        "csg mesh": (stage + cut + GLASS + "\n", full),
        "uniform": (crowd(), {"depth": 0, "sampler": "uniform", "samples": 3}),
        "jittered": (crowd(), {"depth": 0, "sampler": "jittered", "samples": 3, "seed": 5}),
        "adaptive": (crowd(), {"depth": 0, "sampler": "adaptive", "adaptive_depth": 3}),
        "lens": (
            crowd(),
            {"depth": 0, "sampler": "jittered", "samples": 2, "lens_radius": 0.3, "focal_distance": 6.0, "seed": 6},
        ),
        "soft": (
            crowd(radius=0.8, extra="LIGHT (-3,4,5) (0.2,0.3,0.2) 0\n"),
            {"depth": 0, "shadows": True, "feelers": 3, "seed": 7},
        ),
        "glossy": (crowd(rough), {"depth": 2, "glossy_rays": 3, "seed": 8}),
        "glossy, the study's weight": (
            crowd(rough),
            {"depth": 2, "glossy_rays": 2, "glossy_weight": "study", "seed": 8},
        ),
        "mix: glass, mirrors, shadows": (crowd(glassy), full),
        "mix: glass mesh and solid in water": (
            stage + nested + mesh("ball", "(-0.4,-1.2,0.5) (1,2,3) 0.7", TINTED) + solid(GLASS),
            {"depth": 4, "shadows": True},
        ),
        "mix: soft shadows and gloss through a lens": (
            crowd(rough, radius=0.5),
            {
                **{"depth": 2, "shadows": True, "feelers": 2, "glossy_rays": 2, "sampler": "jittered", "samples": 2},
                **{"lens_radius": 0.1, "focal_distance": 6.0, "seed": 9},
            },
        ),
        "mix: adaptive glass": (crowd(glassy), {**full, "sampler": "adaptive", "adaptive_depth": 2}),
        "mix: jittered glass, soft shadows": (
            crowd(glassy, radius=0.4) + solid(TINTED),
            {"depth": 3, "shadows": True, "feelers": 2, "sampler": "jittered", "samples": 2, "seed": 10},
        ),
        "mix: all of it": (
            crowd(some_rough(glassy, widths), radius=0.4, count=2)
            + nested
            + solid(TINTED)
            + mesh("ball", "(0,1.4,0) (5,6,7) 0.6", GLASS),
            {
                **{"depth": 3, "shadows": True, "feelers": 2, "glossy_rays": 2, "sampler": "adaptive"},
                **{"adaptive_depth": 1, "lens_radius": 0.05, "focal_distance": 6.0, "seed": 11},
            },
        ),
    }
