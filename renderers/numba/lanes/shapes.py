"""Boxes, polygons, ellipsoids and triangles, each against a packet of rays."""

import math

from ..shapes.box import CORNER
from ..shapes.box import RECIPROCAL as BOX_RECIPROCAL
from ..shapes.ellipsoid import CENTRE
from ..shapes.ellipsoid import RECIPROCAL as ELLIPSOID_RECIPROCAL
from ..shapes.polygon import GRAZING, NORMAL, VERTEX
from ..target import kernel
from ..vector import UNIT_ROUNDOFF, row_of, subtract
from .lanes import any_of, select, spread
from .vector import along, dot

SLACK = 128 * UNIT_ROUNDOFF  # more than the square of a distance loses to rounding

# A distance is that of the nearest hit in front of the ray; not above 0, or NaN, for a miss.


@kernel
def hit_box(boxes, i, origin, direction):
    """Distance to box `i`, and the face: 2 axis, plus 1 on the high side (BOX-1)."""
    most = math.inf
    enter, leave = spread(-most), spread(most)
    face_in, face_out = spread(0), spread(0)
    from_corner = subtract(origin, row_of(boxes, i, CORNER))
    for axis in range(3):
        g = row_of(boxes, i, BOX_RECIPROCAL + axis)
        s, w = dot(from_corner, g), dot(direction, g)
        inverse = 1.0 / w
        down, still = w < 0.0, w == 0.0
        low, high = -s * inverse, (1.0 - s) * inverse
        near, far = select(down, high, low), select(down, low, high)
        if any_of(still):
            within = (s >= 0.0) & (s <= 1.0)
            near = select(still, select(within, spread(-most), most), near)
            far = select(still, select(within, spread(most), -most), far)
        side = select(down, spread(2 * axis + 1), 2 * axis)
        later, sooner = near > enter, far < leave
        enter, face_in = select(later, near, enter), select(later, side, face_in)
        leave, face_out = select(sooner, far, leave), select(sooner, side ^ 1, face_out)
    outside = enter > 0.0
    t = select(enter <= leave, select(outside, enter, leave), 0.0)
    return t, select(outside, face_in, face_out)


@kernel
def to_sphere(ellipsoids, i, v):
    """The vectors `v` where ellipsoid `i` is the unit sphere."""
    first = ELLIPSOID_RECIPROCAL
    x, y = dot(v, row_of(ellipsoids, i, first)), dot(v, row_of(ellipsoids, i, first + 1))
    return x, y, dot(v, row_of(ellipsoids, i, first + 2))


@kernel
def hit_ellipsoid(ellipsoids, i, origin, direction):
    """Distance to ellipsoid `i` (ELL-1)."""
    f = to_sphere(ellipsoids, i, subtract(origin, row_of(ellipsoids, i, CENTRE)))
    d = to_sphere(ellipsoids, i, direction)
    a, b = dot(d, d), -dot(f, d)
    l = along(f, b / a, d)  # noqa: E741
    delta = 1.0 - dot(l, l)
    t, near = spread(0.0), delta >= 0.0
    if any_of(near):
        k, s = dot(f, f) - 1.0, math.sqrt(a * delta)
        inside, ahead = ~(k > 0.0), b >= 0.0
        t = select(inside & ahead, (b + s) / a, k / select(inside, b - s, b + s))
        t = select(near & (inside | (b > 0.0)), t, 0.0)
    return t


@kernel
def turned(axes, a):
    """The components of `a`, that along the ray's axis last (TRI-1)."""
    x, y = axes
    first = select(x, a[1], select(y, a[2], a[0]))
    return first, select(x, a[2], select(y, a[0], a[1])), select(x, a[0], select(y, a[1], a[2]))


@kernel
def shear(origin, direction):
    """The rays' data for TRI-1: masks of the axis x and y, of rays down their axis, S, and the origin."""
    x, y, z = abs(direction[0]), abs(direction[1]), abs(direction[2])
    axes = ~(y > x) & ~(z > x), (y > x) & ~(z > y)
    d = turned(axes, direction)
    swapped = d[2] < 0.0
    p, q = d[0] / d[2], d[1] / d[2]
    return axes, swapped, (select(swapped, q, p), select(swapped, p, q), 1.0 / d[2]), origin


@kernel
def sheared(triangles, i, k, ray):
    """Vertex `k` of triangle `i` seen along the rays (TRI-1).

    Products are not fused: U of one triangle must be that of its neighbour with the other sign.
    """
    axes, swapped, s, origin = ray
    a = turned(axes, subtract(row_of(triangles, i, k), origin))
    x, y = select(swapped, a[1], a[0]), select(swapped, a[0], a[1])
    return x - s[0] * a[2], y - s[1] * a[2], s[2] * a[2]


@kernel
def hit_triangle(triangles, i, ray):
    """Distance to triangle `i` (TRI-1). ray: of `shear`."""
    a, b, c = sheared(triangles, i, 0, ray), sheared(triangles, i, 1, ray), sheared(triangles, i, 2, ray)
    u, v, w = c[0] * b[1] - c[1] * b[0], a[0] * c[1] - a[1] * c[0], b[0] * a[1] - b[1] * a[0]
    det = u + v + w
    one_side = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0))
    met = one_side & (det != 0.0)
    t = spread(0.0)
    if any_of(met):
        t = select(met, (u * a[2] + v * b[2] + w * c[2]) / det, 0.0)
    return t


@kernel
def hit_polygon(corners, ranges, i, origin, direction, limit, ray):
    """Distance to polygon `i` if below `limit` (POL-1, POL-2). ray: of `shear`."""
    first, end = ranges[i, 0], ranges[i, 0] + ranges[i, 1]
    vertex, normal = row_of(corners, first, VERTEX), row_of(corners, first, NORMAL)
    slope, height = dot(direction, normal), -dot(subtract(origin, vertex), normal)
    t = height / slope
    grazes = (abs(slope) < GRAZING) & (slope != 0.0)
    met = ((t > 0.0) & (t < limit)) | grazes
    if any_of(met):
        a, b = sheared(corners, first, VERTEX, ray), sheared(corners, first + 1, VERTEX, ray)
        w, inside = a[0] * b[1] - a[1] * b[0], met & ~met
        for k in range(first + 2, end):
            c = sheared(corners, k, VERTEX, ray)
            u, v = b[0] * c[1] - b[1] * c[0], c[0] * a[1] - c[1] * a[0]
            det = u + v + w
            one_side = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0))
            crossed = one_side & (det != 0.0)
            if any_of(crossed & grazes):
                t = select(crossed & grazes, (u * a[2] + v * b[2] + w * c[2]) / det, t)
            inside = inside | crossed
            w, b = -v, c
        x, y, z = abs(vertex[0]) + abs(origin[0]), abs(vertex[1]) + abs(origin[1]), abs(vertex[2]) + abs(origin[2])
        rounding = 8.0 * UNIT_ROUNDOFF * dot((x, y, z), (abs(normal[0]), abs(normal[1]), abs(normal[2])))
        met = met & inside & (abs(height) > rounding)
    return select(met, t, 0.0)


@kernel
def near_ball(balls, i, origin, direction):
    """The lanes whose ray may meet ball `i`: rows x, y, z and radius."""
    radius = balls[3, i]
    f = subtract(origin, (balls[0, i], balls[1, i], balls[2, i]))
    b, far = -dot(f, direction), dot(f, f)
    l = along(f, b, direction)  # noqa: E741
    square = radius * radius
    return (dot(l, l) <= square + SLACK * (square + far)) & ((b >= 0.0) | (far <= 4.0 * square))
