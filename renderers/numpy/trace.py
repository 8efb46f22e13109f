"""The wavefront: computes the colours of samples (REF-4 to REF-6)."""

import numpy as np

from .contact import Places, onward
from .random import Streams
from .rays import Queue, Rays, Surfaces, join, leaving
from .shade import local, offsets
from .vector import dot, normalise, of_rays

CHUNK = 1 << 14  # rays at once: their arrays stay in the processor's cache
CHILDREN = 1 << 17  # rays that may leave the surfaces of one chunk: bounds the memory
WAVE = 1 << 18  # samples at once: bounds the memory of a large picture


class Counts:
    """Rays traced in one frame (CNT-1), and samples that are not finite (CNT-2)."""

    def __init__(self):
        self.primary = self.reflected = self.transmitted = self.shadow = self.non_finite = 0


def wave_size(scene):
    return WAVE if scene.chain else max(1, WAVE // (2 * scene.depth + 2))


def trace(scene, samples, first, light, counts):
    """Set `light` (3, n) to the colours of n samples, from number `first` on.

    Where rays are cut off it is (4, n), and its last row becomes the dropped weights (CUT-2).
    The rays of each order wait in a queue. Whenever the deepest full chunk is next, no queue is ever longer than a
    chunk and its children. A sample's rays of one order are added up apart, in the order of the queue, so that how
    they fell into chunks changes nothing; without branches there is one of each, and no need to.
    """
    layers = [[light, light]] * (scene.depth + 1)  # of each order: what missed, what hit
    if not scene.chain:
        layers = [[np.zeros_like(light), np.zeros_like(light)] for _ in layers]
    light[:] = 0
    sizes = [max(1, min(CHUNK, CHILDREN // scene.branches))] * scene.depth + [CHUNK]
    queues = [Queue() for _ in layers]
    eye = eye_rays(scene, samples, first, light.shape[1], sizes[0])
    counts.primary += light.shape[1]
    while True:
        order = next((order for order in range(scene.depth, 0, -1) if len(queues[order]) >= sizes[order]), 0)
        rays = queues[order].get(sizes[order]) if order else next(eye, None)
        if rays is None:
            order = next((order for order, queue in enumerate(queues) if len(queue)), None)
            if order is None:
                break
            rays = queues[order].get(sizes[order])
        children = see(scene, rays, samples, first, layers[order], order, counts)
        if children is not None and children.count:
            queues[order + 1].put(children)
    if not scene.chain:
        for layer in layers:
            light += layer[0]
            light += layer[1]
    counts.non_finite += light.shape[1] - np.count_nonzero(np.isfinite(light[:3]).all(axis=0))


def eye_rays(scene, samples, first, count, size):
    """Chunks of the rays of `count` samples."""
    for begin in range(0, count, size):
        targets = np.arange(begin, min(begin + size, count))
        origins, directions = samples.rays(first + targets)
        sets = np.full(len(targets), scene.media.eye) if scene.media.any or scene.contact else None
        paths = np.zeros(len(targets), np.uint64) if scene.draws else None
        yield Rays(origins, directions, np.ones(len(targets), scene.precision), targets, sets, paths)


def see(scene, rays, samples, first, layer, order, counts, dimmed=None):
    """Add what the rays see to the two arrays of `layer`; unless their order is the last, return the rays that leave.

    dimmed: what is left of the light of hits on the way so far, by ray (MED-8).
    """
    last = order == scene.depth
    t, shapes = scene.nearest(rays.origins, rays.directions)
    missed, hit = np.flatnonzero(shapes < 0), np.flatnonzero(shapes >= 0)
    add(layer[0][:3], rays.targets[missed], rays.weights.take(missed, axis=-1) * scene.background)

    t, shapes = t[hit], shapes[hit]
    rays = rays.take(hit)
    if dimmed is not None:
        dimmed = dimmed.take(hit, axis=-1)
    points, normals, sizes = scene.surface(shapes, rays.origins, rays.directions, t)
    d_dot_n = dot(rays.directions, normals)
    media = streams = outside = passed = None
    if scene.contact:
        places = scene.contact.meet(rays.sets, rays.directions, points, normals, sizes, shapes)
        go_on = np.flatnonzero(places.none)
        if go_on.size:
            passed = passing(scene, rays, places, t, go_on, dimmed)
            stop = np.flatnonzero(~places.none)
            rays, t, shapes = rays.take(stop), t[stop], shapes[stop]
            dimmed = dimmed if dimmed is None else dimmed.take(stop, axis=-1)
            places = Places(*(_some(array, stop) for array in places))
        points, normals, sizes, shapes, d_dot_n, media, _ = places
        outside = np.where(d_dot_n <= 0, media[2], media[3])
    off = offsets(scene, points, normals, sizes)
    if media is None and (scene.attenuates or not last):
        media = scene.media.sides(rays.sets, shapes, d_dot_n <= 0)
    if scene.attenuates:
        rays = rays._replace(weights=rays.weights * scene.attenuation.take(media[0], axis=1) ** t)
    if dimmed is not None:
        rays = rays._replace(weights=rays.weights * dimmed)
    if scene.draws:
        streams = Streams(scene, order, *samples.words(first + rays.targets), rays.paths)
    colours, feelers = local(scene, rays.directions, points, points + off, normals, d_dot_n, shapes, streams, outside)
    add(layer[1][:3], rays.targets, rays.weights * colours)
    counts.shadow += feelers
    children = None
    if not last:
        children = leaving(scene, rays, Surfaces(points, normals, off, d_dot_n, shapes, media), streams, layer, counts)
    if passed is not None:
        more = see(scene, passed[0], samples, first, layer, order, counts, passed[1])
        children = children if more is None else join([children, more])
    return children


def passing(scene, rays, places, t, go_on, dimmed):
    """The rays `go_on` beyond what is no surface, of the same order, and what is left of the light there (MED-8)."""
    if scene.attenuates:
        factors = scene.attenuation.take(places.media[0][go_on], axis=1) ** t[go_on]
        dimmed = factors if dimmed is None else factors * dimmed.take(go_on, axis=-1)
    origins = onward(scene, places).take(go_on, axis=1)
    return rays.take(go_on)._replace(origins=origins, sets=places.media[3][go_on]), dimmed


def _some(array, rays):
    """Entries `rays` of an array (.., N), or of each in a tuple."""
    return tuple(_some(each, rays) for each in array) if isinstance(array, tuple) else array.take(rays, axis=-1)


def add(light, targets, colours):
    """Add colours (3, N), one after the other, to those of their targets, of which there may be several alike."""
    for total, values in zip(light, colours, strict=True):
        np.add.at(total, targets, values)


def unit(directions):
    """Directions of rays given; where they have unit length to rounding they keep their bits (NUM-4)."""
    near = np.abs(dot(directions, directions) - 1) <= 4 * np.finfo(directions.dtype).eps / 2
    return np.where(near, directions, normalise(directions))


def first_hits(scene, rays):
    """One frame of kind `rays`: rows (t, point, normal, object) in float64 for rays (6, N), origin and direction."""
    answer = np.zeros((rays.shape[1], 8))
    answer[:, 0], answer[:, 7] = np.inf, -1
    for begin in range(0, len(answer), CHUNK):
        rows = answer[begin : begin + CHUNK]
        origins, directions = np.split(rays[:, begin : begin + CHUNK], 2)
        directions = unit(directions)
        t, shapes = scene.nearest(origins, directions)
        hit = np.flatnonzero(shapes >= 0)
        t, shapes = t[hit], shapes[hit]
        points, normals, _ = scene.surface(shapes, of_rays(origins, hit), directions[:, hit], t)
        rows[hit] = np.vstack([t, points, normals, scene.objects[shapes]]).T
    return answer
