"""The rounding error of a sum or a product, as a number of its own.

Under `floating_point` fast these may be believed to be 0 (NUM-3).
"""

from ..needs import SIMULATED, TARGET
from ..target import kernel

if SIMULATED:
    from fractions import Fraction

    def fma(a, b, c):
        """a b + c, exact and then rounded (of float32 twice): Python has it from 3.13 on."""
        try:
            exact = Fraction(float(a)) * Fraction(float(b)) + Fraction(float(c))
        except (OverflowError, ValueError):  # of inf and NaN
            return a * b + c
        return type(a)(exact)

elif TARGET == "cuda":
    from numba import cuda

    @kernel
    def fma(a, b, c):
        """a b + c, rounded once."""
        return cuda.fma(a, b, c)

else:
    from numba.extending import intrinsic

    @intrinsic
    def fma(_, a, b, c):
        """a b + c, rounded once."""
        return a(a, b, c), lambda context, builder, signature, values: builder.fma(*values)


@kernel
def two_sum(a, b):
    """a + b rounded, and the rest (Knuth)."""
    s = a + b
    c = s - a
    return s, (a - (s - c)) + (b - c)


@kernel
def two_product(a, b):
    """a b rounded, and the rest."""
    p = a * b
    return p, fma(a, b, -p)


@kernel
def difference_of_products(a, b, c, d):
    """a b - c d, to 1.5 units in the last place (Kahan)."""
    w = c * d
    return fma(a, b, -w) + fma(-c, d, w)


@kernel
def coordinate_in_full(f, e, s, d):
    p, q = two_product(s, d)
    total, g = two_sum(f, p)
    return total + (g + q + e)


@kernel
def add_square(s, x, f, e):
    """s + x + (f + e)², as a sum of two again."""
    h, m = two_product(f, f)
    s, y = two_sum(s, h)
    return s, x + (y + m + (f + f) * e)


@kernel
def subtract_in_full(a, b):
    """a - b rounded, and the rest."""
    (x, p), (y, q), (z, r) = two_sum(a[0], -b[0]), two_sum(a[1], -b[1]), two_sum(a[2], -b[2])
    return (x, y, z), (p, q, r)


@kernel
def along_in_full(f, e, s, d):
    """f + e + s d of SPH-3, rounded only at the end."""
    return (
        coordinate_in_full(f[0], e[0], s, d[0]),
        coordinate_in_full(f[1], e[1], s, d[1]),
        coordinate_in_full(f[2], e[2], s, d[2]),
    )


@kernel
def outside_in_full(f, e, radius):
    """k of SPH-3, (f + e)² less the square of the radius."""
    zero = type(radius)(0)
    s, x = add_square(zero, zero, f[0], e[0])
    s, x = add_square(s, x, f[1], e[1])
    s, x = add_square(s, x, f[2], e[2])
    h, m = two_product(radius, radius)
    s, y = two_sum(s, -h)
    return s + (x + (y - m))
