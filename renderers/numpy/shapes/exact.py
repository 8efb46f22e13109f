"""Sums and products with twice the digits: the rounded result and its rounding error (SPH-3)."""

import numpy as np


def twosum(a, b):
    """a + b, and its error (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def twoproduct(a, b):
    """a b, and its error (Dekker 1971)."""
    product = a * b
    (a, a_low), (b, b_low) = halves(a), halves(b)
    return product, a_low * b_low - (((product - a * b) - a_low * b) - a * b_low)


def halves(a):
    """The upper and the lower half of the digits (Veltkamp)."""
    digits = np.finfo(a.dtype).nmant + 1
    c = a * a.dtype.type(2 ** ((digits + 1) // 2) + 1)
    high = c - (c - a)
    return high, a - high
