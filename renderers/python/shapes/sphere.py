"""Spheres (SPH-1 to SPH-3)."""

from functools import partial

from .exact import twoproduct, twosum
from .shapes import Shape


class Sphere(Shape):
    """A sphere; `row` is what the search for the nearest hit reads: centre, radius squared, itself."""

    row = None

    def __init__(self, centre, radius, material, identity, number, method="robust"):
        super().__init__(material, identity)
        if method in ("textbook", "stable"):  # D is off by some u |f|², which moves a hit by some √u |f|
            self.condition = 1 / number.sqrt(number.roundoff)
        self.centre, self.radius = centre, radius
        self.size = radius
        self.sqrt = number.sqrt
        self.row = (*centre, radius * radius, self)
        if method == "wide":
            self.row = (*centre, *twoproduct(radius, radius, number.splitter), number.splitter, self)

    def bounds(self):
        (x, y, z), r = self.centre, self.radius
        return (x - r, y - r, z - r), (x + r, y + r, z + r)

    def surface(self, origin, direction, t, _face):
        """Point and outward normal of the hit at distance t (SPH-2)."""
        cx, cy, cz = self.centre
        nx = origin[0] + t * direction[0] - cx
        ny = origin[1] + t * direction[1] - cy
        nz = origin[2] + t * direction[2] - cz
        length = self.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx / length, ny / length, nz / length
        r = self.radius
        return (cx + r * nx, cy + r * ny, cz + r * nz), (nx, ny, nz)

    def crossings(self, origin, direction):
        """The boundaries (t, shape, face) on the whole line, in rising order (CSG-1)."""
        cx, cy, cz, r2, _ = self.row
        dx, dy, dz = direction
        fx, fy, fz = origin[0] - cx, origin[1] - cy, origin[2] - cz
        b = -(fx * dx + fy * dy + fz * dz)
        lx, ly, lz = fx + b * dx, fy + b * dy, fz + b * dz
        discriminant = r2 - (lx * lx + ly * ly + lz * lz)
        if not discriminant >= 0:
            return ()
        s, k = self.sqrt(discriminant), fx * fx + fy * fy + fz * fz - r2
        if b < 0:
            return (b - s, self, None), (k / (b - s), self, None)
        far = b + s
        return (k / far if far else far, self, None), (far, self, None)


class Unnormalised(Sphere):
    """A sphere whose normals are divided by its radius, not by their length (NUM-4, renormalise off)."""

    def surface(self, origin, direction, t, _face):
        r = self.radius
        normal = tuple((o + t * d - c) / r for o, d, c in zip(origin, direction, self.centre, strict=True))
        return tuple(c + r * n for c, n in zip(self.centre, normal, strict=True)), normal


def nearest(rows, origin, direction, best, sqrt):
    """The nearest hit closer than `best` = (t, shape, face), or `best`."""
    ox, oy, oz = origin
    dx, dy, dz = direction
    limit = best[0]
    for cx, cy, cz, r2, sphere in rows:
        fx = ox - cx
        fy = oy - cy
        fz = oz - cz
        h = fx * dx + fy * dy + fz * dz  # -b of SPH-1
        lx = fx - h * dx
        if lx * lx > r2:  # then Δ < 0 too: rounding keeps order
            continue
        ly = fy - h * dy
        lz = fz - h * dz
        discriminant = r2 - (lx * lx + ly * ly + lz * lz)
        if discriminant >= 0:
            t = root(h, fx * fx + fy * fy + fz * fz - r2, sqrt(discriminant))
            if 0 < t < limit:
                limit = t
                best = t, sphere, None
    return best


def root(h, k, s):
    """t of SPH-1, with h = -b and s = √Δ; 0 where the sphere is behind."""
    if k > 0:
        return k / (s - h) if h < 0 else 0
    return s - h if h <= 0 else k / (-h - s)


def seen_from(origin, rows, roundoff):
    """Returns the rows of spheres for `nearest_seen`: the common part of the tests of all rays that start at `origin`.

    A hit has h² ≥ k up to rounding, less than 32 u |f|² in all: of SPH-1's Δ, of h², of k, and of the length of d. So
    where h² < k - 64 u |f|² the discriminant of `nearest` is negative as well.
    """
    ox, oy, oz = origin
    seen = []
    for cx, cy, cz, r2, sphere in rows:
        fx, fy, fz = ox - cx, oy - cy, oz - cz
        f2 = fx * fx + fy * fy + fz * fz
        k = f2 - r2
        seen.append((fx, fy, fz, k - 64 * roundoff * f2, r2, k, sphere))
    return seen


def nearest_seen(seen, _origin, direction, best, sqrt):
    """As `nearest`, to the bit, of spheres from `seen_from`."""
    dx, dy, dz = direction
    limit = best[0]
    for fx, fy, fz, least, r2, k, sphere in seen:
        h = fx * dx + fy * dy + fz * dz
        if h * h < least:
            continue
        lx = fx - h * dx
        ly = fy - h * dy
        lz = fz - h * dz
        discriminant = r2 - (lx * lx + ly * ly + lz * lz)
        if discriminant >= 0:
            t = root(h, k, sqrt(discriminant))
            if 0 < t < limit:
                limit = t
                best = t, sphere, None
    return best


def wide(rows, origin, direction, best, sqrt):
    """As `nearest`, with f, l and k computed with twice the digits (SPH-3)."""
    ox, oy, oz = origin
    dx, dy, dz = direction
    limit = best[0]
    for cx, cy, cz, r2, r2_error, splitter, sphere in rows:
        fx, ex = twosum(ox, -cx)
        fy, ey = twosum(oy, -cy)
        fz, ez = twosum(oz, -cz)
        b = -(fx * dx + fy * dy + fz * dz)
        lx = along(fx, ex, b, dx, splitter)
        ly = along(fy, ey, b, dy, splitter)
        lz = along(fz, ez, b, dz, splitter)
        rest = lx * dx + ly * dy + lz * dz
        lx, ly, lz = lx - rest * dx, ly - rest * dy, lz - rest * dz
        discriminant = r2 - (lx * lx + ly * ly + lz * lz)
        if discriminant >= 0:
            s = x = 0
            for f, e in (fx, ex), (fy, ey), (fz, ez):
                square, error = twoproduct(f, f, splitter)
                s, y = twosum(s, square)
                x += y + error + 2 * f * e
            s, y = twosum(s, -r2)
            k = s + (x + (y - r2_error))
            if k > 0:
                if b <= 0:
                    continue
                t = k / (b + sqrt(discriminant))
            else:
                t = b + sqrt(discriminant) if b >= 0 else k / (b - sqrt(discriminant))
            if 0 < t < limit:
                limit = t
                best = t, sphere, None
    return best


def along(f, e, b, d, splitter):
    """f + e + b d, with hardly more than one rounding."""
    p, q = twoproduct(b, d, splitter)
    s, g = twosum(f, p)
    return s + (g + q + e)


def solving(root, rows, origin, direction, best, sqrt):
    """As `nearest`, from the equation of a hit; root(a, h, k, √D) is t, if that is above 0 (SPH-3)."""
    ox, oy, oz = origin
    dx, dy, dz = direction
    limit = best[0]
    a = dx * dx + dy * dy + dz * dz
    for cx, cy, cz, r2, sphere in rows:
        fx = ox - cx
        fy = oy - cy
        fz = oz - cz
        h = 2 * (fx * dx + fy * dy + fz * dz)
        k = fx * fx + fy * fy + fz * fz - r2
        discriminant = h * h - 4 * a * k
        if discriminant >= 0:
            t = root(a, h, k, sqrt(discriminant))
            if 0 < t < limit:
                limit = t
                best = t, sphere, None
    return best


def textbook(a, h, k, s):
    """The smaller root above 0, by the textbook's formula."""
    near = (-h - s) / (2 * a)
    return near if near > 0 else (-h + s) / (2 * a)


def stable(a, h, k, s):
    """The same without subtracting √D from a number close to it."""
    q = -(h + s) / 2 if h >= 0 else -(h - s) / 2
    if q == 0:  # so is k
        return q
    x, y = q / a, k / q
    return x if x > 0 and not 0 < y < x else y


ROOTS = {"textbook": textbook, "stable": stable}
SEARCHES = {"robust": nearest, "wide": wide, **{method: partial(solving, root) for method, root in ROOTS.items()}}
