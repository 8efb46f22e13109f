"""Powers, logarithms, sines and cosines by polynomials: LLVM has none of lanes, and would call the C library for each.

log2 x = e + log2 z with x = 2^e z, z in [√½, √2). With s = (z - 1)/(z + 1), log2 z is the series 2/ln 2 (s + s³/3 + ..)
of the inverse hyperbolic tangent: s² ≤ 0.0295, z - 1 is exact, so the logarithm is right close to x = 1 too. It is off
by less than 6 u of itself: s by 2 u, the sum of the series by 2.2 u, its end included, product or sum by 1 u.

With another u for y = m log2 x, and 3 u for the series of 2^g, g = y - round(y), |g| ≤ ½, end included, a power 2^y is
off by less than (5 |y| + 3) u of itself, which is less than 4 u of 1. Below 2^LEAST a power is 0: smaller ones, times
what they are multiplied with, would not be normal numbers, which are slow. A base below TINY is taken for TINY.
"""

import math

from ..needs import SINGLE
from ..target import kernel
from .lanes import fma, from_bits, from_whole, rounded, select, spread, to_bits, whole

DIGITS, LEAST, TINY = (23, -100.0, 2.0**-126) if SINGLE else (52, -1000.0, 2.0**-1022)
ROOT_HALF, ONE = (0x3F3504F3, 127 << 23) if SINGLE else (0x3FE6A09E667F3BCD, 1023 << 52)  # bits of √½ and 1

# Of s², g, the rest of e^x - 1, and the square of an angle of at most π/4; the first left out is below u/4 of the sum.
# Highest power first.
LOGARITHM = tuple(2 / math.log(2) / (2 * k + 1) for k in range(4 if SINGLE else 9, -1, -1))
EXPONENTIAL = tuple(math.log(2) ** k / math.factorial(k) for k in range(7 if SINGLE else 13, -1, -1))
LESS_ONE = tuple(1 / math.factorial(k) for k in range(8 if SINGLE else 14, 0, -1))
COSINE = tuple((-1) ** k / math.factorial(2 * k) for k in range(5 if SINGLE else 9, -1, -1))
SINE = tuple((-1) ** k / math.factorial(2 * k + 1) for k in range(5 if SINGLE else 9, -1, -1))

LN_2, LOWEST = math.log(2), -math.log(2) * (DIGITS + 3)  # from LOWEST on, e^x - 1 is -1


@kernel
def polynomial(coefficients, x):
    """Horner's rule."""
    y = spread(coefficients[0])
    for k in range(1, len(coefficients)):
        y = fma(y, x, coefficients[k])
    return y


@kernel
def log2(x):
    """log2 x for normal x > 0."""
    bits = to_bits(x)
    e = (bits - ROOT_HALF) >> DIGITS
    z = from_bits(bits - (e << DIGITS))
    s = (z - 1.0) / (z + 1.0)
    return fma(s, polynomial(LOGARITHM, s * s), from_whole(e))


@kernel
def exp2(y):
    """2^y for y ≤ 0; 0 below LEAST."""
    n = rounded(y)
    mantissa = polynomial(EXPONENTIAL, y - n)
    seen = y > LEAST
    return select(seen, from_bits(to_bits(mantissa) + (whole(select(seen, n, 0.0)) << DIGITS)), 0.0)


@kernel
def power(x, m):
    """x^m for 0 < x ≤ 1 and m ≥ 0."""
    return exp2(m * log2(select(x > TINY, x, TINY)))


@kernel
def logarithm(x):
    """ln x for normal x > 0, off by some u of itself."""
    return log2(x) * LN_2


@kernel
def expm1(x):
    """e^x - 1 for x ≤ 0, off by some u of itself: 2^n p + (2^n - 1), p = e^r - 1 of the rest r = x - n ln 2."""
    x = select(x < LOWEST, LOWEST, x)
    n = rounded(x * (1 / LN_2))
    r = fma(n, -LN_2, x)
    scale = from_bits((whole(n) << DIGITS) + ONE)
    return fma(scale, polynomial(LESS_ONE, r) * r, scale - 1.0)


@kernel
def turn(u):
    """cos and sin of 2π u, for u from 0 to 1, off by some u: series of the angle to the nearest quarter of a turn."""
    quarters = rounded(4.0 * u)
    x = fma(quarters, -0.25, u) * (2 * math.pi)
    square, quarter = x * x, whole(quarters)
    c, s = polynomial(COSINE, square), polynomial(SINE, square) * x
    odd = (quarter & 1) != 0
    cosine, sine = select(odd, s, c), select(odd, c, s)
    return select(((quarter + 1) & 2) != 0, -cosine, cosine), select((quarter & 2) != 0, -sine, sine)
