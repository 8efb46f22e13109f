"""Powers by polynomials: LLVM has none of lanes, and would call the C library for one after the other.

x^m = 2^(m log2 x). With x = 2^e z, z in [√½, √2), and s = (z - 1)/(z + 1), log2 z is the series 2/ln 2 (s + s³/3 + ..)
of the inverse hyperbolic tangent: s² ≤ 0.0295, z - 1 is exact, so the logarithm is right close to x = 1 too. It is off
by less than 6 u of itself: s by 2 u, the sum of the series by 2.2 u, its end included, product or sum by 1 u. With
another u for y = m log2 x, and 3 u for the series of 2^g, g = y - round(y), |g| ≤ ½, end included, a power 2^y is off
by less than (5 |y| + 3) u of itself, which is less than 4 u of 1.

Below 2^LEAST a power is 0: smaller ones, times what they are multiplied with, would not be normal numbers, which are
slow. A base below TINY is taken for TINY.
"""

import math

from ..needs import SINGLE
from ..target import kernel
from .lanes import fma, from_bits, from_whole, rounded, select, spread, to_bits, whole

DIGITS, LEAST, TINY = (23, -100.0, 2.0**-126) if SINGLE else (52, -1000.0, 2.0**-1022)
ROOT_HALF = 0x3F3504F3 if SINGLE else 0x3FE6A09E667F3BCD  # bits of √½

# Of s², and of g; the first left out is below u/10 and u/4 of the sum. Highest power first.
LOGARITHM = tuple(2 / math.log(2) / (2 * k + 1) for k in range(4 if SINGLE else 9, -1, -1))
EXPONENTIAL = tuple(math.log(2) ** k / math.factorial(k) for k in range(7 if SINGLE else 13, -1, -1))


@kernel
def polynomial(coefficients, x):
    """Horner's rule."""
    y = spread(coefficients[0])
    for k in range(1, len(coefficients)):
        y = fma(y, x, coefficients[k])
    return y


@kernel
def power(x, m):
    """x^m for 0 < x ≤ 1 and m ≥ 0."""
    bits = to_bits(select(x > TINY, x, TINY))
    e = (bits - ROOT_HALF) >> DIGITS
    z = from_bits(bits - (e << DIGITS))
    s = (z - 1.0) / (z + 1.0)
    y = m * fma(s, polynomial(LOGARITHM, s * s), from_whole(e))
    n = rounded(y)
    mantissa = polynomial(EXPONENTIAL, y - n)
    seen = y > LEAST
    return select(seen, from_bits(to_bits(mantissa) + (whole(select(seen, n, 0.0)) << DIGITS)), 0.0)
