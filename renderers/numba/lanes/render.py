"""The picture tile by tile: all rays of one order of a tile, COUNT of them a packet, then those of the next (VEC-1)."""

import math

from numba import njit, prange

from ..needs import REFLECTION
from ..target import FASTMATH, kernel
from ..vector import add, row, scale, subtract
from .lanes import COUNT, any_of, count_of, fma, largest_of, numbered, select, smallest_of, spread, to_reals
from .memory import gather, load, scatter, store, store_some
from .scene import SIDE
from .shade import CENTRE, RADIUS, local_light, mirrored_share
from .sphere import cull, nearest
from .vector import along, dot, gather_three, normalise, select_three

ENTRY = {"error_model": "numpy", "fastmath": FASTMATH, "no_cfunc_wrapper": True}

# The pixels of a tile are numbered block by block, as neighbours hit the same spheres: a packet of eye rays is one.
ACROSS = 4
DOWN = COUNT // ACROSS
BLOCKS = SIDE // ACROSS  # in a row of the tile
SHIFT = ACROSS.bit_length() - 1  # x >> SHIFT is x // ACROSS


@kernel
def eye_directions(scene, width, height, x, y):
    """Of the rays through the pixels (x, y) (CAM-2, CAM-3)."""
    u, v, e = row(scene.u, 0), row(scene.v, 0), row(scene.e, 0)
    x = 2.0 * (to_reals(x) + scene.sample[0]) / width - 1.0
    y = 1.0 - 2.0 * (to_reals(y) + scene.sample[1]) / height
    return normalise(subtract(along(scale(x, u), y, v), e))


@kernel
def see(scene, thread, width, height, tile, eye):
    """Copy to `kept` the spheres that the eye rays of a tile can meet (VEC-2); their number.

    A cone of less than a right angle is convex: if it holds the rays of the corners, it holds those between them.
    """
    real = type(width)
    x0, y0, x1, y1 = tile
    k = numbered()
    corners = eye_directions(scene, width, height, select((k & 1) == 0, x0, x1 - 1), select((k & 2) == 0, y0, y1 - 1))
    axis = eye_directions(scene, width, height, spread((x0 + x1) >> 1), spread((y0 + y1) >> 1))
    cosines = dot(corners, axis)
    aside = along(corners, -cosines, axis)
    cosine, sine = smallest_of(cosines), math.sqrt(largest_of(dot(aside, aside)))
    if cosine < 0.5:  # too wide to leave out much: 0 is the distance of all
        axis, cosine, sine = subtract(axis, axis), real(0), real(1)
    kept, kept_ids = scene.kept[thread], scene.kept_ids[thread]
    return cull(scene.spheres, scene.ids, scene.count, eye, axis, cosine, sine, kept, kept_ids)


@kernel
def eye_packet(scene, width, height, tile, k):
    """Directions of the rays of pixel `k` of the tile and those after it, and the lanes that have one."""
    place, block = numbered(), k // COUNT
    x = place - (place >> SHIFT << SHIFT) + (tile[0] + block % BLOCKS * ACROSS)
    y = (place >> SHIFT) + (tile[1] + block // BLOCKS * DOWN)
    return eye_directions(scene, width, height, x, y), (x < tile[2]) & (y < tile[3])


@kernel
def surface(scene, index, hit, origin, direction, t):
    """Point and normal (SPH-2), and the step of OFF-1."""
    radius = gather(scene.surfaces, RADIUS, index, hit)
    centre = gather_three(scene.surfaces, CENTRE, index, hit)
    normal = normalise(subtract(along(origin, t, direction), centre))
    point = along(centre, radius, normal)
    error = fma(abs(normal[0]), abs(point[0]), fma(abs(normal[1]), abs(point[1]), abs(normal[2] * point[2])))
    return point, normal, scale(scene.epsilon * fma(0.125, error, radius), normal)


@kernel
def keep(rays, places, k, ray, leaves):
    """Write the rays of the mask `leaves` from row `k` on, over rays that have been read; how many."""
    origin, direction, weight, place = ray
    for c in range(3):
        store_some(rays, c, k, origin[c], leaves)
        store_some(rays, 3 + c, k, direction[c], leaves)
    store_some(rays, 6, k, weight, leaves)
    store_some(places, 0, k, place, leaves)
    return count_of(leaves)


@kernel
def deliver(colours, tile, x0, y0, picture):
    """Copy a tile to the picture, whose first pixel is (x0, y0); how many pixels are not finite (CNT-2)."""
    broken = 0
    for j in range(tile[1], tile[3]):
        for i in range(tile[0], tile[2]):
            x, y = i - tile[0], j - tile[1]
            k = (y // DOWN * BLOCKS + x // ACROSS) * COUNT + y % DOWN * ACROSS + x % ACROSS
            red, green, blue = colours[0, k], colours[1, k], colours[2, k]
            picture[j - y0, i - x0, 0], picture[j - y0, i - x0, 1], picture[j - y0, i - x0, 2] = red, green, blue
            broken += (red - red) + (green - green) + (blue - blue) != 0
    return broken


@njit(**ENTRY)
def render_tiles(scene, width, height, region, depth, first, step, picture, counts):
    """Every `step`-th tile of the region from its tile `first` on (CAM-5).

    `first` is the thread too: it says which work memory is its own.
    picture: (y1 - y0, x1 - x0, 3), linear RGB. counts: int64 (tiles, 5), of each tile: primary, reflected,
    transmitted, shadow, non-finite (CNT-1, CNT-2).
    """
    real = type(scene.epsilon)
    x0, y0, x1, y1 = region
    wide, high = real(width), real(height)
    rays, places, colours = scene.rays[first], scene.places[first], scene.colours[first]
    eye, background = row(scene.eye, 0), row(scene.background, 0)
    across = -(-(x1 - x0) // SIDE)
    for number in range(first, len(counts), step):
        left, top = x0 + number % across * SIDE, y0 + number // across * SIDE
        right, bottom = left + SIDE, top + SIDE
        tile = left, top, right if right < x1 else x1, bottom if bottom < y1 else y1
        reflected, feelers = 0, 0
        spheres, ids, count = scene.kept[first], scene.kept_ids[first], see(scene, first, wide, high, tile, eye)
        order, waiting = 0, SIDE * SIDE
        while waiting > 0:
            later = 0
            for k in range(0, waiting, COUNT):
                if order == 0:
                    origin, weight = (spread(eye[0]), spread(eye[1]), spread(eye[2])), spread(1.0)
                    direction, active = eye_packet(scene, wide, high, tile, k)
                    place = numbered() + k
                else:
                    origin = load(rays, 0, k), load(rays, 1, k), load(rays, 2, k)
                    direction = load(rays, 3, k), load(rays, 4, k), load(rays, 5, k)
                    weight, place, active = load(rays, 6, k), load(places, 0, k), numbered() < waiting - k
                t, index = nearest(spheres, ids, count, origin, direction)
                hit = active & (index >= 0)
                colour = spread(background[0]), spread(background[1]), spread(background[2])
                if any_of(hit):
                    point, normal, off = surface(scene, index, hit, origin, direction, t)
                    light, more = local_light(scene, index, hit, point, normal, direction, add(point, off))
                    colour = select_three(hit, light, colour)
                    feelers += more
                    if REFLECTION and order < depth:
                        cosine = dot(direction, normal)
                        share = mirrored_share(scene.surfaces, index, hit, cosine)
                        origin = along(point, select(cosine > 0.0, -1.0, 1.0), off)
                        direction = normalise(along(direction, -2.0 * cosine, normal))
                        ray = origin, direction, weight * share, place
                        later += keep(rays, places, later, ray, hit & (share != 0.0))
                if order == 0:
                    for c in range(3):
                        store(colours, c, k, colour[c])
                else:
                    for c in range(3):
                        before = gather(colours, c, place, active)
                        scatter(colours, c, place, active, fma(weight, colour[c], before))
            reflected += later
            spheres, ids, count = scene.spheres, scene.ids, scene.count
            order, waiting = order + 1, later
        counts[number, 0], counts[number, 1], counts[number, 3] = (tile[2] - left) * (tile[3] - top), reflected, feelers
        counts[number, 4] = deliver(colours, tile, x0, y0, picture)


@njit(**ENTRY, parallel=True)
def render_tiles_parallel(scene, width, height, region, depth, first, step, picture, counts):
    """render_tiles for `first` and the `step` - 1 after it, each on a thread."""
    for k in prange(step):
        render_tiles(scene, width, height, region, depth, first + k, step, picture, counts)
