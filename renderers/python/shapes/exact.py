"""Sums and products with twice the digits: the rounded result and its rounding error (SPH-3)."""


def twosum(a, b):
    """a + b, and its error (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def twoproduct(a, b, splitter):
    """a b, and its error (Dekker 1971, with Veltkamp's split)."""
    c = splitter * a
    a_high = c - (c - a)
    a_low = a - a_high
    c = splitter * b
    b_high = c - (c - b)
    b_low = b - b_high
    product = a * b
    return product, a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)
