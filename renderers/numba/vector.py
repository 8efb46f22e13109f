"""Points, directions and colours: tuples of three numbers, which Numba keeps in registers."""

import math

from .needs import RENORMALISE, SINGLE
from .target import kernel

UNIT_ROUNDOFF = 2.0**-24 if SINGLE else 2.0**-53  # u of NUM-2


@kernel
def row(table, i):
    """Row `i` of an (n, 3) array, or the first three numbers of a longer row."""
    return table[i, 0], table[i, 1], table[i, 2]


@kernel
def row_of(table, i, k):
    """Row `k` of part `i` of an (n, m, 3) array."""
    return table[i, k, 0], table[i, k, 1], table[i, k, 2]


@kernel
def add(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@kernel
def subtract(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@kernel
def negate(a):
    return -a[0], -a[1], -a[2]


@kernel
def scale(s, a):
    return s * a[0], s * a[1], s * a[2]


@kernel
def along(a, s, b):
    """a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


@kernel
def multiply(a, b):
    """Channel by channel."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


@kernel
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def normalise(a):
    """NUM-4."""
    length = math.sqrt(dot(a, a))
    return a[0] / length, a[1] / length, a[2] / length


@kernel
def unit(a):
    """`a` at unit length; unchanged if its length is 1 up to rounding, since a division would turn it (NUM-4)."""
    real = type(a[0])
    if abs(dot(a, a) - real(1)) <= real(4 * UNIT_ROUNDOFF):
        return a
    return normalise(a)


@kernel
def as_it_is(a):
    return a


renormalise = normalise if RENORMALISE == "on" else as_it_is  # what is made of vectors of unit length (NUM-4)


@kernel
def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def largest(a):
    """|a|∞"""
    return max(abs(a[0]), abs(a[1]), abs(a[2]))
