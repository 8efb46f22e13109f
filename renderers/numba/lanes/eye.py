"""The eye rays of a tile (CAM, SAM, LEN), and the shapes that they can meet (VEC-2)."""

import math

from ..needs import ADAPTIVE, JITTERED, LENS, SOBOL, SPHERE, SUPERSAMPLING
from ..target import kernel
from ..vector import UNIT_ROUNDOFF, add, row, scale, subtract
from .functions import turn
from .lanes import COUNT, count_of, largest_of, numbered, select, smallest_of, spread, to_reals
from .memory import gather, load, store_some
from .random import draw_own
from .scene import OTHERS, SIDE
from .spheres import RADIUS, ROWS, X, Y, Z
from .vector import along, dot, normalise

# The pixels of a tile are numbered block by block, as neighbours hit the same shapes: a packet of eye rays is one.
ACROSS = 4
DOWN = COUNT // ACROSS
BLOCKS = SIDE // ACROSS  # in a row of the tile
# x >> SHIFT is x // ACROSS, and so on.
SHIFT, COUNT_SHIFT, BLOCK_SHIFT = (n.bit_length() - 1 for n in (ACROSS, COUNT, BLOCKS))
DRAWS = JITTERED or LENS  # samples draw random numbers

MARGIN = 64 * UNIT_ROUNDOFF  # rays, cone and Δ of SPH-1 are off by less than half of it


@kernel
def meets(balls, count, first, apex, axis, cosine, sine):
    """The balls from column `first` on that a cone can meet.

    cosine, sine: of the angle between axis and side; `cosine` > 0.
    """
    f = subtract((load(balls, X, first), load(balls, Y, first), load(balls, Z, first)), apex)
    radius = load(balls, RADIUS, first)
    height = dot(f, axis)
    aside = along(f, -height, axis)
    width, away = math.sqrt(dot(aside, aside)), math.sqrt(dot(f, f))
    beside = height * cosine + width * sine > 0.0  # else the apex is the nearest of the cone
    apart = select(beside, width * cosine - height * sine, away)
    return ~(apart > radius + MARGIN * (away + radius)) & (numbered() < count - first)


@kernel
def cull_spheres(table, ids, count, apex, axis, cosine, sine, kept, kept_ids):
    """Copy the spheres that a cone can meet; their number."""
    n = 0
    for first in range(0, count, COUNT):
        met = meets(table, count, first, apex, axis, cosine, sine)
        for r in range(ROWS):
            store_some(kept, r, n, load(table, r, first), met)
        store_some(kept_ids, 0, n, load(ids, 0, first), met)
        n += count_of(met)
    return n


@kernel
def cull_others(balls, ids, count, apex, axis, cosine, sine, kept_ids):
    """Copy the numbers of the shapes, in their balls, that a cone can meet; how many."""
    n = 0
    for first in range(0, count, COUNT):
        met = meets(balls, count, first, apex, axis, cosine, sine)
        store_some(kept_ids, 0, n, load(ids, 0, first), met)
        n += count_of(met)
    return n


@kernel
def eye_directions(scene, width, height, x, y):
    """Of the rays through (x, y), in pixels from the top left, not normalised (CAM-2, CAM-3)."""
    u, v, e = row(scene.u, 0), row(scene.v, 0), row(scene.e, 0)
    x = 2.0 * x / width - 1.0
    y = 1.0 - 2.0 * y / height
    return subtract(along(scale(x, u), y, v), e)


@kernel
def see(scene, thread, width, height, tile, eye):
    """Note the shapes that the eye rays of a tile can meet (VEC-2): how many spheres, and others.

    A cone of less than a right angle is convex: if it holds the rays of the corners, it holds those between them.
    """
    real = type(width)
    x0, y0, x1, y1 = tile
    wide = half = real(0.5)  # from a pixel's middle to the furthest of its samples
    if not (SUPERSAMPLING or ADAPTIVE):
        wide = real(0)
    left, right = real(x0) + scene.sample[0] - wide, real(x1 - 1) + scene.sample[0] + wide
    top, bottom = real(y0) + scene.sample[1] - wide, real(y1 - 1) + scene.sample[1] + wide
    k = numbered()
    x, y = select((k & 1) == 0, spread(left), right), select((k & 2) == 0, spread(top), bottom)
    corners = normalise(eye_directions(scene, width, height, x, y))
    middle = eye_directions(scene, width, height, spread(half * (left + right)), spread(half * (top + bottom)))
    axis = normalise(middle)
    cosines = dot(corners, axis)
    aside = along(corners, -cosines, axis)
    cosine, sine = smallest_of(cosines), math.sqrt(largest_of(dot(aside, aside)))
    if cosine < 0.5:  # too wide to leave out much: 0 is the distance of all
        axis, cosine, sine = subtract(axis, axis), real(0), real(1)
    spheres, others = 0, 0
    if SPHERE:
        table, numbers, count = scene.sphere_columns, scene.sphere_numbers, len(scene.spheres)
        seen, seen_numbers = scene.seen_spheres[thread], scene.seen_sphere_numbers[thread]
        spheres = cull_spheres(table, numbers, count, eye, axis, cosine, sine, seen, seen_numbers)
    if OTHERS:
        balls, count = scene.ball_columns, scene.ball_columns.shape[1] - COUNT
        others = cull_others(balls, scene.ball_numbers, count, eye, axis, cosine, sine, scene.seen_balls[thread])
    return spheres, others


@kernel
def pixels_of(place, tile):
    """The pixels (x, y) of places in a tile."""
    block, within = place >> COUNT_SHIFT, place & (COUNT - 1)
    x = ((block & (BLOCKS - 1)) << SHIFT) + (within & (ACROSS - 1))
    return x + tile[0], ((block >> BLOCK_SHIFT) * DOWN) + (within >> SHIFT) + tile[1]


@kernel
def pixel_of(scene, thread, width, tile, place, active):
    """The number of the pixel, or of the point of the lattice, that places in a tile are of (RND-3)."""
    if ADAPTIVE:
        points, cells = scene.points[thread], 1 << scene.levels
        return gather(points, 1, place, active) * (cells * width + 1) + gather(points, 0, place, active)
    x, y = pixels_of(place, tile)
    return y * width + x


@kernel
def eye_packet(scene, thread, width, height, tile, count, k, sample):
    """Of the eye rays of places from `k` on: which there are, origin, direction (CAM-4, SAM, LEN-1)."""
    real = type(scene.epsilon)
    half = real(0.5)
    wide, high = real(width), real(height)
    eye, place = row(scene.eye, 0), numbered() + k
    origin = spread(eye[0]), spread(eye[1]), spread(eye[2])
    a = b = spread(half)
    if DRAWS:
        pixel = pixel_of(scene, thread, width, tile, place, place < count)
        u = draw_own(scene, pixel, sample)
    if JITTERED:
        a, b = u[0], u[1]
    if ADAPTIVE:
        points, cells = scene.points[thread], real(1 << scene.levels)
        active = place < count
        x = to_reals(load(points, 0, k)) / cells + (scene.sample[0] - half)
        y = to_reals(load(points, 1, k)) / cells + (scene.sample[1] - half)
    else:
        x, y = pixels_of(place, tile)
        active = (x < tile[2]) & (y < tile[3])
        if SUPERSAMPLING:
            n = scene.row_length
            if not SOBOL:
                a, b = (a + real(sample % n)) / real(n), (b + real(sample // n)) / real(n)
            x, y = to_reals(x) + (a + (scene.sample[0] - half)), to_reals(y) + (b + (scene.sample[1] - half))
        else:
            x, y = to_reals(x) + scene.sample[0], to_reals(y) + scene.sample[1]
    direction = eye_directions(scene, wide, high, x, y)
    if LENS:
        rho, (cosine, sine) = math.sqrt(u[2]), turn(u[3])
        h = along(scale(rho * cosine, row(scene.lens, 0)), rho * sine, row(scene.lens, 1))
        origin, direction = add(origin, h), subtract(scale(scene.focus, direction), h)
    return active, origin, normalise(direction)
