"""Ellipsoids of a centre and three semi-axes (ELL-1, ELL-2): the image of the unit sphere."""

from .vector import add, dot, largest, normalise, reciprocal, scale, subtract


class Ellipsoid:
    def __init__(self, centre, axes, material, identity, number):
        self.centre, self.axes = centre, axes
        self.material, self.identity = material, identity
        self.size = max(largest(axis) for axis in axes)
        self.inverse = reciprocal(*axes)
        self.sqrt = number.sqrt

    def to_unit(self, vector):
        """`vector` in the frame where the ellipsoid is the unit sphere: m of the SPEC without the centre."""
        g1, g2, g3 = self.inverse
        return dot(g1, vector), dot(g2, vector), dot(g3, vector)

    def surface(self, origin, direction, t, _face):
        """Point and outward normal of the hit at distance t (ELL-2)."""
        f = self.to_unit(subtract(origin, self.centre))
        x, y, z = normalise(add(f, scale(self.to_unit(direction), t)), self.sqrt)
        (a1, a2, a3), (g1, g2, g3) = self.axes, self.inverse
        normal = normalise(add(add(scale(g1, x), scale(g2, y)), scale(g3, z)), self.sqrt)
        return add(self.centre, add(add(scale(a1, x), scale(a2, y)), scale(a3, z))), normal


def nearest(ellipsoids, origin, direction, best, sqrt):
    """The nearest hit closer than `best` = (t, shape, face), or `best`."""
    for ellipsoid in ellipsoids:
        f = ellipsoid.to_unit(subtract(origin, ellipsoid.centre))
        delta = ellipsoid.to_unit(direction)
        a = dot(delta, delta)
        b = -dot(f, delta)
        l = add(f, scale(delta, b / a))  # noqa: E741, the SPEC's letter
        discriminant = 1 - dot(l, l)
        if not discriminant >= 0:
            continue
        k = dot(f, f) - 1
        s = sqrt(a * discriminant)
        if k > 0:
            if b <= 0:
                continue
            t = k / (b + s)
        else:
            t = (b + s) / a if b >= 0 else k / (b - s)
        if 0 < t < best[0]:
            best = t, ellipsoid, None
    return best
