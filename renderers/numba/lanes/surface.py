"""The surfaces that the rays of a packet hit: where, which way they face, of what they are."""

from ..needs import BOX, CSG, ELLIPSOID, MESH, POLYGON, SPHERE
from ..shapes.csg import csg_surface
from ..shapes.ellipsoid import AXIS, RECIPROCAL
from ..target import kernel
from ..vector import scale, subtract
from . import scene as tables
from .lanes import COUNT, any_of, fma, lane, put
from .memory import gather
from .search import spoil
from .vector import along, dot, gather_three, normalise, of_lane, put_three, select_three

PLANE = BOX or POLYGON or MESH
KINDS = SPHERE + PLANE + ELLIPSOID + CSG  # how many there are


@kernel
def on_sphere(place, size, ahead):
    """Point and normal (SPH-2). ahead: the point by its distance along the ray."""
    normal = normalise(subtract(ahead, place))
    return along(place, size, normal), normal


@kernel
def on_plane(scene, face, hit, place, ahead):
    """Point and normal (BOX-2, POL-3, TRI-2)."""
    normal = gather_three(scene.faces, tables.NORMAL, face, hit)
    return along(ahead, -dot(subtract(ahead, place), normal), normal), normal


@kernel
def combine(columns, first, number, hit, mu):
    """The sum of three vectors of ellipsoids, weighted by `mu`."""
    total = scale(mu[0], gather_three(columns, 3 * first, number, hit))
    total = along(total, mu[1], gather_three(columns, 3 * first + 3, number, hit))
    return along(total, mu[2], gather_three(columns, 3 * first + 6, number, hit))


@kernel
def on_ellipsoid(scene, face, hit, place, ahead):
    """Point and normal (ELL-2)."""
    columns, number = scene.ellipsoid_columns, gather(scene.links, tables.NUMBER, face, hit)
    f = subtract(ahead, place)
    x = dot(f, gather_three(columns, 3 * RECIPROCAL, number, hit))
    y = dot(f, gather_three(columns, 3 * RECIPROCAL + 3, number, hit))
    mu = normalise((x, y, dot(f, gather_three(columns, 3 * RECIPROCAL + 6, number, hit))))
    normal = normalise(combine(columns, RECIPROCAL, number, hit, mu))
    point = combine(columns, AXIS, number, hit, mu)
    return (place[0] + point[0], place[1] + point[1], place[2] + point[2]), normal


@kernel
def on_solid(scene, thread, face, hit, origin, direction, pixel, point, normal, size):
    """Point, normal and size of the hits on CSG solids (CSG-5), one after another; the others as they are."""
    number = gather(scene.links, tables.NUMBER, face, hit)
    for k in range(COUNT):
        if lane(hit, k):
            one, way = of_lane(origin, k), of_lane(direction, k)
            p, n, s = csg_surface(scene, thread, lane(number, k), one, way)
            point, normal, size = put_three(point, k, p), put_three(normal, k, n), put(size, k, s)
            spoil(scene, thread, lane(pixel, k))
    return point, normal, size


@kernel
def surface(scene, thread, face, hit, origin, direction, t, pixel):
    """Point (HIT-4), normal (HIT-3), the step of OFF-1 and the column of the roles, in the lanes of the mask `hit`."""
    role = face if tables.SPHERES_ALONE else gather(scene.links, tables.ROLE, face, hit)
    kind = gather(scene.roles, tables.KIND, role, hit)
    place, size = gather_three(scene.faces, tables.PLACE, face, hit), gather(scene.faces, tables.SIZE, face, hit)
    ahead = along(origin, t, direction)
    point, normal = ahead, direction
    if SPHERE and (KINDS == 1 or any_of(hit & (kind == tables.SPHERE))):
        point, normal = on_sphere(place, size, ahead)
    if PLANE:
        mine = hit & (kind == tables.PLANE)
        if KINDS == 1 or any_of(mine):
            p, n = on_plane(scene, face, mine, place, ahead)
            point, normal = select_three(mine, p, point), select_three(mine, n, normal)
    if ELLIPSOID:
        mine = hit & (kind == tables.ELLIPSOID)
        if KINDS == 1 or any_of(mine):
            p, n = on_ellipsoid(scene, face, mine, place, ahead)
            point, normal = select_three(mine, p, point), select_three(mine, n, normal)
    if POLYGON or MESH:
        away = ~(dot(direction, normal) < 0.0) & (gather(scene.roles, tables.FLAT, role, hit) != 0.0)
        normal = select_three(away, scale(-1.0, normal), normal)
    if CSG:
        mine = hit & (kind == tables.SOLID)
        if any_of(mine):
            point, normal, size = on_solid(scene, thread, face, mine, origin, direction, pixel, point, normal, size)
    error = fma(abs(normal[0]), abs(point[0]), fma(abs(normal[1]), abs(point[1]), abs(normal[2] * point[2])))
    return point, normal, scale(scene.epsilon * fma(0.125, error, size), normal), role
