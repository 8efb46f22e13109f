"""Points, directions and colours: tuples of three numbers, which Numba keeps in registers."""

import math

from numba import njit

# Every function of the kernel is made by one of these three. Floating point is strict (NUM-3: no fastmath), and a
# division by zero gives inf or NaN. Arrays are not reference-counted, as counting the scene's at each call takes
# two thirds of the time; calls are inlined, as a scene passed on is a hundred words; and Python never calls them.
kernel = njit(error_model="numpy", forceinline=True, _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)
# A function of its own, for what is large and stands in several places, or calls itself.
called = njit(error_model="numpy", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)
# As `kernel`, but inlined before LLVM first sees the caller, which lets a miss go straight on to the next shape.
inlined = njit(error_model="numpy", inline="always")


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
def largest(a):
    """|a|∞"""
    return max(abs(a[0]), abs(a[1]), abs(a[2]))
