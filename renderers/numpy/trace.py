"""From rays to colours: the wavefront (REF-4 to REF-6)."""

from typing import Any, NamedTuple

import numpy as np

from .shade import fresnel, leave, local, reflect
from .vector import dot, normalise, of_rays

CHUNK = 1 << 14  # rays at once: their arrays stay in the processor's cache
WAVE = 1 << 18  # pixels at once: bounds the memory of a large picture


class Rays(NamedTuple):
    """Rays that each add `weights` times their colour to one pixel."""

    origins: Any  # (3, N), or (3, 1) for eye rays
    directions: Any  # (3, N)
    weights: Any  # (N,)
    pixels: Any  # (N,)


class Counts:
    """Rays traced in one frame (CNT-1)."""

    def __init__(self):
        self.primary = self.reflected = self.shadow = 0


def trace(scene, camera, depth, shadows):
    """One frame: the picture (rows, columns, 3) of the camera's region, and the counts."""
    pixels = camera.rows * camera.columns
    picture = np.zeros((3, pixels), scene.precision)
    counts = Counts()
    counts.primary = pixels
    for start in range(0, pixels, WAVE):
        wave = eye_rays(camera, start, min(start + WAVE, pixels))
        for order in range(depth + 1):
            reflected = [add_light(scene, rays, picture, shadows, order < depth, counts) for rays in wave]
            if order == depth or not reflected:
                break
            wave = chunks(reflected)
            counts.reflected += sum(len(rays.pixels) for rays in wave)
    return np.ascontiguousarray(picture.T).reshape(camera.rows, camera.columns, 3), counts


def eye_rays(camera, start, end):
    """Chunks of rays through the pixels start ≤ pixel < end."""
    for begin in range(start, end, CHUNK):
        pixels = np.arange(begin, min(begin + CHUNK, end))
        origin, directions = camera.rays(pixels)
        yield Rays(origin, directions, np.ones(len(pixels), directions.dtype), pixels)


def chunks(parts):
    """The rays of all `parts`, in the same order, in full chunks."""
    rays = Rays(*(np.concatenate(arrays, axis=-1) for arrays in zip(*parts, strict=True)))
    return [Rays(*(array[..., begin : begin + CHUNK] for array in rays)) for begin in range(0, len(rays.pixels), CHUNK)]


def add_light(scene, rays, picture, shadows, reflects, counts):
    """Add what the rays see to the picture; if it `reflects`, return the rays that leave (REF-4 to REF-6)."""
    t, shapes = scene.nearest(rays.origins, rays.directions)
    missed, hit = np.flatnonzero(shapes < 0), np.flatnonzero(shapes >= 0)
    picture[:, rays.pixels[missed]] += rays.weights[missed] * scene.background
    shapes, weights, pixels = shapes[hit], rays.weights[hit], rays.pixels[hit]
    directions = rays.directions.take(hit, axis=1)
    points, normals = scene.surface(shapes, of_rays(rays.origins, hit), directions, t[hit])
    d_dot_n = dot(directions, normals)
    colours, feelers = local(scene, directions, points, normals, d_dot_n, shapes, shadows)
    picture[:, pixels] += weights * colours
    counts.shadow += feelers
    if not reflects:
        return None
    shares = scene.k_s[shapes] * fresnel(scene, shapes, d_dot_n)
    weights = weights * shares
    alive = np.flatnonzero(shares != 0)
    starts = leave(scene, points, normals, shapes, d_dot_n <= 0)
    mirrored = reflect(directions, normals, d_dot_n)
    return Rays(starts.take(alive, axis=1), mirrored.take(alive, axis=1), weights[alive], pixels[alive])


def first_hits(scene, rays):
    """One frame of kind `rays`: rows (t, point, normal, object) in float64 for rays (6, N), origin and direction."""
    answer = np.zeros((rays.shape[1], 8))
    answer[:, 0], answer[:, 7] = np.inf, -1
    for begin in range(0, len(answer), CHUNK):
        rows = answer[begin : begin + CHUNK]
        origins, directions = np.split(rays[:, begin : begin + CHUNK], 2)
        directions = normalise(directions)
        t, shapes = scene.nearest(origins, directions)
        hit = np.flatnonzero(shapes >= 0)
        t, shapes = t[hit], shapes[hit]
        points, normals = scene.surface(shapes, origins[:, hit], directions[:, hit], t)
        rows[hit] = np.vstack([t, points, normals, scene.objects[shapes]]).T
    return answer
