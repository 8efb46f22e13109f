"""Scenes and rays in general position, from a seeded generator."""

import numpy as np

MATERIAL = "(0.5,0.5,0.5) 0 1 (0,0,0) 1 1"


def words(values):
    return "(" + ",".join(repr(float(x)) for x in values) + ")"


def random_scene(rng, sphere=0, box=0, polygon=0, ellipsoid=0, spread=2.0, material=lambda rng: MATERIAL, rest=""):
    """Scene text with so many shapes within +-spread, `material(rng)` for each, and `rest` put before them."""
    lines = [rest or "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,5)"]
    for _ in range(sphere):
        lines.append(f"SPHERE {words(rng.uniform(-spread, spread, 3))} {rng.uniform(0.2, 0.9)} {material(rng)}")
    for _ in range(box):
        edges = " ".join(
            words(edge) for edge in rng.normal(0, 0.3, (3, 3)) + 0.8 * np.linalg.qr(rng.normal(size=(3, 3)))[0]
        )
        lines.append(f"BOX {words(rng.uniform(-spread, spread, 3))} {edges} {material(rng)}")
    for _ in range(polygon):
        # three vertices are always of one plane
        lines.append(f"POLYGON 3 {' '.join(words(v) for v in rng.uniform(-spread, spread, (3, 3)))} {material(rng)}")
    for _ in range(ellipsoid):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.2, 1.1, (3, 1))
        lines.append(f"ELLIPSOID {words(rng.uniform(-spread, spread, 3))} {' '.join(map(words, axes))} {material(rng)}")
    return "\n".join(lines) + "\n"


def random_rays(rng, count, far=6.0):
    """Half from outside, half from inside the crowd; aimed at it, with directions of any length."""
    origins = np.concatenate([rng.normal(0, far, (count // 2, 3)), rng.uniform(-1.5, 1.5, (count - count // 2, 3))])
    targets = rng.normal(0, 1.3, (count, 3))
    return np.hstack([origins, (targets - origins) * rng.uniform(0.1, 9, (count, 1))])


def random_material(rng):
    """An opaque material that shines and mirrors, by Fresnel with a permeability."""
    diffuse = words(rng.uniform(0.1, 0.9, 3))
    return f"{diffuse} {rng.uniform(0.2, 0.8)} {rng.uniform(1, 60)} (0,0,0) {rng.uniform(2, 400)} {rng.uniform(0.7, 3)}"


def random_stage(rng):
    """Camera, lights, ambient light, air and background."""
    eye = rng.normal(size=3)
    eye *= 6.1 / np.linalg.norm(eye)
    u = np.cross(eye, rng.normal(size=3))
    v = np.cross(eye, u)
    u, v = 2.1 * u / np.linalg.norm(u), 2.1 * v / np.linalg.norm(v)
    lines = [f"CAMERA {words(rng.normal(0, 0.1, 3))} {words(u)} {words(v)} {words(eye)}"]
    lines += [f"LIGHT {words(rng.normal(0, 6, 3))} {words(rng.uniform(0.3, 0.8, 3))} 0" for _ in range(2)]
    lines += ["AMBIENT (0.2,0.25,0.3)", "AIR 1.21 1.1 (1,1,1)", "BACKGROUND (0.1,0.12,0.2)"]
    return "\n".join(lines)
