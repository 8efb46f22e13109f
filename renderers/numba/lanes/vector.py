"""Points and directions of a packet: tuples of three lanes. Products and sums are fused (VEC-1)."""

import math

from ..target import kernel
from .lanes import fma, lane, put, select
from .memory import gather


@kernel
def dot(a, b):
    return fma(a[0], b[0], fma(a[1], b[1], a[2] * b[2]))


@kernel
def along(a, s, b):
    """a + s b."""
    return fma(s, b[0], a[0]), fma(s, b[1], a[1]), fma(s, b[2], a[2])


@kernel
def normalise(a):
    """NUM-4."""
    length = math.sqrt(dot(a, a))
    return a[0] / length, a[1] / length, a[2] / length


@kernel
def select_three(mask, a, b):
    return select(mask, a[0], b[0]), select(mask, a[1], b[1]), select(mask, a[2], b[2])


@kernel
def gather_three(table, first, columns, mask):
    """Of row `first` and the two after it."""
    x, y = gather(table, first, columns, mask), gather(table, first + 1, columns, mask)
    return x, y, gather(table, first + 2, columns, mask)


@kernel
def of_lane(a, k):
    """That of lane `k`."""
    return lane(a[0], k), lane(a[1], k), lane(a[2], k)


@kernel
def put_three(a, k, numbers):
    """`a` with three numbers in lane `k`."""
    return put(a[0], k, numbers[0]), put(a[1], k, numbers[1]), put(a[2], k, numbers[2])
