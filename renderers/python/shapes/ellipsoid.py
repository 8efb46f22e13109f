"""Ellipsoids of a centre and three semi-axes (ELL-1 to ELL-3): the image of the unit sphere."""

from functools import partial

from ..vector import add, dot, largest, length, normalise, reciprocal, scale, subtract
from . import sphere
from .shapes import Shape


class Ellipsoid(Shape):
    def __init__(self, centre, axes, material, identity, number, method="robust"):
        super().__init__(material, identity)
        self.centre, self.axes = centre, axes
        self.size = max(largest(axis) for axis in axes)
        self.inverse = reciprocal(*axes)
        self.condition = self.size * max(largest(g) for g in self.inverse)
        if method in sphere.ROOTS:  # as for a sphere
            self.condition /= number.sqrt(number.roundoff)
        self.sqrt = number.sqrt

    def bounds(self):
        reach = tuple(length(components, self.sqrt) for components in zip(*self.axes, strict=True))
        return subtract(self.centre, reach), add(self.centre, reach)

    def to_unit(self, vector):
        """`vector` in the frame where the ellipsoid is the unit sphere: m of the SPEC without the centre."""
        g1, g2, g3 = self.inverse
        return dot(g1, vector), dot(g2, vector), dot(g3, vector)

    def quadratic(self, origin, direction):
        """(a, b, k, s) of ELL-1, or None for a miss."""
        f = self.to_unit(subtract(origin, self.centre))
        delta = self.to_unit(direction)
        a = dot(delta, delta)
        b = -dot(f, delta)
        l = add(f, scale(delta, b / a))  # noqa: E741, the SPEC's letter
        discriminant = 1 - dot(l, l)
        if not discriminant >= 0:
            return None
        return a, b, dot(f, f) - 1, self.sqrt(a * discriminant)

    def surface(self, origin, direction, t, _face):
        """Point and outward normal of the hit at distance t (ELL-2)."""
        f = self.to_unit(subtract(origin, self.centre))
        x, y, z = normalise(add(f, scale(self.to_unit(direction), t)), self.sqrt)
        (a1, a2, a3), (g1, g2, g3) = self.axes, self.inverse
        normal = normalise(add(add(scale(g1, x), scale(g2, y)), scale(g3, z)), self.sqrt)
        return add(self.centre, add(add(scale(a1, x), scale(a2, y)), scale(a3, z))), normal

    def crossings(self, origin, direction):
        """The boundaries (t, shape, face) on the whole line, in rising order (CSG-1)."""
        found = self.quadratic(origin, direction)
        if found is None:
            return ()
        a, b, k, s = found
        if b < 0:
            return ((b - s) / a, self, None), (k / (b - s), self, None)
        far = b + s
        return (k / far if far else far, self, None), (far / a, self, None)


def nearest(ellipsoids, origin, direction, best, _sqrt):
    """The nearest hit closer than `best` = (t, shape, face), or `best`."""
    for ellipsoid in ellipsoids:
        found = ellipsoid.quadratic(origin, direction)
        if found is None:
            continue
        a, b, k, s = found
        if k > 0:
            if b <= 0:
                continue
            t = k / (b + s)
        else:
            t = (b + s) / a if b >= 0 else k / (b - s)
        if 0 < t < best[0]:
            best = t, ellipsoid, None
    return best


def solving(root, ellipsoids, origin, direction, best, sqrt):
    """As `nearest`, from the equation of a hit (ELL-3)."""
    for ellipsoid in ellipsoids:
        f = ellipsoid.to_unit(subtract(origin, ellipsoid.centre))
        delta = ellipsoid.to_unit(direction)
        a, h, k = dot(delta, delta), 2 * dot(f, delta), dot(f, f) - 1
        discriminant = h * h - 4 * a * k
        if discriminant >= 0:
            t = root(a, h, k, sqrt(discriminant))
            if 0 < t < best[0]:
                best = t, ellipsoid, None
    return best


SEARCHES = {"robust": nearest, "wide": nearest}
SEARCHES |= {method: partial(solving, root) for method, root in sphere.ROOTS.items()}
