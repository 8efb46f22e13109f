"""CSG solids: an expression in postfix over parts, met by the whole line of a ray in boundaries (CSG).

The boundaries of one solid lie in work memory of the thread: rows of `csg_reals` and `csg_integers`.
"""

from ..needs import CROSSINGS, FAR, LIMITED, MERGE, MESH, TREE
from ..target import called, kernel
from ..vector import along, dot, largest, negate
from .box import face_of_box, span_box
from .bvh import clip, slopes
from .ellipsoid import ellipsoid_surface, span_ellipsoid
from .mesh import cross_triangle, shear, triangle_surface
from .sphere import span_sphere, sphere_surface

# Operations of csg_code.
SPHERE, BOX, ELLIPSOID, SURFACE, OR, AND = range(6)

# Columns of csg_reals and of csg_integers.
DISTANCE, COSINE, SIZE = 0, 1, 2
PART, FACE, ENTERS = 0, 1, 2

KEEPS_ALL = MERGE == "none"


@kernel
def put(scene, thread, count, t, part, face):
    """Inserts a boundary behind those that are not farther (CSG-3); returns the number of boundaries."""
    reals, integers = scene.csg_reals, scene.csg_integers
    k = count
    while k > 0 and reals[thread, k - 1, DISTANCE] > t:
        reals[thread, k, DISTANCE] = reals[thread, k - 1, DISTANCE]
        integers[thread, k, PART] = integers[thread, k - 1, PART]
        integers[thread, k, FACE] = integers[thread, k - 1, FACE]
        k -= 1
    if TREE:  # which shows triangles in an order of its own
        while (
            k > 0 and reals[thread, k - 1, DISTANCE] == t and triangle_after(scene, integers, thread, k - 1, part, face)
        ):
            integers[thread, k, PART] = part
            integers[thread, k, FACE] = integers[thread, k - 1, FACE]
            reals[thread, k, DISTANCE] = t
            k -= 1
    reals[thread, k, DISTANCE] = t
    integers[thread, k, PART], integers[thread, k, FACE] = part, face
    return count + 1


@kernel
def triangle_after(scene, integers, thread, k, part, face):
    """Whether boundary `k` is of the same mesh as a face, and of a later triangle."""
    same = integers[thread, k, PART] == part and scene.csg_code[part, 0] == SURFACE
    return same and integers[thread, k, FACE] > face


@kernel
def put_triangles(scene, thread, count, limit, part, ray, triangles, first, last):
    """The boundaries of the triangles from `first` to `last`: rows of `triangles`, if there is a tree."""
    for k in range(first, last):
        i = triangles[k] if TREE else k
        t = cross_triangle(scene.csg_triangles, i, ray)
        if t < FAR:
            if count == limit:
                return -1
            count = put(scene, thread, count, t, part, i)
    return count


@kernel
def put_mesh(scene, thread, count, origin, direction, part, mesh):
    """The boundaries of a mesh; the number of boundaries after them, -1 if there are too many (CSG-6)."""
    limit = count + CROSSINGS if LIMITED else scene.csg_reals.shape[1]
    ray = shear(origin, direction)
    if not TREE:
        first = scene.csg_meshes[mesh, 0]
        return put_triangles(scene, thread, count, limit, part, ray, 0, first, first + scene.csg_meshes[mesh, 1])
    bounds, links, stack = scene.csg_bounds, scene.csg_links, scene.csg_stack
    infinity = type(direction[0])(FAR)
    line = slopes(origin, direction, scene.tree_pad * max(largest(origin), scene.csg_reaches[mesh]))
    stack[thread, 0] = scene.csg_roots[mesh]
    height = 1
    while height > 0:
        height -= 1
        node = stack[thread, height]
        start, end = clip(bounds, node, line, -infinity, infinity)
        if start <= end:
            first, number = links[node, 0], links[node, 1]
            if number == 0:
                stack[thread, height], stack[thread, height + 1] = first, first + 1
                height += 2
            else:
                last = first + number
                count = put_triangles(scene, thread, count, limit, part, ray, scene.csg_items, first, last)
                if count < 0:
                    return count
    return count


@kernel
def put_parts(scene, thread, first, last, origin, direction):
    """All boundaries of the parts of a solid (CSG-1); how many, -1 if there are too many."""
    count = 0
    for part in range(first, last):
        kind, i = scene.csg_code[part, 0], scene.csg_code[part, 1]
        t0, t1, face0, face1 = type(direction[0])(FAR), -type(direction[0])(FAR), 0, 0
        if kind == SPHERE:
            t0, t1 = span_sphere(scene.csg_spheres, i, origin, direction)
        elif kind == BOX:
            t0, t1, face0, face1 = span_box(scene.csg_boxes, i, origin, direction)
        elif kind == ELLIPSOID:
            t0, t1 = span_ellipsoid(scene.csg_ellipsoids, i, origin, direction)
        if MESH and kind == SURFACE:
            count = put_mesh(scene, thread, count, origin, direction, part, i)
            if count < 0:
                return count
        if t0 <= t1:
            count = put(scene, thread, count, t0, part, face0)
            count = put(scene, thread, count, t1, part, face1)
    return count


@kernel
def value(scene, thread, first, last):
    """Value of the expression, 1 inside, from those of its parts: `csg_values` from 0 on, with a stack behind them."""
    values, top = scene.csg_values, last - first - 1
    for k in range(first, last):
        operation = scene.csg_code[k, 0]
        if operation <= SURFACE:
            top += 1
            values[thread, top] = values[thread, k - first]
        elif operation == OR:
            top -= 1
            values[thread, top] |= values[thread, top + 1]
        elif operation == AND:
            top -= 1
            values[thread, top] &= values[thread, top + 1]
        else:
            values[thread, top] ^= 1
    return values[thread, top]


@kernel
def part_surface(scene, part, face, origin, direction, t):
    """Point, outward normal and size of a part's face at `t`."""
    kind, i = scene.csg_code[part, 0], scene.csg_code[part, 1]
    size = scene.csg_sizes[part]
    if MESH and kind == SURFACE:
        point, normal = triangle_surface(scene.csg_triangles, face, origin, direction, t, False)
        return point, normal, scene.csg_triangle_sizes[face]
    if kind == SPHERE:
        point, normal = sphere_surface(scene.csg_spheres, i, origin, direction, t)
    elif kind == BOX:
        point, normal = face_of_box(scene.csg_boxes, i, face, origin, direction, t)
    else:
        point, normal = ellipsoid_surface(scene.csg_ellipsoids, i, origin, direction, t)
    return point, normal, size


@called
def first_boundary(scene, thread, solid, origin, direction):
    """Row of the boundary that is the hit (CSG-3 to CSG-5); -1 for a miss. Too many crossings are marked (CSG-6)."""
    reals, integers, values = scene.csg_reals, scene.csg_integers, scene.csg_values
    first = scene.csg_ranges[solid, 0]
    last = first + scene.csg_ranges[solid, 1]
    count = put_parts(scene, thread, first, last, origin, direction)
    if LIMITED and count < 0:
        scene.csg_overflow[thread, 0] = 1
    for k in range(last - first):
        values[thread, k] = 0
    inside = value(scene, thread, first, last)
    kept = 0  # rows before this one are boundaries of the solid; none is behind the one that is looked at
    for k in range(count):
        t, part, face = reals[thread, k, DISTANCE], integers[thread, k, PART], integers[thread, k, FACE]
        values[thread, part - first] ^= 1
        if value(scene, thread, first, last) == inside:
            continue
        inside ^= 1
        if KEEPS_ALL:  # CSG-4
            reals[thread, kept, DISTANCE] = t
            integers[thread, kept, PART], integers[thread, kept, FACE] = part, face
            integers[thread, kept, ENTERS] = inside
            kept += 1
            continue
        _, normal, size = part_surface(scene, part, face, origin, direction, t)
        cosine = abs(dot(direction, normal))
        if kept > 0:
            before = reals[thread, kept - 1, DISTANCE]
            scale = max(largest(along(origin, before, direction)), max(reals[thread, kept - 1, SIZE], size))
            scale = max(scale, largest(origin))
            if t - before <= scene.sliver * scale / min(reals[thread, kept - 1, COSINE], cosine):
                kept -= 1
                continue
        reals[thread, kept, DISTANCE], reals[thread, kept, COSINE], reals[thread, kept, SIZE] = t, cosine, size
        integers[thread, kept, PART], integers[thread, kept, FACE] = part, face
        integers[thread, kept, ENTERS] = inside
        kept += 1
    for k in range(kept):
        if reals[thread, k, DISTANCE] > 0:
            return k
    return -1


@kernel
def hit_csg(scene, thread, i, origin, direction):
    """Distance to solid `i`; FAR for a miss."""
    k = first_boundary(scene, thread, i, origin, direction)
    if k < 0:
        return type(direction[0])(FAR)
    return scene.csg_reals[thread, k, DISTANCE]


@kernel
def nearest_csg(scene, thread, origin, direction, best, index, first):
    """The nearer of the hit (`best`, `index`) so far and the solids', numbered from `first` (HIT-2)."""
    for i in range(len(scene.csg_ranges)):
        t = hit_csg(scene, thread, i, origin, direction)
        if t < best and t > 0:
            best, index = t, first + i
    return best, index


@kernel
def any_csg(scene, thread, origin, direction, limit):
    """HIT-5."""
    for i in range(len(scene.csg_ranges)):
        t = hit_csg(scene, thread, i, origin, direction)
        if t < limit and t > 0:
            return True
    return False


@kernel
def csg_surface(scene, thread, i, origin, direction):
    """Point, normal and size of the hit on solid `i` (CSG-5)."""
    k = first_boundary(scene, thread, i, origin, direction)
    t, part = scene.csg_reals[thread, k, DISTANCE], scene.csg_integers[thread, k, PART]
    point, normal, size = part_surface(scene, part, scene.csg_integers[thread, k, FACE], origin, direction, t)
    if (dot(direction, normal) < 0) != (scene.csg_integers[thread, k, ENTERS] == 1):
        return point, negate(normal), size
    return point, normal, size
