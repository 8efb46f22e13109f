"""The samplers: where a pixel is sampled (CAM-4, SAM-1 to SAM-7).

Each sampler is a generator of the region's pixels in C order. `look(x, y, pixel, sample)` is the colour at the place
(x, y), in pixels from the picture's top left, with the numbers of RND-3. region: x0, y0, x1, y1.
"""

import math

from ..vector import add


def one(look, job, number, _random, region):
    """One sample (CAM-4)."""
    sx, sy = map(number.real, job.sample)
    x0, y0, x1, y1 = region
    for j in range(y0, y1):
        y, row = j + sy, j * job.width
        for i in range(x0, x1):
            yield look(i + sx, y, row + i, 0)


def grid(look, job, number, random, region):
    """n × n samples, each in the middle of its square or anywhere in it (SAM-1 to SAM-3)."""
    n, jittered = job.samples, job.sampler == "jittered"
    half = number.real(0.5)
    shift_x, shift_y = (number.real(place) - half for place in job.sample)
    x0, y0, x1, y1 = region
    for j in range(y0, y1):
        for i in range(x0, x1):
            pixel = j * job.width + i
            pixel_sum = 0, 0, 0
            for b in range(n):
                row = 0, 0, 0
                for a in range(n):
                    s = b * n + a
                    u, v = random.place(pixel, s) if jittered else (half, half)
                    row = add(row, look(i + ((a + u) / n + shift_x), j + ((b + v) / n + shift_y), pixel, s))
                pixel_sum = add(pixel_sum, row)
            yield tuple(channel / (n * n) for channel in pixel_sum)


def adaptive(look, job, number, _random, region):
    """Squares that are quartered while their corners differ (SAM-4, SAM-5)."""
    x0, y0, x1, y1 = region
    side = 2**job.adaptive_depth
    across = side * job.width + 1
    threshold = number.real(job.adaptive_threshold)
    shift_x, shift_y = (number.real(place) - number.real(0.5) for place in job.sample)

    def point(a, b):
        return look(number.real(a) / side + shift_x, number.real(b) / side + shift_y, b * across + a, 0)

    def square(a, b, size, known):
        """The mean colour of the square from lattice point (a, b) on. `known` are the points that its pixel has."""
        corners = []
        for place in ((a, b), (a + size, b), (a, b + size), (a + size, b + size)):
            if place not in known:
                known[place] = point(*place)
            corners.append(known[place])
        if size > 1 and any(max(channel) - min(channel) > threshold for channel in zip(*corners, strict=True)):
            half = size // 2
            corners = [
                square(x, y, half, known) for x, y in ((a, b), (a + half, b), (a, b + half), (a + half, b + half))
            ]
        one, two, three, four = corners
        return tuple(x / 4 for x in add(add(one, two), add(three, four)))

    above = {(i * side, y0 * side): point(i * side, y0 * side) for i in range(x0, x1 + 1)}
    for j in range(y0, y1):
        below = {(i * side, (j + 1) * side): point(i * side, (j + 1) * side) for i in range(x0, x1 + 1)}
        corners = above | below
        for i in range(x0, x1):
            places = [(k * side, m * side) for m in (j, j + 1) for k in (i, i + 1)]
            yield square(i * side, j * side, side, {place: corners[place] for place in places})
        above = below


def sobol(look, job, number, random, region):
    """The points of a sequence (SAM-7)."""
    row_length = math.isqrt(job.spp - 1) + 1
    shift_x, shift_y = (number.real(place) - number.real(0.5) for place in job.sample)
    x0, y0, x1, y1 = region
    for j in range(y0, y1):
        for i in range(x0, x1):
            pixel = j * job.width + i
            pixel_sum = 0, 0, 0
            for first in range(0, job.spp, row_length):
                row = 0, 0, 0
                for s in range(first, min(first + row_length, job.spp)):
                    u, v = random.place(pixel, s)
                    row = add(row, look(i + (u + shift_x), j + (v + shift_y), pixel, s))
                pixel_sum = add(pixel_sum, row)
            yield tuple(channel / job.spp for channel in pixel_sum)


SAMPLERS = {"one": one, "uniform": grid, "jittered": grid, "adaptive": adaptive, "sobol": sobol}
