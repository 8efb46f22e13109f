"""Roots of a t² + h t + k = 0 by the usual formulas: from the discriminant, which cancels (SPH-3, ELL-3)."""

import math

from ..needs import FAR, SPHERE_METHOD
from ..target import inlined


@inlined
def root_textbook(a, h, k):
    """The smallest root above 0, or one that is not; FAR if there is none."""
    real = type(a)
    two, four = real(2), real(4)
    discriminant = h * h - four * a * k
    if discriminant >= 0:
        root = math.sqrt(discriminant)
        t = (-h - root) / (two * a)
        if t > 0:
            return t
        return (-h + root) / (two * a)
    return real(FAR)


@inlined
def root_stable(a, h, k):
    """The same from roots that do not cancel, of a discriminant that still does."""
    real = type(a)
    two, four = real(2), real(4)
    discriminant = h * h - four * a * k
    if discriminant >= 0:
        root = math.sqrt(discriminant)
        q = -(h + root) / two if h >= 0 else -(h - root) / two
        t, other = q / a, k / q
        if other < t:
            t, other = other, t
        if t > 0:
            return t
        return other
    return real(FAR)


QUADRATIC = SPHERE_METHOD in ("textbook", "stable")
root = root_stable if SPHERE_METHOD == "stable" else root_textbook
