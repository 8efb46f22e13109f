"""Triangles of meshes (TRI-1, TRI-2), and meshes as parts of CSG solids (CSG-1, CSG-2)."""

from functools import lru_cache

from .shape import Shape
from .vector import add, corners, cross, dot, largest, normalise, scale, subtract


class Triangle(Shape):
    """One triangle; `row` is what the search reads: the three vertices and itself."""

    row = None

    def __init__(self, vertices, closed, material, identity, number):
        super().__init__(material, identity)
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


def triangles(vertices, indices, closed, material, identity, number):
    """The triangles of one mesh that have an area: the others have no normal, and no ray meets them."""
    for row in indices:
        a, b, c = (vertices[i] for i in row)
        normal = cross(subtract(b, a), subtract(c, a))
        if dot(normal, normal) > 0:
            yield Triangle((a, b, c), closed, material, identity, number)


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
        if det != 0:
            found.append(((u * (sz * az) + v * (sz * bz) + w * (sz * cz)) / det, triangle, None))
    return found


def positive(edge_function, x, y):
    """Its sign; where it is 0, that of the edge (x, y) (CSG-2)."""
    if edge_function == 0:
        return y > 0 or (y == 0 and x > 0)
    return edge_function > 0
