"""The picture tile by tile: all rays of one order of a tile, COUNT of them a packet, then those of the next (VEC-1)."""

from numba import njit, prange

from ..needs import ADAPTIVE, ATTENUATION, CUTOFF, LENS, MEDIA, REFLECTION, SCATTERED, SPHERE, SUPERSAMPLING
from ..target import FASTMATH, called, kernel
from ..vector import add, row
from .eye import ACROSS, BLOCKS, DOWN, eye_packet, pixel_of, see
from .lanes import COUNT, any_of, fma, lane, numbered, select, spread
from .leave import branches, leave
from .memory import gather, load, scatter, store
from .rays import BRANCHES, first_weight, kept, of_channel, select_weight
from .reflect import attenuated, sides
from .scene import OTHERS, SIDE
from .search import SPOILS, nearest
from .shade import local_light
from .surface import surface
from .vector import dot, select_three

ENTRY = {"error_model": "numpy", "fastmath": FASTMATH, "no_cfunc_wrapper": True}


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
    """Add a tile's samples to the picture, whose first pixel is (x0, y0); how many are not finite (CNT-2).

    scene.lines has the sum of each pixel's row of samples so far (SAM-3).
    """
    real = type(scene.epsilon)
    broken = 0
    for j in range(tile[1], tile[3]):
        for i in range(tile[0], tile[2]):
            x, y = i - tile[0], j - tile[1]
            k = (y // DOWN * BLOCKS + x // ACROSS) * COUNT + y % DOWN * ACROSS + x % ACROSS
            red, green, blue = light[0, k], light[1, k], light[2, k]
            broken += (red - red) + (green - green) + (blue - blue) != 0
            if SUPERSAMPLING:
                n, lines = scene.row_length, scene.lines[thread]
                for c in range(3):
                    total = light[c, k]
                    if sample % n > 0:
                        total += lines[c, k]
                    lines[c, k] = total
                    if sample % n == n - 1 or sample == samples - 1:
                        if sample >= n:
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


@kernel
def follow(scene, thread, width, height, depth, tile, seen, count, sample):
    """Work out a sample of each of the tile's first `count` places, into scene.light, order by order of its rays.

    seen: how many spheres, and other shapes, the eye rays can meet. How many rays are reflected, transmitted, feelers.
    """
    rays, places, light = scene.rays[thread], scene.places[thread], scene.light[thread]
    waiting, read = scene.progress[thread, 0], scene.progress[thread, 1]
    background, room = row(scene.background, 0), rays.shape[1] - COUNT
    balls, numbers, ball_count, others, other_count = 0, 0, 0, 0, 0
    reflected, transmitted, feelers = 0, 0, 0
    if SPOILS:
        for c in range(3):
            for k in range(count):
                light[c, k] = 0
    order, waiting[0], read[0] = 0, count, 0
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
            balls, numbers, ball_count = scene.sphere_columns, scene.sphere_numbers, len(scene.spheres)
        if OTHERS:
            others, other_count = scene.ball_numbers, scene.ball_columns.shape[1] - COUNT
        if order == 0:
            if SPHERE and not LENS:
                balls, numbers, ball_count = scene.seen_spheres[thread], scene.seen_sphere_numbers[thread], seen[0]
            if OTHERS and not LENS:
                others, other_count = scene.seen_balls[thread], seen[1]
            place = numbered() + k
            active, origin, direction = eye_packet(scene, thread, width, height, tile, count, k, sample)
            weight, members, path = first_weight(), place & 0, place & 0
            if MEDIA:
                members = members + scene.eye_media
        else:
            origin, direction, weight, place, members, path = kept(rays, places, order, k)
            active = numbered() < waiting[order] - k
        pixel = place
        if SCATTERED:
            place = select(active, place, 0)
            pixel = pixel_of(scene, thread, width, tile, place, active)
        t, face = nearest(
            scene, thread, balls, numbers, ball_count, others, other_count, active, origin, direction, place
        )
        hit = active & (face >= 0)
        colour = spread(background[0]), spread(background[1]), spread(background[2])
        if any_of(hit):
            point, normal, off, role = surface(scene, thread, face, hit, origin, direction, t, place)
            ray, outside = (pixel, sample, order, path), add(point, off)
            light_there, more = local_light(scene, thread, role, hit, point, normal, direction, outside, place, ray)
            colour = select_three(hit, light_there, colour)
            feelers += more
            cosine = dot(direction, normal)
            if ATTENUATION or (REFLECTION and order < depth):
                around = sides(scene, role, hit, cosine > 0.0, members)
                onward = attenuated(scene, weight, around[0], t, hit)
                weight = select_weight(hit, onward, weight)
                if REFLECTION and order < depth:
                    of_ray, of_hit = (direction, place, pixel, path), (point, normal, off, role, cosine)
                    first = waiting[order + 1]
                    back, through = leave(
                        scene, thread, rays, places, order + 1, first, hit, of_ray, weight, sample, of_hit, around
                    )
                    waiting[order + 1] += back + through
                    reflected, transmitted = reflected + back, transmitted + through
        if order == 0:
            for c in range(3):
                before = load(light, c, k) if SPOILS else spread(0.0)
                store(light, c, k, fma(of_channel(weight, c), colour[c], before))
        else:
            add_light(light, place, active, weight, colour)
    return reflected, transmitted, feelers


@called
def trace_points(scene, thread, width, height, depth, tile, seen, count):
    """Trace the first `count` of scene.points, into scene.light; their counts, as those of render_tiles."""
    reflected, transmitted, feelers = follow(scene, thread, width, height, depth, tile, seen, count, 0)
    light, broken = scene.light[thread], 0
    for k in range(count):
        broken += (light[0, k] - light[0, k]) + (light[1, k] - light[1, k]) + (light[2, k] - light[2, k]) != 0
    return count, reflected, transmitted, feelers, broken


@kernel
def differ(threshold, lattice, corners):
    """Whether the colours of four points differ by more than the threshold in some channel (SAM-4)."""
    i, j, k, m = corners
    for c in range(3):
        low, high = min(lattice[i, c], lattice[j, c]), max(lattice[i, c], lattice[j, c])
        low, high = min(low, min(lattice[k, c], lattice[m, c])), max(high, max(lattice[k, c], lattice[m, c]))
        if high - low > threshold:
            return True
    return False


@kernel
def corners_of(square, pitch):
    """The places in scene.lattice of a square's corners. square: pixel, a, b, side."""
    top = (square[0] * pitch + square[2]) * pitch + square[1]
    bottom = top + square[3] * pitch
    return top, top + square[3], bottom, bottom + square[3]


@kernel
def ask(scene, thread, square, pitch, asked):
    """Note the points of a square's quarters that its pixel does not have yet, after `asked` others; how many then."""
    half = square[3] >> 1
    known, wanted = scene.lattice_known[thread], scene.wanted[thread]
    for k in range(9):
        at = (square[0] * pitch + square[2] + k // 3 * half) * pitch + square[1] + k % 3 * half
        if not known[at]:
            known[at], wanted[asked] = True, at
            asked += 1
    return asked


@kernel
def refine(scene, thread, width, height, depth, region, tile, seen, picture, counts):
    """Render the pixels of a tile with adaptive samples: the squares of one size of all, then the smaller ones (SAM-4).

    counts: those of the tile, to which what is traced is added.
    """
    real, cells = type(scene.epsilon), 1 << scene.levels
    pitch, columns, x0, y0 = cells + 1, tile[2] - tile[0], region[0], region[1]
    pixels = columns * (tile[3] - tile[1])
    lattice, known, wanted = scene.lattice[thread], scene.lattice_known[thread], scene.wanted[thread]
    squares, means, points, light = (
        scene.squares[thread],
        scene.means[thread],
        scene.points[thread],
        scene.light[thread],
    )
    for at in range(pixels * pitch * pitch):
        known[at] = False
    for n in range(pixels):
        i, j = tile[0] - x0 + n % columns, tile[1] - y0 + n // columns
        squares[n, 0], squares[n, 1], squares[n, 2], squares[n, 3] = n, 0, 0, cells
        for k in range(4):
            at = (n * pitch + (k >> 1) * cells) * pitch + (k & 1) * cells
            known[at] = True
            for c in range(3):
                lattice[at, c] = scene.corners[j + (k >> 1), i + (k & 1), c]
    begin, end, total = 0, pixels, pixels
    while begin < end:
        asked = 0
        for n in range(begin, end):
            square = squares[n, 0], squares[n, 1], squares[n, 2], squares[n, 3]
            squares[n, 4] = -1
            if square[3] > 1 and differ(scene.threshold, lattice, corners_of(square, pitch)):
                asked = ask(scene, thread, square, pitch, asked)
                squares[n, 4] = total
                half = square[3] >> 1
                for k in range(4):
                    squares[total, 0], squares[total, 3] = square[0], half
                    squares[total, 1], squares[total, 2] = square[1] + (k & 1) * half, square[2] + (k >> 1) * half
                    total += 1
        for first in range(0, asked, SIDE * SIDE):
            count = min(asked - first, SIDE * SIDE)
            for k in range(count):
                at = wanted[first + k]
                n, b, a = at // (pitch * pitch), at // pitch % pitch, at % pitch
                points[0, k] = (tile[0] + n % columns) * cells + a
                points[1, k] = (tile[1] + n // columns) * cells + b
            add_counts(counts, trace_points(scene, thread, width, height, depth, tile, seen, count))
            for k in range(count):
                for c in range(3):
                    lattice[wanted[first + k], c] = light[c, k]
        begin, end = end, total
    for n in range(total - 1, -1, -1):
        i, j, k, m = corners_of((squares[n, 0], squares[n, 1], squares[n, 2], squares[n, 3]), pitch)
        quarters = squares[n, 4]
        for c in range(3):
            top, bottom = lattice[i, c] + lattice[j, c], lattice[k, c] + lattice[m, c]
            if quarters >= 0:
                top = means[quarters, c] + means[quarters + 1, c]
                bottom = means[quarters + 2, c] + means[quarters + 3, c]
            means[n, c] = (top + bottom) * real(0.25)
    for n in range(pixels):
        i, j = tile[0] - x0 + n % columns, tile[1] - y0 + n // columns
        picture[j, i, 0], picture[j, i, 1], picture[j, i, 2] = means[n, 0], means[n, 1], means[n, 2]


@kernel
def trace_corners(scene, thread, width, height, depth, region, tile, seen, counts):
    """Trace the corners of pixels at the places of a tile, into scene.corners (SAM-5)."""
    columns, points, light = tile[2] - tile[0], scene.points[thread], scene.light[thread]
    count = columns * (tile[3] - tile[1])
    for k in range(count):
        points[0, k] = (tile[0] + k % columns) << scene.levels
        points[1, k] = (tile[1] + k // columns) << scene.levels
    add_counts(counts, trace_points(scene, thread, width, height, depth, tile, seen, count))
    for k in range(count):
        for c in range(3):
            scene.corners[tile[1] - region[1] + k // columns, tile[0] - region[0] + k % columns, c] = light[c, k]


@kernel
def add_counts(counts, more):
    for k in range(5):
        counts[k] += more[k]


@njit(**ENTRY)
def render_tiles(scene, width, height, region, depth, corners, first, step, picture, counts):
    """Every `step`-th tile of the region from its tile `first` on (CAM-5); or of the corners of its pixels (SAM-5).

    `first` is the thread too: it says which work memory is its own.
    picture: (y1 - y0, x1 - x0, 3), linear RGB. counts: int64 (tiles, 5), of each tile: primary, reflected,
    transmitted, shadow, non-finite (CNT-1, CNT-2).
    """
    x0, y0, x1, y1 = region
    eye, wide, high = row(scene.eye, 0), type(scene.epsilon)(width), type(scene.epsilon)(height)
    more = 1 if ADAPTIVE and corners else 0
    across, down = SIDE, SIDE
    if ADAPTIVE and not corners:
        across, down = scene.work_width, scene.work_height
    x1, y1 = x1 + more, y1 + more
    tiles_across = -(-(x1 - x0) // across)
    samples = scene.samples if SUPERSAMPLING else 1
    for number in range(first, min(len(counts), tiles_across * -(-(y1 - y0) // down)), step):
        left, top = x0 + number % tiles_across * across, y0 + number // tiles_across * down
        right, bottom = left + across, top + down
        tile = left, top, right if right < x1 else x1, bottom if bottom < y1 else y1
        seen = 0, 0
        if not LENS:
            seen = see(scene, first, wide, high, tile, eye)
        if ADAPTIVE:
            if corners:
                trace_corners(scene, first, width, height, depth, region, tile, seen, counts[number])
            else:
                refine(scene, first, width, height, depth, region, tile, seen, picture, counts[number])
            continue
        for sample in range(samples):
            reflected, transmitted, feelers = follow(
                scene, first, width, height, depth, tile, seen, SIDE * SIDE, sample
            )
            broken = deliver(scene, first, scene.light[first], tile, x0, y0, sample, samples, picture)
            primary = (tile[2] - left) * (tile[3] - top)
            add_counts(counts[number], (primary, reflected, transmitted, feelers, broken))


@njit(**ENTRY, parallel=True)
def render_tiles_parallel(scene, width, height, region, depth, corners, first, step, picture, counts):
    """render_tiles for `first` and the `step` - 1 after it, each on a thread."""
    for k in prange(step):
        render_tiles(scene, width, height, region, depth, corners, first + k, step, picture, counts)
