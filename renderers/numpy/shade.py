"""Light at a point (LOC-1 to LOC-5), leaving it (OFF-1) and what it reflects (REF-1 to REF-3)."""

import numpy as np

from .vector import dot, largest, normalise


def leave(scene, points, normals, shapes, outward):
    """Points just off the surface, on the side of the normal where `outward`, else on the other (OFF-1)."""
    step = scene.epsilon * np.maximum(largest(points), scene.sizes[shapes])
    return points + np.where(outward, step, -step) * normals


def local(scene, directions, points, normals, d_dot_n, shapes, shadows):
    """Colours (3, N) of `points` seen along `directions`, and the number of feelers (LOC-1 to LOC-5)."""
    diffuse = scene.diffuse.take(shapes, axis=1)
    colours = diffuse * scene.ambient
    feelers = 0
    if shadows:
        starts = leave(scene, points, normals, shapes, True)
    for position, light_colour in scene.lights:
        l = position - points  # noqa: E741, the SPEC's letter
        distances = np.sqrt(dot(l, l))
        l /= distances  # noqa: E741
        cosines = dot(normals, l)
        lit = cosines > 0
        if shadows:
            rays = np.flatnonzero(lit)
            lit[rays] = ~scene.blocked(starts.take(rays, axis=1), l.take(rays, axis=1), distances[rays])
            feelers += len(rays)
        light = diffuse * np.where(lit, cosines, 0)
        highlights = dot(l, directions) - 2 * cosines * d_dot_n  # -(r·d) with r = 2 (n·l) n - l
        bright = np.flatnonzero(lit & (highlights > 0))
        of = shapes[bright]
        light[:, bright] += scene.k_s[of] * np.minimum(highlights[bright], 1) ** scene.exponent[of]
        light *= light_colour
        colours += light
    return colours, feelers


def fresnel(scene, shapes, d_dot_n):
    """Reflectance R (N,) of the surfaces between AIR and the materials of `shapes` (REF-1, REF-2)."""
    inward = d_dot_n <= 0
    index, mu = scene.refractive_index[shapes], scene.mu[shapes]
    n = np.where(inward, scene.air_refractive_index / index, index / scene.air_refractive_index)
    m = np.where(inward, scene.air_mu / mu, mu / scene.air_mu)
    c = np.minimum(np.abs(d_dot_n), 1)
    x = 1 - n * n * (1 - c * c)
    s = np.sqrt(x)
    perpendicular = (n * c - m * s) / (n * c + m * s)
    parallel = (m * c - n * s) / (m * c + n * s)
    return np.where(x < 0, 1, (perpendicular * perpendicular + parallel * parallel) / 2)


def reflect(directions, normals, d_dot_n):
    """The mirrored directions (REF-3)."""
    return normalise(directions - 2 * d_dot_n * normals)
