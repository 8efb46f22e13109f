"""The rays that leave the hits of a packet (REF, TRA, GLO), and those that are not worth it (CUT)."""

from ..needs import ATTENUATION, CUTOFF, GLOSSY, SCATTERED, TRANSMISSION
from ..target import kernel
from . import scene as tables
from .lanes import COUNT, any_of, lane, select, spread
from .memory import gather
from .rays import keep, weigh
from .reflect import between, fresnel, glossy, refracted
from .vector import along, normalise, select_three


@kernel
def greatest(weight):
    """A weight as one number: the largest of three (CUT-1)."""
    if ATTENUATION:
        larger = select(weight[0] > weight[1], weight[0], weight[1])
        return select(larger > weight[2], larger, weight[2])
    return weight


@kernel
def uncut(scene, thread, weight, place, wanted):
    """The rays of the mask `wanted` whose weight is above the cut-off; the others' is noted (CUT-1, CUT-2)."""
    if CUTOFF:
        size = greatest(weight)
        cut = wanted & (size <= scene.cutoff)
        if any_of(cut):
            for k in range(COUNT):
                if lane(cut, k):
                    scene.losses[thread, 0, lane(place, k)] += lane(size, k)
        return wanted & ~cut
    return wanted


@kernel
def reflections(scene):
    """The number of reflected rays of a hit."""
    if GLOSSY:
        return scene.glossy_rays
    return 1


@kernel
def branches(scene):
    """The largest number of rays that leave a hit."""
    if TRANSMISSION:
        return reflections(scene) + 1
    return reflections(scene)


@kernel
def child(scene, path, c):
    """The path of child `c`, of the last for -1 (RND-4)."""
    if not SCATTERED:
        return path
    branches = reflections(scene) + 1
    if c < 0:
        c += branches
    return path * branches + (1 + c)


@kernel
def leave(scene, thread, rays, places, order, first, hit, ray, weight, sample, surface, around):
    """Write the rays that leave hits among those of an order, from column `first` on; how many mirrored, transmitted.

    ray: direction, place, pixel, path. weight: at the hits. surface: point, normal, step, role, d·n.
    around: of `sides`.
    """
    direction, place, pixel, path = ray
    point, normal, step, role, cosine = surface
    i, t, was, beyond = around
    inside, k, mirrored = cosine > 0.0, first, 0
    n, m = between(scene, role, hit, inside, i, t)
    share, s, there = fresnel(n, m, cosine)
    specular = gather(scene.roles, tables.SPECULAR, role, hit)
    side = select(inside, spread(-1.0), 1.0)
    mirrors = hit & (specular * share != 0.0)
    if any_of(mirrors):
        start, towards = along(point, side, step), normalise(along(direction, -2.0 * cosine, normal))  # REF-3
        for g in range(reflections(scene)):
            way, part, leaves = towards, specular * share, mirrors
            if GLOSSY:
                exponent = gather(scene.roles, tables.LOBE, role, mirrors)
                rough = exponent >= 0.0
                aside, lobe = glossy(scene, (pixel, sample, order - 1, path), exponent, normal, towards, g)
                way = select_three(rough, aside, towards)
                part = part * select(rough, lobe / scene.glossy_rays, 1.0)
                if g > 0:
                    leaves = mirrors & rough
            onward = weigh(weight, part)
            kept = uncut(scene, thread, onward, place, leaves & (part != 0.0))
            leaving = start, way, onward, place, was, child(scene, path, g)
            k += keep(rays, places, order, k, leaving, kept)
        mirrored = k - first
    if TRANSMISSION:
        through = specular * (1.0 - share)
        passes = hit & (gather(scene.roles, tables.CLEAR, role, hit) != 0.0) & (through != 0.0)
        if any_of(passes):
            onward = weigh(weight, through)
            passes = uncut(scene, thread, onward, place, passes)
            straight = ~there | (gather(scene.roles, tables.FLAT, role, hit) != 0.0)
            way = select_three(straight, direction, refracted(direction, normal, cosine, inside, n, s))
            leaving = along(point, -side, step), way, onward, place, beyond, child(scene, path, -1)
            k += keep(rays, places, order, k, leaving, passes)
    return mirrored, k - first - mirrored
