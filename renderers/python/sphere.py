"""Spheres (SPH-1, SPH-2)."""


class Sphere:
    """A sphere; `row` is what the search for the nearest hit reads: centre, radius squared, itself."""

    def __init__(self, centre, radius, material, identity, number):
        self.centre, self.radius = centre, radius
        self.material, self.identity = material, identity
        self.size = radius
        self.sqrt = number.sqrt
        self.row = (*centre, radius * radius, self)

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
            k = fx * fx + fy * fy + fz * fz - r2
            if k > 0:
                if h >= 0:
                    continue
                t = k / (sqrt(discriminant) - h)
            elif h <= 0:
                t = sqrt(discriminant) - h
            else:
                t = k / (-h - sqrt(discriminant))
            if 0 < t < limit:
                limit = t
                best = t, sphere, None
    return best
