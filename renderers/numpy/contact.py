"""Surfaces in one place, and the media that they part (MED-6 to MED-8)."""

from typing import Any, NamedTuple

import numpy as np

from .shade import shifts
from .shapes.csg import Csg
from .shapes.mesh import Meshes
from .vector import dot, of_rays

GRAZING = 2.0**-10  # least |d·n| that the way back to the start of MED-6 is worked out with


class Places(NamedTuple):
    """Where rays end: what is there of all the surfaces that each crosses there (MED-7)."""

    points: Any  # (3, N)
    normals: Any
    sizes: Any  # (N,)
    shapes: Any
    d_dot_n: Any
    media: Any  # i, t and the sets of solids in front and beyond
    none: Any  # (N,) whether there is no surface (MED-8)


class Contact:
    """The surfaces of a scene, to be asked which of them are in one place. precedence: of precedence.npy."""

    def __init__(self, scene, precedence):
        self.scene = scene
        self.numbers = precedence[scene.objects]
        self.extents = np.concatenate([extents(kind) for _, kind in scene.kinds])
        optics = np.vstack([scene.refractive_index, scene.mu, scene.attenuation])
        self.medium = np.unique(optics, axis=1, return_inverse=True)[1].ravel()  # equal of equal media

    def reach(self, distances, light):
        """How far what stops feelers to a light (3, ..) may be: less far than what the light lies on (LOC-2)."""
        if self.scene.offset in ("fixed", "none"):
            return distances - 512 * (self.scene.epsilon if self.scene.offset == "fixed" else 0)
        return distances - 512 * self.scene.epsilon * (self.extents.max() + np.abs(light).max(axis=0))

    def meet(self, sets, directions, points, normals, sizes, shapes):
        """The Places where rays in the `sets` hit `shapes` at `points`."""
        media = self.scene.media
        points, normals, sizes, tops = points.copy(), normals.copy(), sizes.copy(), shapes.copy()
        hit = points.copy(), normals.copy(), sizes.copy()
        slopes = dot(directions, normals)
        inward, slopes = slopes <= 0, np.abs(slopes)
        changes = np.where(inward, media.bits[shapes], 0), np.where(inward, 0, media.bits[shapes])
        for first, kind in self.scene.kinds:
            for others, rays, t, starts, backs in self._crossings(first, kind, directions, slopes, *hit):
                d = directions.take(rays, axis=1)
                here, across, extents_there = kind.surface(others - first, starts, d, t)
                slope = dot(d, across)
                reach = shifts(
                    self.scene, *(a.take(rays, axis=-1) for a in hit[:2]), np.maximum(hit[2][rays], extents_there)
                )
                near = np.abs(t - backs) * np.maximum(slopes[rays], np.abs(slope)) <= reach
                near &= self.scene.objects[others] != self.scene.objects[shapes[rays]]
                others, rays, slope = others[near], rays[near], slope[near]
                np.maximum.at(sizes, rays, extents_there[near])
                bits = media.bits[others]
                np.bitwise_or.at(changes[0], rays, np.where(slope <= 0, bits, 0))
                np.bitwise_or.at(changes[1], rays, np.where(slope <= 0, 0, bits))
                over = np.flatnonzero(self.numbers[others] > self.numbers[tops[rays]])[::-1]
                over = over[np.argsort(self.numbers[others[over]], kind="stable")]  # what is written last stays
                at = rays[over]
                tops[at] = others[over]
                points[:, at], normals[:, at] = here[:, near][:, over], across[:, near][:, over]
        return self._places(sets, directions, changes, points, normals, sizes, tops)

    def lets_by(self, starts, directions, distances, sets):
        """Whether feelers in the `sets`, not empty, pass through all that they meet (MED-8)."""
        scene = self.scene
        free, left = np.zeros(len(distances), bool), np.arange(len(distances))
        while len(left):
            t, shapes = scene.nearest(starts, directions)
            met = t < distances
            free[left[~met]] = True
            left, t, shapes, distances, sets = (a[met] for a in (left, t, shapes, distances, sets))
            starts, directions = of_rays(starts, np.flatnonzero(met)), directions[:, met]
            places = self.meet(sets, directions, *scene.surface(shapes, starts, directions, t), shapes)
            on = np.flatnonzero(places.none)
            left, t, distances, sets = left[on], t[on], distances[on], places.media[3][on]
            starts, directions = onward(scene, places).take(on, axis=1), directions.take(on, axis=1)
            distances = distances - t
        return free

    def _crossings(self, first, kind, directions, slopes, points, normals, sizes):
        """Yields shapes of a kind, rays, t, and the starts (3, n) of those rays and how far back they are."""

        def start(extent):
            reach = shifts(self.scene, points, normals, np.maximum(sizes, extent))
            backs = 8 * reach / np.maximum(slopes, directions.dtype.type(GRAZING))
            return points - backs * directions, backs

        if isinstance(kind, Meshes):
            starts, backs = start(self.extents[first : first + len(kind)].max())
            for triangles, rays, t in kind.triangles.crossings(starts, directions):
                near = (t > 0) & (t < 2 * backs[rays])
                triangles, rays, t = triangles[near], rays[near], t[near]
                yield first + triangles, rays, t, starts.take(rays, axis=1), backs[rays]
            return
        for shape in range(len(kind)):
            starts, backs = start(self.extents[first + shape])
            rays, t = kind.hits(shape, *kind.seen(starts, directions))
            near = (t > 0) & (t < 2 * backs[rays])
            rays, t = rays[near], t[near]
            if len(rays):
                yield np.full(len(rays), first + shape), rays, t, starts.take(rays, axis=1), backs[rays]

    def _places(self, sets, directions, changes, points, normals, sizes, tops):
        """MED-7 and MED-8, of the surfaces on top."""
        scene, media = self.scene, self.scene.media
        entered, left = changes[0] & ~changes[1], changes[1] & ~changes[0]
        was, beyond = (sets | left) & ~entered, (sets | entered) & ~left
        i, t = media.medium(was), media.medium(beyond)
        bits, own = media.bits[tops], media.materials[tops]
        d_dot_n = dot(directions, normals)
        inside = (bits == 0) & ~scene.flat[tops] & (d_dot_n > 0)
        several = (bits != 0) & ((entered | left) & ~bits != 0)
        none = several & (self.medium[i] == self.medium[t])
        i, t = np.where(inside, own, i), np.where(bits != 0, t, np.where(inside, i, own))
        return Places(points, normals, sizes, tops, d_dot_n, (i, t, was, beyond), none)


def onward(scene, places):
    """Where rays start that go on through Places (OFF-1)."""
    off = shifts(scene, places.points, places.normals, places.sizes) * places.normals
    return places.points + np.where(places.d_dot_n > 0, off, -off)


def extents(kind):
    """The size of each shape of a kind; of a CSG solid the largest of its parts."""
    if isinstance(kind, Csg):
        return np.array([max(part.extent() for part in parts) for parts in kind.parts])
    return kind.triangles.sizes if isinstance(kind, Meshes) else kind.sizes
