"""Walks over the tree of rays below an eye ray (WLK).

Each gives a colour, the weight that was cut off (CUT-2), and the numbers of reflected rays, transmitted rays and
feelers (CNT-1).
"""

import numpy as np

from ..needs import ATTENUATION, CUTOFF, GLOSSY, MEDIA, SCATTERED, STREAMED, TRANSMISSION, WALK
from ..scene import LOBE
from ..target import called, kernel
from ..vector import add, scale
from .trace import gather, greatest, leave_mirrored, leave_through, meet, unit_weight, weigh

if STREAMED:
    from ..gpu.tiles import any_of_block

# Columns of walk_reals: origin, direction, weight. Of walk_integers: order, or whether the row is used; set; path.
REALS = 9 if ATTENUATION else 7
ORDER = 0
MEMBERS = 1
PATH = 2 if MEDIA else 1
INTEGERS = 1 + MEDIA + SCATTERED


def rows(depth, glossy_rays):
    """Rows of the table or stack of one pixel in work (WLK-1); 0 for a walk without any."""
    branching = (max(1, glossy_rays) if GLOSSY else 1) + TRANSMISSION
    if WALK == "table":
        return sum(max(branching, 2) ** order for order in range(depth + 1))
    return 1 + depth * (branching - 1) if WALK == "stack" else 0


@kernel
def reflections(scene, surroundings):
    """The number of reflected rays (GLO-1)."""
    if GLOSSY and scene.materials[surroundings[4], LOBE] >= 0:
        return scene.glossy_rays
    return 1


@kernel
def keep(scene, thread, k, weight, ray, order):
    """Write row `k`."""
    reals, integers = scene.walk_reals, scene.walk_integers
    origin, direction, members, path = ray
    reals[thread, k, 0], reals[thread, k, 1], reals[thread, k, 2] = origin
    reals[thread, k, 3], reals[thread, k, 4], reals[thread, k, 5] = direction
    if ATTENUATION:
        reals[thread, k, 6], reals[thread, k, 7], reals[thread, k, 8] = weight
    else:
        reals[thread, k, 6] = weight
    integers[thread, k, ORDER] = order
    if MEDIA:
        integers[thread, k, MEMBERS] = members
    if SCATTERED:
        integers[thread, k, PATH] = path


@kernel
def kept(scene, thread, k):
    """Weight, ray and order of row `k`."""
    reals, integers = scene.walk_reals, scene.walk_integers
    origin = reals[thread, k, 0], reals[thread, k, 1], reals[thread, k, 2]
    direction = reals[thread, k, 3], reals[thread, k, 4], reals[thread, k, 5]
    weight = reals[thread, k, 6]
    if ATTENUATION:
        weight = reals[thread, k, 6], reals[thread, k, 7], reals[thread, k, 8]
    members = integers[thread, k, MEMBERS] if MEDIA else 0
    path = integers[thread, k, PATH] if SCATTERED else 0
    return weight, (origin, direction, members, path), integers[thread, k, ORDER]


@kernel
def of_order(place, order):
    """The place of a sample, pixel and sample, with the order of one of its rays (SOB-1)."""
    return place[0], place[1], order


@kernel
def walk_chain(scene, thread, place, ray, depth):
    """Where each ray has one child at most, the tree of rays is a loop."""
    zero = type(scene.epsilon)(0)
    colour, weight = (zero, zero, zero), unit_weight(scene)
    order, feelers = np.int32(0), 0  # narrow, as a GPU has few registers
    while True:
        at = of_order(place, order)
        light, weight, mirror, _, more, surroundings = meet(scene, thread, at, ray, weight, order == depth)
        colour = gather(colour, weight, light)
        feelers += more
        if mirror == 0:
            return colour, zero, order, 0, feelers
        ray, lobe = leave_mirrored(scene, at, ray, surroundings, 0)
        if GLOSSY:
            mirror *= lobe
            if mirror == 0:
                return colour, zero, order, 0, feelers
        weight = weigh(weight, mirror)
        if CUTOFF and greatest(weight) <= scene.cutoff:
            return colour, greatest(weight), order, 0, feelers
        order = np.int32(order + 1)


@kernel
def unfinished(height):
    """Whether rays wait here; or in some thread of the block, if all go in step (gpu/tiles.py)."""
    if STREAMED:
        return any_of_block(height > 0)
    return height > 0


@kernel
def walk_stack(scene, thread, place, ray, depth):
    """Rays that wait, on a stack."""
    zero = type(scene.epsilon)(0)
    colour, dropped = (zero, zero, zero), zero
    reflected, transmitted, feelers = 0, 0, 0
    keep(scene, thread, 0, unit_weight(scene), ray, 0)
    height = 1
    while True:
        waiting = height > 0  # but not of a thread that only keeps step
        height = max(0, height - 1)
        weight, ray, order = kept(scene, thread, height)
        at = of_order(place, order)
        light, weight, mirror, through, more, surroundings = meet(scene, thread, at, ray, weight, order == depth)
        if waiting or not STREAMED:
            colour = gather(colour, weight, light)
            feelers += more
            if TRANSMISSION and through != 0:
                onward = weigh(weight, through)
                if CUTOFF and greatest(onward) <= scene.cutoff:
                    dropped += greatest(onward)
                else:
                    keep(scene, thread, height, onward, leave_through(scene, ray, surroundings), order + 1)
                    height, transmitted = height + 1, transmitted + 1
            if mirror != 0:
                for g in range(reflections(scene, surroundings)):
                    leaving, lobe = leave_mirrored(scene, at, ray, surroundings, g)
                    if mirror * lobe == 0:
                        continue
                    onward = weigh(weight, mirror * lobe)
                    if CUTOFF and greatest(onward) <= scene.cutoff:
                        dropped += greatest(onward)
                    else:
                        keep(scene, thread, height, onward, leaving, order + 1)
                        height, reflected = height + 1, reflected + 1
        # Not as the condition of the loop, which Python compiles twice, before the loop and at its end: threads that
        # keep step would vote in one place, the others in the other, and on a GPU wait for each other for ever.
        if not unfinished(height):
            return colour, dropped, reflected, transmitted, feelers


@kernel
def walk_table(scene, thread, place, ray, depth):
    """A row for every possible ray, the children of row p being p B + 1 and the B - 1 after it."""
    zero = type(scene.epsilon)(0)
    colour = zero, zero, zero
    reflected, transmitted, feelers = 0, 0, 0
    used, branching = scene.walk_integers, 2
    if GLOSSY:
        branching = max(2, scene.glossy_rays + (1 if TRANSMISSION else 0))
    keep(scene, thread, 0, unit_weight(scene), ray, 1)
    first, count = 0, 1  # rows of this order
    for order in range(depth + 1):
        at = of_order(place, order)
        for p in range(first, first + count):
            children = p * branching + 1
            if order < depth:
                for c in range(children, children + branching):
                    used[thread, c, ORDER] = 0
            if used[thread, p, ORDER] == 0:
                continue
            weight, ray, _ = kept(scene, thread, p)
            light, weight, mirror, through, more, surroundings = meet(scene, thread, at, ray, weight, order == depth)
            colour = gather(colour, weight, light)
            feelers += more
            if TRANSMISSION and through != 0:
                leaving = leave_through(scene, ray, surroundings)
                keep(scene, thread, children + branching - 1, weigh(weight, through), leaving, 1)
                transmitted += 1
            if mirror != 0:
                for g in range(reflections(scene, surroundings)):
                    leaving, lobe = leave_mirrored(scene, at, ray, surroundings, g)
                    if mirror * lobe != 0:
                        keep(scene, thread, children + g, weigh(weight, mirror * lobe), leaving, 1)
                        reflected += 1
        first, count = first + count, count * branching
    return colour, zero, reflected, transmitted, feelers


@called
def recurse(scene, thread, place, ray, order, depth):
    """REF-4 as it stands."""
    at = of_order(place, order)
    light, weight, mirror, through, feelers, surroundings = meet(
        scene, thread, at, ray, unit_weight(scene), order == depth
    )
    zero = type(scene.epsilon)(0)
    nothing = zero, zero, zero
    if mirror == 0 and through == 0:
        return gather(nothing, weight, light), 0, 0, feelers
    reflected, transmitted = 0, 0
    if mirror != 0:
        for g in range(reflections(scene, surroundings)):
            leaving, lobe = leave_mirrored(scene, at, ray, surroundings, g)
            if mirror * lobe != 0:
                colour, r, t, f = recurse(scene, thread, place, leaving, order + 1, depth)
                light = add(light, scale(mirror * lobe, colour))
                reflected, transmitted, feelers = reflected + 1 + r, transmitted + t, feelers + f
    if TRANSMISSION and through != 0:
        colour, r, t, f = recurse(scene, thread, place, leave_through(scene, ray, surroundings), order + 1, depth)
        light = add(light, scale(through, colour))
        reflected, transmitted, feelers = reflected + r, transmitted + 1 + t, feelers + f
    return gather(nothing, weight, light), reflected, transmitted, feelers


@kernel
def walk_recursion(scene, thread, place, ray, depth):
    """A function that calls itself.

    It is called with numbers: for the constants of an eye ray Numba would compile a second signature, which calls the
    first by an address that the cache does not keep.
    """
    origin, direction, members, path = ray
    ray = origin, direction, np.int64(members), np.int64(path)
    colour, reflected, transmitted, feelers = recurse(scene, thread, place, ray, np.int64(0), depth)
    return colour, type(scene.epsilon)(0), reflected, transmitted, feelers


walk = {"chain": walk_chain, "stack": walk_stack, "table": walk_table, "recursion": walk_recursion}[WALK]
