"""Samples of pixels, and pictures of them (CAM-2, SAM-1 to SAM-7)."""

import numpy as np

from .random import Streams
from .trace import Counts, trace, wave_size

SQUARES = 1 << 16  # of adaptive sampling at once: bounds the memory


def render(scene, camera, job):
    """One frame: the picture (rows, columns, 3) of the job's region, the counts, and where rays are cut off the dropped
    weights (rows, columns), else None.
    """
    x0, y0, x1, y1 = job.region
    counts = Counts()
    picture = (adaptive if job.sampler == "adaptive" else even)(scene, camera, job, counts)
    rows, columns = y1 - y0, x1 - x0
    dropped = picture[3].reshape(rows, columns) if scene.cuts else None
    return np.ascontiguousarray(picture[:3].T).reshape(rows, columns, 3), counts, dropped


def even(scene, camera, job, counts):
    """The picture (3, pixels) of as many samples in each pixel (SAM-3); (4, pixels) with dropped weights (CUT-2)."""
    grid = Grid(scene, camera, job)
    channels = 4 if scene.cuts else 3
    # Sums are in float64: the rows of SAM-3 would take n times the memory of the picture.
    picture = np.zeros((channels, grid.pixels), scene.precision if grid.each == 1 else np.float64)
    size = wave_size(scene)
    for first in range(0, grid.pixels * grid.each, size):
        end = min(first + size, grid.pixels * grid.each)
        if grid.each == 1:
            trace(scene, grid, first, picture[:, first:end], counts)
            continue
        light = np.empty((channels, end - first), scene.precision)
        trace(scene, grid, first, light, counts)
        for total, values in zip(picture, light, strict=True):
            np.add.at(total, np.arange(first, end) // grid.each, values)  # one after the other, in this order
    return (picture / grid.each).astype(scene.precision)


class Grid:
    """The samples of all samplers but adaptive, numbered pixel by pixel and row by row in the region."""

    def __init__(self, scene, camera, job):
        self.scene, self.camera = scene, camera
        self.x0, self.y0, x1, y1 = job.region
        self.columns, self.width = x1 - self.x0, job.width
        self.pixels = self.columns * (y1 - self.y0)
        self.drawn = job.sampler in ("jittered", "sobol")
        self.n = job.samples if job.sampler in ("uniform", "jittered") else 1  # cells of a pixel's side
        self.each = job.spp if job.sampler == "sobol" else self.n * self.n
        b, a = np.divmod(np.arange(self.each) % (self.n * self.n), self.n)
        self.corner_x, self.corner_y = a.astype(scene.precision), b.astype(scene.precision)
        moved = np.array([job.sample]).T - 0.5  # SAM-6
        if job.sampler == "one":
            places = moved + 0.5
        elif self.drawn:
            places = np.repeat(moved, self.each, axis=1)
        else:
            places = (np.stack([a, b]) + 0.5) / self.n + moved
        self.shift_x, self.shift_y = places.astype(scene.precision)

    def rays(self, numbers):
        """Eye rays of the samples `numbers` (N,): origins and directions."""
        pixels, s = np.divmod(numbers, self.each) if self.each > 1 else (numbers, [0])
        row, column = np.divmod(pixels, self.columns)
        x, y = (self.x0 + column).astype(self.shift_x.dtype), (self.y0 + row).astype(self.shift_x.dtype)
        if not self.drawn:
            return self.camera.rays(x + self.shift_x[s], y + self.shift_y[s], lambda: self._draw(numbers))
        u = self._draw(numbers)
        x += (self.corner_x[s] + u[0]) / self.n + self.shift_x[s]
        y += (self.corner_y[s] + u[1]) / self.n + self.shift_y[s]
        return self.camera.rays(x, y, lambda: u)

    def words(self, numbers):
        """Pixel and sample of the random numbers (RND-3)."""
        pixels, s = np.divmod(numbers, self.each)
        row, column = np.divmod(pixels, self.columns)
        return (self.y0 + row) * self.width + self.x0 + column, s

    def _draw(self, numbers):
        return Streams(self.scene, 0, *self.words(numbers), [0]).own()


def adaptive(scene, camera, job, counts):
    """The picture (3, pixels) where pixels are divided as long as their corners differ (SAM-4, SAM-5)."""
    lattice = Lattice(scene, camera, job, counts)
    x0, y0, x1, y1 = job.region
    rows, columns = y1 - y0, x1 - x0
    row, column = np.divmod(np.arange((rows + 1) * (columns + 1)), columns + 1)
    shared = lattice.trace((x0 + column) * lattice.steps, (y0 + row) * lattice.steps)
    picture = np.empty((3, rows * columns), scene.precision)
    for first in range(0, rows * columns, SQUARES):
        pixels = np.arange(first, min(first + SQUARES, rows * columns))
        top = pixels + pixels // columns  # its left corner, as a column of `shared`
        corners = shared[:, np.stack([top, top + 1, top + columns + 1, top + columns + 2])]
        picture[:, pixels] = lattice.squares(0, pixels, np.zeros((2, len(pixels)), int), corners)
    return picture


class Lattice:
    """The points (a, b) of adaptive sampling; `steps` of them to a pixel."""

    def __init__(self, scene, camera, job, counts):
        self.scene, self.camera, self.counts = scene, camera, counts
        self.depth, self.steps = job.adaptive_depth, 2**job.adaptive_depth
        self.threshold = job.adaptive_threshold
        self.x0, self.y0, x1, _ = job.region
        self.columns = x1 - self.x0
        self.points_across = self.steps * job.width + 1
        self.shift_x, self.shift_y = (place - 0.5 for place in job.sample)

    def trace(self, a, b):
        """Colours (3, N) of the points."""
        light = np.empty((3, len(a)), self.scene.precision)
        points = Points(self, a, b)
        size = wave_size(self.scene)
        for first in range(0, len(a), size):
            trace(self.scene, points, first, light[:, first : first + size], self.counts)
        return light

    def squares(self, level, pixels, places, corners):
        """Colours (3, n) of squares with these corners (3, 4, n), at `places` (2, n) in the pixels, in their order."""
        colours = mean_of_four(corners)
        if level == self.depth:
            return colours
        differ = (corners.max(axis=1) - corners.min(axis=1)).max(axis=0) > self.threshold
        squares = np.flatnonzero(differ)
        while len(squares):
            now = squares
            if 4 * len(squares) > SQUARES:  # as many pixels as fit, at least one: pixels share no points
                fit = pixels[squares] < max(pixels[squares[SQUARES // 4]], pixels[squares[0]] + 1)
                now = squares[fit]
            squares = squares[len(now) :]
            colours[:, now] = self._divided(level, pixels[now], places[:, now], corners[:, :, now])
        return colours

    def _divided(self, level, pixels, places, corners):
        """Colours of squares as the means of their quarters."""
        half = self.steps >> (level + 1)
        added = np.array([(1, 0), (0, 1), (1, 1), (2, 1), (1, 2)]).T * half  # top, left, centre, right, bottom
        a, b = places[:, np.newaxis] + added[:, :, np.newaxis]
        side = self.steps + 1
        points, which = np.unique((pixels * side + b) * side + a, return_inverse=True)
        pixel, a = np.divmod(points, side)
        pixel, b = np.divmod(pixel, side)
        row, column = np.divmod(pixel, self.columns)
        new = self.trace((self.x0 + column) * self.steps + a, (self.y0 + row) * self.steps + b)
        top, left, centre, right, bottom = new[:, which.reshape(5, -1)].transpose(1, 0, 2)
        c1, c2, c3, c4 = corners.transpose(1, 0, 2)
        quarters = (
            (c1, top, left, centre),
            (top, c2, centre, right),
            (left, centre, c3, bottom),
            (centre, right, bottom, c4),
        )
        corners = np.stack([np.stack(quarter, axis=1) for quarter in quarters], axis=-1).reshape(3, 4, -1)
        places = places[:, :, np.newaxis] + np.array([(0, 0), (1, 0), (0, 1), (1, 1)]).T[:, np.newaxis] * half
        colours = self.squares(level + 1, np.repeat(pixels, 4), places.reshape(2, -1), corners)
        return mean_of_four(colours.reshape(3, -1, 4).transpose(0, 2, 1))


def mean_of_four(colours):
    """The mean (3, n) of colours (3, 4, n) (SAM-4)."""
    c1, c2, c3, c4 = colours.transpose(1, 0, 2)
    return ((c1 + c2) + (c3 + c4)) / 4


class Points:
    """Points of a lattice as samples."""

    def __init__(self, lattice, a, b):
        self.lattice, self.a, self.b = lattice, a, b

    def rays(self, numbers):
        lattice, scene = self.lattice, self.lattice.scene
        x, y = (v[numbers].astype(scene.precision) / lattice.steps for v in (self.a, self.b))
        draw = lambda: Streams(scene, 0, *self.words(numbers), [0]).own()  # noqa: E731
        return lattice.camera.rays(x + lattice.shift_x, y + lattice.shift_y, draw)

    def words(self, numbers):
        """Pixel and sample of the random numbers (RND-3)."""
        return self.b[numbers] * self.lattice.points_across + self.a[numbers], [0]
