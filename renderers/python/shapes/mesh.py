"""Triangles of meshes (TRI-1 to TRI-3), and meshes as parts of CSG solids (CSG-1, CSG-2)."""

from functools import lru_cache

from ..vector import add, corners, cross, dot, largest, normalise, scale, subtract
from .shapes import Shape


class Triangle(Shape):
    """One triangle; `row` is read by the search: the three vertices and the triangle itself."""

    row = None

    def __init__(self, vertices, closed, material, identity, number, method="watertight"):
        super().__init__(material, identity)
        if method != "watertight":  # a product d × e that is all rounding, for an edge along the ray, moves a hit far
            self.condition = 1 / number.sqrt(number.roundoff)
        self.flat = not closed
        first, second, third = vertices
        arms = subtract(second, first), subtract(third, first)
        self.size = max(map(largest, arms))
        self.normal = normalise(cross(*arms), number.sqrt)
        self.row = (*vertices, self)

    def bounds(self):
        return corners(self.row[:3])

    def surface(self, origin, direction, t, _face):
        """Point and normal of the hit at distance t (TRI-2)."""
        normal = self.normal
        p = add(origin, scale(direction, t))
        point = subtract(p, scale(normal, dot(subtract(p, self.row[0]), normal)))
        return point, scale(normal, -1) if self.flat and not dot(direction, normal) < 0 else normal


def triangles(vertices, indices, *rest):
    """The Triangles of one mesh that have an area: the others have no normal, and no ray meets them."""
    for row in indices:
        a, b, c = (vertices[i] for i in row)
        normal = cross(subtract(b, a), subtract(c, a))
        if dot(normal, normal) > 0:
            yield Triangle((a, b, c), *rest)


@lru_cache(maxsize=1)  # one ray is tested against many groups of triangles
def shear(direction):
    """(k_x, k_y, k_z, S_x, S_y, S_z) of TRI-1."""
    sizes = [abs(x) for x in direction]
    kz = sizes.index(max(sizes))
    kx, ky = (kz + 1) % 3, (kz + 2) % 3
    if direction[kz] < 0:
        kx, ky = ky, kx
    return kx, ky, kz, direction[kx] / direction[kz], direction[ky] / direction[kz], 1 / direction[kz]


def nearest(rows, origin, direction, best, _sqrt):
    """The nearest hit closer than `best` = (t, shape, face), or `best` (TRI-1)."""
    kx, ky, kz, sx, sy, sz = shear(direction)
    ox, oy, oz = origin[kx], origin[ky], origin[kz]
    limit = best[0]
    for va, vb, vc, triangle in rows:
        az, bz, cz = va[kz] - oz, vb[kz] - oz, vc[kz] - oz
        bx, by = vb[kx] - ox - sx * bz, vb[ky] - oy - sy * bz
        cx, cy = vc[kx] - ox - sx * cz, vc[ky] - oy - sy * cz
        u = cx * by - cy * bx
        ax, ay = va[kx] - ox - sx * az, va[ky] - oy - sy * az
        v = ax * cy - ay * cx
        if u * v < 0:
            continue
        w = bx * ay - by * ax
        if not ((u >= 0 and v >= 0 and w >= 0) or (u <= 0 and v <= 0 and w <= 0)):
            continue
        det = u + v + w
        if det == 0:
            continue
        t = (u * (sz * az) + v * (sz * bz) + w * (sz * cz)) / det
        if 0 < t < limit:
            limit = t
            best = t, triangle, None
    return best


def moller_trumbore(rows, origin, direction, best, _sqrt):
    """As `nearest`, by Möller and Trumbore 1997 (TRI-3)."""
    ox, oy, oz = origin
    dx, dy, dz = direction
    limit = best[0]
    for (ax, ay, az), (bx, by, bz), (cx, cy, cz), triangle in rows:
        ex, ey, ez = bx - ax, by - ay, bz - az
        fx, fy, fz = cx - ax, cy - ay, cz - az
        px, py, pz = dy * fz - dz * fy, dz * fx - dx * fz, dx * fy - dy * fx
        det = ex * px + ey * py + ez * pz
        if det == 0:
            continue
        tx, ty, tz = ox - ax, oy - ay, oz - az
        u = (tx * px + ty * py + tz * pz) / det
        if not u >= 0:
            continue
        qx, qy, qz = ty * ez - tz * ey, tz * ex - tx * ez, tx * ey - ty * ex
        v = (dx * qx + dy * qy + dz * qz) / det
        if v >= 0 and u + v <= 1:
            t = (fx * qx + fy * qy + fz * qz) / det
            if 0 < t < limit:
                limit = t
                best = t, triangle, None
    return best


SEARCHES = {"watertight": nearest, "moller-trumbore": moller_trumbore}


def crossings(rows, origin, direction):
    """The boundaries (t, shape, face) of a closed mesh on the whole line, in the order of its triangles (CSG-2)."""
    kx, ky, kz, sx, sy, sz = shear(direction)
    ox, oy, oz = origin[kx], origin[ky], origin[kz]
    found = []
    for va, vb, vc, triangle in rows:
        az, bz, cz = va[kz] - oz, vb[kz] - oz, vc[kz] - oz
        ax, ay = va[kx] - ox - sx * az, va[ky] - oy - sy * az
        bx, by = vb[kx] - ox - sx * bz, vb[ky] - oy - sy * bz
        cx, cy = vc[kx] - ox - sx * cz, vc[ky] - oy - sy * cz
        u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
        side = positive(u, cx - bx, cy - by)
        if side != positive(v, ax - cx, ay - cy) or side != positive(w, bx - ax, by - ay):
            continue
        det = u + v + w
        if abs(det) > 0:  # NUM-5: a NaN is no crossing
            found.append(((u * (sz * az) + v * (sz * bz) + w * (sz * cz)) / det, triangle, None))
    return found


def positive(edge_function, x, y):
    """Its sign; where it is 0, that of the edge (x, y) (CSG-2)."""
    if edge_function == 0:
        return y > 0 or (y == 0 and x > 0)
    return edge_function > 0
