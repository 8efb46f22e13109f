"""Renders all pixels at once: order after order (WLK-1, chain), and within it one sphere or light after the other.

A vector is a tuple of three arrays (N,) or of three numbers: XLA compiles arrays (3, N) to slow code.
"""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

UNROLL = 4  # spheres tried in one pass over the rays


class Scene(NamedTuple):
    """Arrays of the job's type; `surfaces`: diffuse colour, k_s, exponent; `optics`: N, M entering, N, M leaving."""

    camera: Any
    ambient: Any
    background: Any
    lights: Any
    spheres: Any
    surfaces: Any
    optics: Any
    epsilon: Any


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def along(a, s, b):
    """a + s b"""
    return tuple(x + s * y for x, y in zip(a, b, strict=True))


def scale(s, a):
    return tuple(s * x for x in a)


def subtract(a, b):
    return tuple(x - y for x, y in zip(a, b, strict=True))


def divide(a, b):
    """a / b, where XLA would multiply by the inverse: if b is a root or the same for all (NUM-4)."""
    return a / lax.optimization_barrier(jnp.broadcast_to(jnp.asarray(b, a.dtype), a.shape))


def normalise(a):
    """NUM-4"""
    length = jnp.sqrt(dot(a, a))
    return tuple(divide(x, length) for x in a)


def take(table, rows):
    """The columns of the given rows, each (N,)."""
    return tuple(column[rows] for column in table.T)


def distance(sphere, origins, directions):
    """Distances (N,) to a sphere (SPH-1), inf for a miss; one division, as each costs all rays."""
    f = subtract(origins, sphere[:3])
    square = sphere[3] * sphere[3]
    b = -dot(f, directions)
    l = along(f, b, directions)  # noqa: E741, the SPEC's letter
    delta, k, ahead = square - dot(l, l), dot(f, f) - square, b >= 0
    s = jnp.sqrt(delta)
    q = jnp.where(ahead, b + s, b - s)
    t = jnp.where((k > 0) | ~ahead, k / q, q)
    return jnp.where((delta >= 0) & ((k <= 0) | (b > 0)), t, jnp.inf)


def nearest(spheres, origins, directions):
    """Returns distances (N,) and numbers of the first hits (HIT-1, HIT-2)."""

    def closer(i, best):
        t = distance(spheres[i], origins, directions)
        better = (t > 0) & (t < best[0])
        return jnp.where(better, t, best[0]), jnp.where(better, jnp.int32(i), best[1])

    nothing = jnp.full_like(directions[0], jnp.inf), jnp.full_like(directions[0], -1, jnp.int32)
    return lax.fori_loop(0, len(spheres), closer, nothing, unroll=UNROLL)


def occluded(spheres, origins, directions, limits):
    """HIT-5"""

    def blocks(i, blocked):
        t = distance(spheres[i], origins, directions)
        return blocked | ((t > 0) & (t < limits))

    return lax.fori_loop(0, len(spheres), blocks, jnp.zeros_like(limits, bool), unroll=UNROLL)


def reflectance(n, m, cosines):
    """R of REF-2."""
    c = jnp.minimum(jnp.abs(cosines), 1)
    x = 1 - n * n * (1 - c * c)
    s = jnp.sqrt(jnp.maximum(x, 0))
    r1, r2 = (n * c - m * s) / (n * c + m * s), (m * c - n * s) / (m * c + n * s)
    r = jnp.where(x <= 0, 1, (r1 * r1 + r2 * r2) / 2)
    return jnp.where((n == 1) & (m == 1), 0, r)


def local(scene, needs, surface, points, starts, normals, directions, seen):
    """Colours of the points that are `seen` (LOC-1 to LOC-4), and the number of feelers, from `starts`."""
    *diffuse, k_s, exponents = surface
    colours, feelers = tuple(k * a for k, a in zip(diffuse, scene.ambient, strict=True)), 0
    for light in scene.lights:
        to_light = subtract(light[:3], points)
        distances = jnp.sqrt(dot(to_light, to_light))
        l = tuple(divide(x, distances) for x in to_light)  # noqa: E741
        cosines = dot(normals, l)
        lit = seen & (cosines > 0)
        if "shadows" in needs:
            feelers += jnp.count_nonzero(lit)
            lit &= ~occluded(scene.spheres, starts, l, distances)
        shine = 0
        if "phong" in needs:
            c = -dot(subtract(scale(2 * cosines, normals), l), directions)
            shine = jnp.where(c > 0, k_s * jnp.clip(c, 0, 1) ** exponents, 0)
        received = (jnp.where(lit, k * cosines + shine, 0) for k in diffuse)
        colours = tuple(c + x * part for c, x, part in zip(colours, received, light[3:6], strict=True))
    return tuple(jnp.where(seen, channel, 0) for channel in colours), feelers


@partial(jax.jit, static_argnames=("region", "size", "sample", "depth", "needs"))
def render(scene, region, size, sample, depth, needs):
    """The picture (rows, columns, 3), and the numbers of reflected rays and of feelers."""
    x0, y0, x1, y1 = region
    real = scene.camera.dtype
    j, i = jnp.divmod(jnp.arange((y1 - y0) * (x1 - x0)), x1 - x0)
    x = divide(2 * ((x0 + i).astype(real) + sample[0]), size[0]) - 1  # CAM-2
    y = 1 - divide(2 * ((y0 + j).astype(real) + sample[1]), size[1])
    centre, u, v, e = scene.camera
    directions = normalise(subtract(along(scale(x, u), y, v), e))  # CAM-3
    origins = tuple(jnp.full_like(x, place) for place in centre + e)

    def goes_on(state):
        return (state[0] <= depth) & jnp.any(state[-1] > 0)

    def step(state):
        order, colours, reflected, feelers, origins, directions, weights = state
        t, near = nearest(scene.spheres, origins, directions)
        hit = (near >= 0) & (weights > 0)
        missed = jnp.where(near < 0, weights, 0)  # REF-6
        *centres, radii = take(scene.spheres, near)
        normals = normalise(subtract(along(origins, t, directions), centres))  # SPH-2
        points = along(centres, radii, normals)
        across = sum(jnp.abs(n * p) for n, p in zip(normals, points, strict=True))
        off = scene.epsilon * (radii + across / 8)  # OFF-1
        surface = take(scene.surfaces, near)
        seen, asked = local(
            scene, needs, surface, points, along(points, off, normals), normals, directions, hit
        )  # fmt: skip
        colours = along(along(colours, missed, scene.background), weights, seen)
        cosines = dot(directions, normals)
        entering = cosines <= 0
        n_in, m_in, n_out, m_out = take(scene.optics, near)
        r = reflectance(jnp.where(entering, n_in, n_out), jnp.where(entering, m_in, m_out), cosines)
        weights = jnp.where(hit, weights * surface[3] * r, 0)  # REF-4
        reflected += jnp.where(order < depth, jnp.count_nonzero(weights), 0)  # REF-5
        origins = along(points, jnp.where(entering, off, -off), normals)
        directions = normalise(along(directions, -2 * cosines, normals))  # REF-3
        return order + 1, colours, reflected, feelers + asked, origins, directions, weights

    black = (jnp.zeros_like(x),) * 3
    state = lax.while_loop(goes_on, step, (0, black, 0, 0, origins, directions, jnp.ones_like(x)))
    return jnp.stack(state[1], axis=-1).reshape(y1 - y0, x1 - x0, 3), state[2], state[3]
