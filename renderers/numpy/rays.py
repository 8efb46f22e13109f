"""Rays of a wavefront, and those that leave the surfaces they hit (REF-4, MED-5, GLO-1, RND-4)."""

from typing import Any, NamedTuple

import numpy as np

from .random import child_path
from .shade import fresnel, gloss, reflect, transmit


class Rays(NamedTuple):
    """Rays that each add `weights` times their colour to one sample."""

    origins: Any  # (3, N), or (3, 1) for eye rays
    directions: Any  # (3, N)
    weights: Any  # (N,), or (3, N) if media attenuate
    targets: Any  # (N,) numbers of the samples
    sets: Any = None  # (N,) sets of solids that they are in, if any has a rank (MED-2)
    paths: Any = None  # (N,), if random numbers are drawn on the way (RND-4)

    @property
    def count(self):
        return len(self.targets)

    def take(self, rays):
        origins, *others = self
        if self.count == 1 or origins.shape[1] > 1:
            origins = origins.take(rays, axis=1)
        return Rays(origins, *(array if array is None else array.take(rays, axis=-1) for array in others))

    def part(self, begin, end):
        return Rays(*(array if array is None else array[..., begin:end] for array in self))


def join(parts):
    """The rays of all `parts`, in this order."""
    if len(parts) == 1:
        return parts[0]
    return Rays(*(None if arrays[0] is None else np.concatenate(arrays, -1) for arrays in zip(*parts, strict=True)))


class Queue:
    """A queue of rays, first in, first out."""

    def __init__(self):
        self.parts, self.length = [], 0

    def __len__(self):
        return self.length

    def put(self, rays):
        self.parts.append(rays)
        self.length += rays.count

    def get(self, most):
        """The first rays, `most` of them or all that there are."""
        count = total = 0
        while count < len(self.parts) and total < most:
            total += self.parts[count].count
            count += 1
        rays, self.parts = join(self.parts[:count]), self.parts[count:]
        if total > most:
            self.parts.insert(0, rays.part(most, total))
            rays = rays.part(0, most)
        self.length -= rays.count
        return rays


class Surfaces(NamedTuple):
    """Where rays have hit."""

    points: Any  # (3, N)
    normals: Any
    offsets: Any  # (3, N) off the surface, to the side of the normal
    d_dot_n: Any  # (N,)
    shapes: Any
    media: Any  # i, t and the sets of solids in front and beyond (MED-3)


def leaving(scene, rays, surfaces, streams, layer, counts):
    """The rays that leave `surfaces`, hit by `rays`: each ray's follow each other, the transmitted one last (REF-4).

    The weights of reflected and of transmitted rays that are cut off are added to the two arrays of `layer` (CUT-2).
    """
    points, normals, offsets, d_dot_n, shapes, (i, t, here, beyond) = surfaces
    n, s, r, matched = fresnel(scene, i, t, d_dot_n)
    k_s, inward = scene.k_s[shapes], d_dot_n <= 0
    shares = k_s * r
    starts = points + np.where(inward, offsets, -offsets)
    mirrored = reflect(rays.directions, normals, d_dot_n)
    reflected = Rays(starts, mirrored, rays.weights, rays.targets, here, rays.paths)
    if scene.glossy_rays:
        alive, reflected = glossy(scene, reflected, shares, normals, shapes, streams, layer[0])
    else:
        alive = traced(scene, rays, shares, layer[0])
        reflected = reflected.take(alive)
        reflected = reflected._replace(weights=reflected.weights * shares[alive], paths=child(scene, reflected, 0))
    counts.reflected += len(alive)
    if not scene.transmits:
        return reflected

    shares = k_s * (1 - r)
    through = traced(scene, rays, np.where(scene.clear[shapes], shares, 0), layer[1])
    starts = points - np.where(inward, offsets, -offsets)
    straight = matched | scene.flat[shapes]
    refracted = np.where(straight, rays.directions, transmit(rays.directions, normals, d_dot_n, n, s))
    transmitted = Rays(starts, refracted, rays.weights * shares, rays.targets, beyond, rays.paths).take(through)
    transmitted = transmitted._replace(paths=child(scene, transmitted, scene.branches - 1))
    counts.transmitted += len(through)
    order = np.argsort(np.concatenate([alive, through]), kind="stable")
    return join([reflected, transmitted]).take(order)


def traced(scene, rays, shares, light):
    """Numbers of `rays` that send one on: whose share of it is not 0 (REF-4), and that is not cut off (CUT-1)."""
    if not scene.cuts:
        return np.flatnonzero(shares != 0)
    weights = shares * (rays.weights if rays.weights.ndim == 1 else rays.weights.max(axis=0))
    cut = weights <= scene.cutoff
    np.add.at(light[3], rays.targets[cut], weights[cut])  # adds 0 where the share is 0
    return np.flatnonzero((shares != 0) & ~cut)


def glossy(scene, mirrored, shares, normals, shapes, streams, light):
    """Numbers of the hits that rays leave, and glossy rays in place of the mirrored ones of rough materials (GLO-1)."""
    alive = np.flatnonzero(shares != 0)
    children = np.where(scene.rough[shapes[alive]], scene.glossy_rays, 1)
    parents = np.repeat(alive, children)
    numbers = np.arange(len(parents)) - np.repeat(np.cumsum(children) - children, children)
    rays, shares = mirrored.take(parents), shares[parents]
    lobes = np.flatnonzero(scene.rough[shapes[parents]])
    of = parents[lobes]
    ways, falloff = gloss(
        rays.directions[:, lobes], normals[:, of], scene.lobe[shapes[of]], streams.take(of), numbers[lobes]
    )
    directions = rays.directions.copy()
    directions[:, lobes] = ways
    if scene.glossy_study:
        shares[lobes] *= falloff
    shares[lobes] /= scene.glossy_rays
    some = traced(scene, rays, shares, light)
    rays = rays._replace(directions=directions, weights=rays.weights * shares, paths=child(scene, rays, numbers))
    return parents[some], rays.take(some)


def child(scene, rays, number):
    """Paths of the children `number` of the paths of `rays`, if any."""
    return None if rays.paths is None else child_path(rays.paths, number, scene.branches)
