"""Samples of a pixel: one, a grid or lattice of them, or an adaptive number (SAM)."""

import math

from .camera import eye_ray
from .needs import (
    ADAPTIVE,
    ASK_NUMBERS,
    ASK_SAMPLER,
    CSG,
    CUTOFF,
    JITTERED,
    LENS,
    LIMITED,
    MEDIA,
    SOBOL,
    SUPERSAMPLING,
)
from .random import draw_own
from .target import inlined, kernel
from .trace.trace import finite
from .trace.walk import walk
from .vector import add, scale

# A sample, or a pixel, is linear RGB, the weight that was cut off (CUT-2; 0 without a cut-off) and counts: a tuple of
# primary, reflected, transmitted, shadow, non-finite (CNT-1, CNT-2).


@kernel
def add_counts(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4]


@kernel
def take(scene, thread, width, height, x, y, place, u, depth):
    """The sample at (x, y), in pixels from the top left. u: numbers for the lens."""
    origin, direction = eye_ray(scene, width, height, x, y, u)
    members = scene.eye_media if MEDIA else 0
    ray = origin, direction, members, 0
    colour, dropped, reflected, transmitted, feelers = walk(scene, thread, place, ray, depth)
    if CSG and LIMITED and scene.csg_overflow[thread, 0] != 0:  # CSG-6
        scene.csg_overflow[thread, 0] = 0
        nan = type(x)(math.nan)
        colour = nan, nan, nan
    return colour, dropped, (1, reflected, transmitted, feelers, 0 if finite(scene, colour) else 1)


@kernel
def numbers(scene, place):
    """The sample's own random numbers, if it needs any."""
    if (LENS or JITTERED) and (not ASK_NUMBERS or scene.numbered):
        return draw_own(scene, place)
    zero = type(scene.epsilon)(0)
    return zero, zero, zero, zero


@kernel
def one_sample(scene, thread, width, height, region, i, j, depth):
    """CAM-4."""
    real = type(scene.epsilon)
    place = j * width + i, 0
    x, y = real(i) + scene.sample[0], real(j) + scene.sample[1]
    return take(scene, thread, width, height, x, y, place, numbers(scene, place), depth)


@kernel
def grid(scene, thread, width, height, region, i, j, depth):
    """The mean of n × n samples, or of those of a sequence (SAM-1 to SAM-3, SAM-7)."""
    real = type(scene.epsilon)
    samples, n, zero, half = scene.samples, scene.row_length, real(0), real(0.5)
    colour, line, dropped, counts = (zero, zero, zero), (zero, zero, zero), zero, (0, 0, 0, 0, 0)
    for s in range(samples):
        place = j * width + i, s
        u = numbers(scene, place)
        a, b = half, half
        if JITTERED and (not ASK_SAMPLER or scene.jittered):
            a, b = u[0], u[1]
        if not SOBOL or (ASK_SAMPLER and not scene.sequenced):
            a, b = (real(s % n) + a) / real(n), (real(s // n) + b) / real(n)
        x, y = real(i) + (a + (scene.sample[0] - half)), real(j) + (b + (scene.sample[1] - half))
        if ASK_SAMPLER and scene.single:  # CAM-4
            x, y = real(i) + scene.sample[0], real(j) + scene.sample[1]
        more, cut, counted = take(scene, thread, width, height, x, y, place, u, depth)
        line, counts = add(line, more), add_counts(counts, counted)
        if s % n == n - 1 or s == samples - 1:
            colour, line = add(colour, line), (zero, zero, zero)
        if CUTOFF:
            dropped += cut
    share = real(samples)
    return (colour[0] / share, colour[1] / share, colour[2] / share), dropped / share, counts


@inlined
def lattice_sample(scene, thread, width, height, a, b, depth):
    """The point (a, b) of the lattice over the picture (SAM-4)."""
    real = type(scene.epsilon)
    cells, half = 1 << scene.levels, real(0.5)
    place = b * (cells * width + 1) + a, 0
    x = real(a) / real(cells) + (scene.sample[0] - half)
    y = real(b) / real(cells) + (scene.sample[1] - half)
    return take(scene, thread, width, height, x, y, place, numbers(scene, place), depth)


@inlined
def lattice_point(scene, thread, width, height, region, i, j, a, b, depth):
    """Colour of point (a, b) of the lattice of pixel (i, j), traced if this pixel did not yet (SAM-5), and its counts.

    lattice (2^D + 1, 2^D + 1, 3) has the colours, and lattice_marks the number of the pixel that they are of.
    """
    cells = 1 << scene.levels
    lattice, marks = scene.lattice, scene.lattice_marks
    counts = 0, 0, 0, 0, 0
    if (a == 0 or a == cells) and (b == 0 or b == cells):
        x, y = i - region[0] + (a >> scene.levels), j - region[1] + (b >> scene.levels)
        return (scene.corners[y, x, 0], scene.corners[y, x, 1], scene.corners[y, x, 2]), counts
    k = b * (cells + 1) + a
    if marks[thread, 1 + k] != marks[thread, 0]:
        marks[thread, 1 + k] = marks[thread, 0]
        colour, _, counts = lattice_sample(scene, thread, width, height, cells * i + a, cells * j + b, depth)
        lattice[thread, k, 0], lattice[thread, k, 1], lattice[thread, k, 2] = colour
    return (lattice[thread, k, 0], lattice[thread, k, 1], lattice[thread, k, 2]), counts


@kernel
def differ(scene, thread, level):
    """Whether the four colours of a level differ by more than the threshold in some channel (SAM-4)."""
    c = scene.quarters
    for k in range(3):
        c1, c2, c3, c4 = c[thread, level, 0, k], c[thread, level, 1, k], c[thread, level, 2, k], c[thread, level, 3, k]
        if max(max(c1, c2), max(c3, c4)) - min(min(c1, c2), min(c3, c4)) > scene.threshold:
            return True
    return False


@kernel
def quarter(scene, thread, level, k):
    """Colour number `k` of a level."""
    quarters = scene.quarters
    return quarters[thread, level, k, 0], quarters[thread, level, k, 1], quarters[thread, level, k, 2]


@kernel
def mean(scene, thread, level):
    """The mean of the four colours of a level."""
    top = add(quarter(scene, thread, level, 0), quarter(scene, thread, level, 1))
    bottom = add(quarter(scene, thread, level, 2), quarter(scene, thread, level, 3))
    return scale(type(scene.epsilon)(0.25), add(top, bottom))


@kernel
def adaptive(scene, thread, width, height, region, i, j, depth):
    """A square of four corners, or of four quarters where these differ (SAM-4), down to the lattice.

    Row `level` of `squares` is the open square of that level: its corner (a, b) and how many of its quarters are done.
    Row `level` of `quarters` has the colours of its corners, and then of its quarters.
    """
    squares, quarters = scene.squares, scene.quarters
    scene.lattice_marks[thread, 0] += 1
    counts = 0, 0, 0, 0, 0
    level, a, b = 0, 0, 0
    while True:
        side = 1 << (scene.levels - level)
        for k in range(4):
            at, bt = a + (k & 1) * side, b + (k >> 1) * side
            colour, more = lattice_point(scene, thread, width, height, region, i, j, at, bt, depth)
            quarters[thread, level, k, 0], quarters[thread, level, k, 1], quarters[thread, level, k, 2] = colour
            counts = add_counts(counts, more)
        if side > 1 and differ(scene, thread, level):
            squares[thread, level, 0], squares[thread, level, 1], squares[thread, level, 2] = a, b, 0
            level += 1
            continue
        colour = mean(scene, thread, level)
        while level > 0:
            done = squares[thread, level - 1, 2]
            for k in range(3):
                quarters[thread, level - 1, done, k] = colour[k]
            done += 1
            squares[thread, level - 1, 2] = done
            if done < 4:
                a = squares[thread, level - 1, 0] + (done & 1) * side
                b = squares[thread, level - 1, 1] + (done >> 1) * side
                break
            level -= 1
            side <<= 1
            colour = mean(scene, thread, level)
        if level == 0:
            return colour, type(scene.epsilon)(0), counts


without_lattice = grid if SUPERSAMPLING else one_sample


@kernel
def adaptive_or_not(scene, thread, width, height, region, i, j, depth):
    if scene.adapted:
        return adaptive(scene, thread, width, height, region, i, j, depth)
    return without_lattice(scene, thread, width, height, region, i, j, depth)


# Pixel (i, j).
pixel = without_lattice
if ADAPTIVE:
    pixel = adaptive_or_not if ASK_SAMPLER else adaptive
