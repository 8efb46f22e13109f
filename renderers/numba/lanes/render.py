"""The picture tile by tile: all rays of one order of a tile, COUNT of them a packet, then those of the next (VEC-1)."""

import math

from numba import njit, prange

from ..needs import ATTENUATION, CUTOFF, JITTERED, LENS, MEDIA, REFLECTION, SCATTERED, SPHERE, SUPERSAMPLING
from ..target import FASTMATH, kernel
from ..vector import add, row, scale, subtract
from .cull import cull_others, cull_spheres
from .functions import turn
from .lanes import COUNT, any_of, fma, lane, largest_of, numbered, select, smallest_of, spread, to_reals
from .leave import branches, leave
from .memory import gather, load, scatter, store
from .random import draw
from .rays import BRANCHES, first_weight, kept, of_channel, select_weight
from .reflect import attenuated, sides
from .scene import OTHERS, SIDE
from .search import SPOILS, nearest
from .shade import local_light
from .surface import surface
from .vector import along, dot, normalise, select_three

ENTRY = {"error_model": "numpy", "fastmath": FASTMATH, "no_cfunc_wrapper": True}

# The pixels of a tile are numbered block by block, as neighbours hit the same shapes: a packet of eye rays is one.
ACROSS = 4
DOWN = COUNT // ACROSS
BLOCKS = SIDE // ACROSS  # in a row of the tile
# x >> SHIFT is x // ACROSS, and so on.
SHIFT, COUNT_SHIFT, BLOCK_SHIFT = (n.bit_length() - 1 for n in (ACROSS, COUNT, BLOCKS))
DRAWS = JITTERED or LENS  # samples draw random numbers


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
    if not SUPERSAMPLING:
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
def eye_packet(scene, width, height, x, y, pixel, sample):
    """Origin and direction of the rays of a sample of the pixels (x, y) (CAM-4, SAM-1, SAM-2, LEN-1)."""
    real = type(width)
    half = real(0.5)
    eye = row(scene.eye, 0)
    origin = spread(eye[0]), spread(eye[1]), spread(eye[2])
    a = b = spread(half)
    if DRAWS:
        u = draw(scene, pixel, sample, pixel & 0, 0)
    if JITTERED:
        a, b = u[0], u[1]
    if SUPERSAMPLING:
        n = scene.samples
        a, b = (a + real(sample % n)) / real(n), (b + real(sample // n)) / real(n)
        x, y = to_reals(x) + (a + (scene.sample[0] - half)), to_reals(y) + (b + (scene.sample[1] - half))
    else:
        x, y = to_reals(x) + scene.sample[0], to_reals(y) + scene.sample[1]
    direction = eye_directions(scene, width, height, x, y)
    if LENS:
        rho, (cosine, sine) = math.sqrt(u[2]), turn(u[3])
        h = along(scale(rho * cosine, row(scene.lens, 0)), rho * sine, row(scene.lens, 1))
        origin, direction = add(origin, h), subtract(scale(scene.focus, direction), h)
    return origin, normalise(direction)


@kernel
def add_light(light, place, active, weight, colour):
    """Add weighted colours to those of their places."""
    for c in range(3):
        if BRANCHES:  # several rays of a packet may be of one place
            more = of_channel(weight, c) * colour[c]
            for k in range(COUNT):
                if lane(active, k):
                    light[c, lane(place, k)] += lane(more, k)
        else:
            before = gather(light, c, place, active)
            scatter(light, c, place, active, fma(of_channel(weight, c), colour[c], before))


@kernel
def deliver(scene, thread, light, tile, x0, y0, sample, samples, picture):
    """Add a tile's samples to the picture, whose first pixel is (x0, y0); how many are not finite (CNT-2)."""
    real = type(scene.epsilon)
    broken = 0
    for j in range(tile[1], tile[3]):
        for i in range(tile[0], tile[2]):
            x, y = i - tile[0], j - tile[1]
            k = (y // DOWN * BLOCKS + x // ACROSS) * COUNT + y % DOWN * ACROSS + x % ACROSS
            red, green, blue = light[0, k], light[1, k], light[2, k]
            broken += (red - red) + (green - green) + (blue - blue) != 0
            if SUPERSAMPLING:
                for c in range(3):
                    total = light[c, k]
                    if sample > 0:
                        total += picture[j - y0, i - x0, c]
                    if sample == samples - 1:
                        total /= real(samples)
                    picture[j - y0, i - x0, c] = total
            else:
                picture[j - y0, i - x0, 0], picture[j - y0, i - x0, 1], picture[j - y0, i - x0, 2] = red, green, blue
            if CUTOFF and sample == samples - 1:
                scene.dropped[j - y0, i - x0] = scene.losses[thread, 0, k] / real(samples)
                scene.losses[thread, 0, k] = 0
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
    rays, places, light = scene.rays[first], scene.places[first], scene.light[first]
    waiting, read = scene.progress[first, 0], scene.progress[first, 1]
    eye, background = row(scene.eye, 0), row(scene.background, 0)
    across, room = -(-(x1 - x0) // SIDE), rays.shape[1] - COUNT
    samples = scene.samples * scene.samples if SUPERSAMPLING else 1
    balls, numbers, count, others, other_count = 0, 0, 0, 0, 0
    for number in range(first, len(counts), step):
        left, top = x0 + number % across * SIDE, y0 + number // across * SIDE
        right, bottom = left + SIDE, top + SIDE
        tile = left, top, right if right < x1 else x1, bottom if bottom < y1 else y1
        seen_spheres, seen_others = 0, 0
        if not LENS:
            seen_spheres, seen_others = see(scene, first, wide, high, tile, eye)
        reflected, transmitted, feelers, broken = 0, 0, 0, 0
        for sample in range(samples):
            if SPOILS:
                for c in range(3):
                    for k in range(SIDE * SIDE):
                        light[c, k] = 0
            order, waiting[0], read[0] = 0, SIDE * SIDE, 0
            while order >= 0:
                full = BRANCHES and order < depth and waiting[order + 1] + COUNT * branches(scene) > room
                if full or read[order] >= waiting[order]:
                    if order < depth and waiting[order + 1] > 0:  # on to the next order
                        order += 1
                        read[order] = 0
                    else:  # back to one that may not be done
                        waiting[order] = 0
                        order -= 1
                    continue
                k = read[order]
                read[order] = k + COUNT
                if SPHERE:
                    balls, numbers, count = scene.sphere_columns, scene.sphere_numbers, len(scene.spheres)
                if OTHERS:
                    others, other_count = scene.ball_numbers, scene.ball_columns.shape[1] - COUNT
                if order == 0:
                    if SPHERE and not LENS:
                        balls, numbers, count = (
                            scene.seen_spheres[first],
                            scene.seen_sphere_numbers[first],
                            seen_spheres,
                        )
                    if OTHERS and not LENS:
                        others, other_count = scene.seen_balls[first], seen_others
                    place = numbered() + k
                    x, y = pixels_of(place, tile)
                    active, pixel = (x < tile[2]) & (y < tile[3]), y * width + x
                    origin, direction = eye_packet(scene, wide, high, x, y, pixel, sample)
                    weight, members, path = first_weight(), place & 0, place & 0
                    if MEDIA:
                        members = members + scene.eye_media
                else:
                    origin, direction, weight, place, members, path = kept(rays, places, order, k)
                    active = numbered() < waiting[order] - k
                    pixel = place
                    if SCATTERED:
                        place = select(active, place, 0)
                        x, y = pixels_of(place, tile)
                        pixel = y * width + x
                t, face = nearest(
                    scene, first, balls, numbers, count, others, other_count, active, origin, direction, place
                )
                hit = active & (face >= 0)
                colour = spread(background[0]), spread(background[1]), spread(background[2])
                if any_of(hit):
                    point, normal, off, role = surface(scene, first, face, hit, origin, direction, t, place)
                    ray, outside = (pixel, sample, path), add(point, off)
                    light_there, more = local_light(
                        scene, first, role, hit, point, normal, direction, outside, place, ray
                    )
                    colour = select_three(hit, light_there, colour)
                    feelers += more
                    cosine = dot(direction, normal)
                    if ATTENUATION or (REFLECTION and order < depth):
                        around = sides(scene, role, hit, cosine > 0.0, members)
                        onward = attenuated(scene, weight, around[0], t, hit)
                        weight = select_weight(hit, onward, weight)
                        if REFLECTION and order < depth:
                            of_ray, of_hit = (direction, place, pixel, path), (point, normal, off, role, cosine)
                            back, through = leave(
                                scene,
                                first,
                                rays,
                                places,
                                order + 1,
                                waiting[order + 1],
                                hit,
                                of_ray,
                                weight,
                                sample,
                                of_hit,
                                around,
                            )
                            waiting[order + 1] += back + through
                            reflected, transmitted = reflected + back, transmitted + through
                if order == 0:
                    for c in range(3):
                        before = load(light, c, k) if SPOILS else spread(0.0)
                        store(light, c, k, fma(of_channel(weight, c), colour[c], before))
                else:
                    add_light(light, place, active, weight, colour)
            broken += deliver(scene, first, light, tile, x0, y0, sample, samples, picture)
        counts[number, 0], counts[number, 1] = (tile[2] - left) * (tile[3] - top) * samples, reflected
        counts[number, 2], counts[number, 3], counts[number, 4] = transmitted, feelers, broken


@njit(**ENTRY, parallel=True)
def render_tiles_parallel(scene, width, height, region, depth, first, step, picture, counts):
    """render_tiles for `first` and the `step` - 1 after it, each on a thread."""
    for k in prange(step):
        render_tiles(scene, width, height, region, depth, first + k, step, picture, counts)
