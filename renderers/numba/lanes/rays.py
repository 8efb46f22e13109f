"""Rays that wait, in columns: those of an order side by side."""

from ..needs import ATTENUATION, GLOSSY, MEDIA, SCATTERED, TRANSMISSION
from ..target import kernel
from .lanes import count_of, select, spread
from .memory import load, store_some
from .vector import select_three

# Rows of an order: origin, direction and weight, which is three numbers where anything is attenuated; place in the
# tile, set of clear solids (MED-2) and path (RND-4).
WEIGHT, REALS = 6, 9 if ATTENUATION else 7
MEMBERS, PATH, INTEGERS = 1, 1 + MEDIA, 1 + MEDIA + SCATTERED

# Whether a ray can leave several. Where none does, the rays of the next order take the places of those that were read.
BRANCHES = TRANSMISSION or GLOSSY


def orders(depth):
    """How many orders have rows of their own."""
    return max(1, depth) if BRANCHES else 1


def children(glossy_rays):
    """The largest number of rays that leave a hit."""
    return (max(1, glossy_rays) if GLOSSY else 1) + TRANSMISSION


@kernel
def slot(order):
    """Which of the rows are those of the rays of an order, from 1 on."""
    if BRANCHES:
        return order - 1
    return 0


@kernel
def first_weight():
    """That of eye rays."""
    one = spread(1.0)
    if ATTENUATION:
        return one, one, one
    return one


@kernel
def select_weight(mask, a, b):
    if ATTENUATION:
        return select_three(mask, a, b)
    return select(mask, a, b)


@kernel
def of_channel(weight, c):
    """A weight's number for channel `c`."""
    if ATTENUATION:
        return weight[c]
    return weight


@kernel
def weigh(weight, factor):
    """A weight times lanes of numbers."""
    if ATTENUATION:
        return factor * weight[0], factor * weight[1], factor * weight[2]
    return factor * weight


@kernel
def keep(rays, places, order, k, ray, leaves):
    """Write the rays of the mask `leaves` among those of an order, from column `k` on; how many."""
    origin, direction, weight, place, members, path = ray
    first, whole = slot(order) * REALS, slot(order) * INTEGERS
    for c in range(3):
        store_some(rays, first + c, k, origin[c], leaves)
        store_some(rays, first + 3 + c, k, direction[c], leaves)
    if ATTENUATION:
        for c in range(3):
            store_some(rays, first + WEIGHT + c, k, weight[c], leaves)
    else:
        store_some(rays, first + WEIGHT, k, weight, leaves)
    store_some(places, whole, k, place, leaves)
    if MEDIA:
        store_some(places, whole + MEMBERS, k, members, leaves)
    if SCATTERED:
        store_some(places, whole + PATH, k, path, leaves)
    return count_of(leaves)


@kernel
def kept(rays, places, order, k):
    """The rays of an order from column `k` on."""
    first, whole = slot(order) * REALS, slot(order) * INTEGERS
    origin = load(rays, first, k), load(rays, first + 1, k), load(rays, first + 2, k)
    direction = load(rays, first + 3, k), load(rays, first + 4, k), load(rays, first + 5, k)
    weight, place = load(rays, first + WEIGHT, k), load(places, whole, k)
    if ATTENUATION:
        weight = load(rays, first + WEIGHT, k), load(rays, first + WEIGHT + 1, k), load(rays, first + WEIGHT + 2, k)
    members = load(places, whole + MEMBERS, k) if MEDIA else place
    path = load(places, whole + PATH, k) if SCATTERED else place
    return origin, direction, weight, place, members, path
