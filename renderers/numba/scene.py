"""The scene in the form that the kernel reads, and the searches over all its shapes."""

from collections import namedtuple

from . import needs
from .needs import BOX, CSG, ELLIPSOID, FAR, MESH, POLYGON, SPHERE, STREAMED, TREE
from .shapes.box import any_box, box_surface, hit_box, nearest_box
from .shapes.bvh import enter, slopes
from .shapes.csg import any_csg, csg_surface, hit_csg, nearest_csg
from .shapes.ellipsoid import any_ellipsoid, ellipsoid_surface, hit_ellipsoid, nearest_ellipsoid
from .shapes.mesh import aimed, any_triangle, hit_triangle, nearest_triangle, triangle_surface
from .shapes.polygon import any_polygon, hit_polygon, nearest_polygon, polygon_surface
from .shapes.sphere import any_sphere, hit_sphere, nearest_sphere, sphere_surface
from .target import kernel
from .vector import largest

# What the kernel reads, and whether this job needs it. All numbers are of the job's precision, lengths in the scene's
# unit. The n shapes count on from spheres to boxes, polygons, ellipsoids, triangles and CSG solids: the order of HIT-2.
FIELDS = {
    "camera": True,  # (4, 3): C, u, v, e
    "sample": True,  # (2,): place in the pixel
    "colours": True,  # (2, 3), linear RGB: ambient light, background
    "epsilon": True,  # of OFF-1
    "lights": needs.LIT,  # (L, 7): position, linear RGB, radius
    "materials": True,  # (M, 11): diffuse linear RGB, k_s, m, index, mu_r, attenuation RGB, 1 if clear; AIR is the last
    "ids": True,  # int32 (n, 4): object, row of materials, rank (MED-2) or -1, 1 if flat
    "sizes": True,  # (n,): size of OFF-1, but of CSG solids
    "spheres": SPHERE,  # (S, 4): centre, radius
    "boxes": BOX,  # (B, 10, 3): see box.py
    "polygon_corners": POLYGON,  # (V, 3, 3): see polygon.py
    "polygon_ranges": POLYGON,  # int32 (P, 2): first corner, number
    "ellipsoids": ELLIPSOID,  # (E, 7, 3): see ellipsoid.py
    "triangles": MESH,  # (T, 4, 3): see mesh.py
    "csg_spheres": CSG,  # parts of CSG solids, as the shapes above
    "csg_boxes": CSG,
    "csg_ellipsoids": CSG,
    "csg_triangles": CSG and MESH,
    "csg_meshes": CSG and MESH,  # int32 (n, 2): first triangle, number
    "csg_bounds": CSG and MESH and TREE,  # trees over the parts that are meshes, as the one over the shapes below
    "csg_links": CSG and MESH and TREE,
    "csg_items": CSG and MESH and TREE,
    "csg_roots": CSG and MESH and TREE,  # int32 (n,): root of each
    "csg_reaches": CSG and MESH and TREE,  # (n,): largest coordinate of each
    "csg_code": CSG,  # int32 (K, 2): postfix, as in the contract
    "csg_ranges": CSG,  # int32 (C, 2): first row of csg_code, number
    "csg_sizes": CSG,  # (K,): size of the part, if it is none of a mesh
    "csg_triangle_sizes": CSG and MESH,
    "sliver": CSG,  # of CSG-4
    "media": needs.MEDIA,  # int32 (n,): row of materials for each rank
    "eye_media": needs.MEDIA,  # the set that eye rays begin in, bit r for rank r
    "precedence": needs.TOUCHING,  # int32 (n,), of each shape (MED-7); (0,) where nothing touches
    "extents": needs.TOUCHING,  # (n,): size of each shape, of a CSG solid that of its largest part
    "largest_extent": needs.TOUCHING,
    "cutoff": needs.CUTOFF,  # of CUT-1
    "infinite": needs.FAST,  # the bits of inf, as an integer
    "shadows": needs.ASK_SHADOWS,  # whether there are any; the next six are such answers too
    "lensed": needs.ASK_LENS,
    "adapted": needs.ASK_SAMPLER,
    "single": needs.ASK_SAMPLER,
    "jittered": needs.ASK_SAMPLER,
    "sequenced": needs.ASK_SAMPLER,
    "numbered": needs.ASK_NUMBERS,
    "lens": needs.LENS,  # (2, 3): the lens's radius along u and along v
    "focus": needs.LENS,  # δ of LEN-1
    "feelers": needs.SOFT,  # F of SOF-1
    "glossy_rays": needs.GLOSSY,  # G of GLO-1
    "seed": needs.RANDOM,
    "matrices": needs.SOBOL,  # uint32 (64, 32), and dimensions as SOB-1 has them: the next three
    "first_light": needs.SOBOL,
    "each_order": needs.SOBOL,
    "light_dimensions": needs.SOBOL,
    "samples": needs.SUPERSAMPLING,  # of a pixel
    "row_length": needs.SUPERSAMPLING,  # n of SAM-1, and of SAM-3 samples of a row
    "levels": needs.ADAPTIVE,  # D of SAM-4
    "threshold": needs.ADAPTIVE,  # τ of SAM-4
    "tree_bounds": TREE,  # (N, 2, 3): lower and upper corner of each node; these and the next two: see bvh.py
    "tree_links": TREE,
    "tree_items": TREE,
    "tree_loose": TREE,  # int32: shapes outside the tree
    "tree_pad": TREE,  # what rounding can do, relative
    "tree_reach": TREE,  # largest coordinate of the tree
    # Work memory, one block for each thread: the only arrays that the kernel writes.
    "walk_reals": needs.WALK in ("stack", "table"),  # see walk.py
    "walk_integers": needs.WALK in ("stack", "table"),
    "csg_reals": CSG,  # see csg.py
    "csg_integers": CSG,
    "csg_values": CSG,
    "csg_stack": CSG and MESH and TREE,
    "csg_overflow": CSG,  # not 0 if a line crossed a mesh too often (CSG-6)
    "tree_stack": TREE,
    "tree_entries": TREE,
    "corners": needs.ADAPTIVE,  # (h + 1, w + 1, 3), of the picture's pixels, for all threads; the next four: sample.py
    "lattice": needs.ADAPTIVE,
    "lattice_marks": needs.ADAPTIVE,
    "quarters": needs.ADAPTIVE,
    "squares": needs.ADAPTIVE,
    "dropped": needs.CUTOFF,  # (h, w): of each of the picture's pixels, for all threads (CUT-2)
    # Tiles of the tables of shapes, in the shared memory of a block: see gpu/tiles.py.
    "sphere_tile": STREAMED and SPHERE,
    "box_tile": STREAMED and BOX,
    "polygon_tile": STREAMED and POLYGON,  # corners
    "polygon_range_tile": STREAMED and POLYGON,
    "ellipsoid_tile": STREAMED and ELLIPSOID,
    "triangle_tile": STREAMED and MESH,
}
Scene = namedtuple("Scene", [name for name, needed in FIELDS.items() if needed])

# The last kind of shape that there is needs no test whether a shape is of it.
LAST_IS_MESH = not CSG
LAST_IS_ELLIPSOID = LAST_IS_MESH and not MESH
LAST_IS_POLYGON = LAST_IS_ELLIPSOID and not ELLIPSOID
LAST_IS_BOX = LAST_IS_POLYGON and not POLYGON
LAST_IS_SPHERE = LAST_IS_BOX and not BOX

# Columns of the table of materials, after the three of the diffuse colour.
SPECULAR, EXPONENT, INDEX, PERMEABILITY, ATTENUATED, CLEAR, LOBE = 3, 4, 5, 6, 7, 10, 11

# Columns of the table of ids.
OBJECT, MATERIAL, RANK, FLAT = range(4)

# Rows of the table of colours.
AMBIENT, BACKGROUND = 0, 1


@kernel
def hit_shape(scene, thread, index, origin, direction, aim, limit):
    """Distance to shape `index`, which may be negative; FAR for a miss.

    aim: of `aimed`, if there are polygons or meshes.
    """
    i = index
    if SPHERE:
        if LAST_IS_SPHERE or i < len(scene.spheres):
            return hit_sphere(scene.spheres, i, origin, direction)
        i -= len(scene.spheres)
    if BOX:
        if LAST_IS_BOX or i < len(scene.boxes):
            return hit_box(scene.boxes, i, origin, direction)[0]
        i -= len(scene.boxes)
    if POLYGON:
        if LAST_IS_POLYGON or i < len(scene.polygon_ranges):
            return hit_polygon(scene.polygon_corners, scene.polygon_ranges, i, origin, direction, limit, aim)
        i -= len(scene.polygon_ranges)
    if ELLIPSOID:
        if LAST_IS_ELLIPSOID or i < len(scene.ellipsoids):
            return hit_ellipsoid(scene.ellipsoids, i, origin, direction)
        i -= len(scene.ellipsoids)
    if MESH:
        if LAST_IS_MESH or i < len(scene.triangles):
            return hit_triangle(scene.triangles, i, aim)
        i -= len(scene.triangles)
    if CSG:
        return hit_csg(scene, thread, i, origin, direction)
    return type(limit)(FAR)


@kernel
def search(scene, thread, origin, direction, best, any_will_do):
    """Distance to the nearest shape not farther than `best`, or to any nearer than that, and its number; -1 for a miss.

    Of shapes at equal distance it is the first (HIT-2), in whatever order the tree shows them.
    """
    stack, entries = scene.tree_stack, scene.tree_entries
    bounds = scene.tree_bounds
    ray = slopes(origin, direction, scene.tree_pad * max(largest(origin), scene.tree_reach))
    aim = aimed(origin, direction) if POLYGON or MESH else 0
    index, node, height = -1, 0, 0
    if CSG:
        for k in range(len(scene.tree_loose)):
            i = scene.tree_loose[k]
            t = hit_shape(scene, thread, i, origin, direction, aim, best)
            if t > 0 and t < best:
                if any_will_do:
                    return t, i
                best, index = t, i
    if len(scene.tree_items) == 0 or enter(bounds, 0, ray, best) < 0:
        return best, index
    while True:
        first, count = scene.tree_links[node, 0], scene.tree_links[node, 1]
        if count == 0:
            near, far = first, first + 1
            t0, t1 = enter(bounds, near, ray, best), enter(bounds, far, ray, best)
            if t1 >= 0 and (t0 < 0 or t1 < t0):
                near, far, t0, t1 = far, near, t1, t0
            if t0 >= 0:
                if t1 >= 0:
                    stack[thread, height], entries[thread, height] = far, t1
                    height += 1
                node = near
                continue
        for k in range(first, first + count):
            i = scene.tree_items[k]
            t = hit_shape(scene, thread, i, origin, direction, aim, best)
            if t > 0 and t <= best and (t < best or i < index):
                if any_will_do:
                    return t, i
                best, index = t, i
        while height > 0 and entries[thread, height - 1] > best:
            height -= 1
        if height == 0:
            return best, index
        height -= 1
        node = stack[thread, height]


if STREAMED:
    from .gpu.tiles import nearest_in_tiles


@kernel
def nearest(scene, thread, origin, direction):
    """Distance to the nearest shape and its number; FAR and -1 for a miss (HIT-1, HIT-2)."""
    best, index, first = type(direction[0])(FAR), -1, 0
    if TREE:
        return search(scene, thread, origin, direction, best, False)
    if STREAMED:
        best, index, first = nearest_in_tiles(scene, origin, direction, best)
        if CSG:
            best, index = nearest_csg(scene, thread, origin, direction, best, index, first)
        return best, index
    if SPHERE:
        best, index = nearest_sphere(scene.spheres, origin, direction, best, index, first)
        first += len(scene.spheres)
    if BOX:
        best, index = nearest_box(scene.boxes, origin, direction, best, index, first)
        first += len(scene.boxes)
    if POLYGON:
        corners, ranges = scene.polygon_corners, scene.polygon_ranges
        best, index = nearest_polygon(corners, ranges, origin, direction, best, index, first)
        first += len(ranges)
    if ELLIPSOID:
        best, index = nearest_ellipsoid(scene.ellipsoids, origin, direction, best, index, first)
        first += len(scene.ellipsoids)
    if MESH:
        best, index = nearest_triangle(scene.triangles, origin, direction, best, index, first)
        first += len(scene.triangles)
    if CSG:
        best, index = nearest_csg(scene, thread, origin, direction, best, index, first)
    return best, index


@kernel
def surface(scene, thread, index, origin, direction, t):
    """Point (HIT-4), normal (HIT-3) and size (OFF-1) of the hit at `t` on the shape `index`."""
    i = index
    size = scene.sizes[index]
    if SPHERE:
        if LAST_IS_SPHERE or i < len(scene.spheres):
            point, normal = sphere_surface(scene.spheres, i, origin, direction, t)
            return point, normal, size
        i -= len(scene.spheres)
    if BOX:
        if LAST_IS_BOX or i < len(scene.boxes):
            point, normal = box_surface(scene.boxes, i, origin, direction)
            return point, normal, size
        i -= len(scene.boxes)
    if POLYGON:
        if LAST_IS_POLYGON or i < len(scene.polygon_ranges):
            corners, ranges = scene.polygon_corners, scene.polygon_ranges
            point, normal = polygon_surface(corners, ranges, i, origin, direction, t)
            return point, normal, size
        i -= len(scene.polygon_ranges)
    if ELLIPSOID:
        if LAST_IS_ELLIPSOID or i < len(scene.ellipsoids):
            point, normal = ellipsoid_surface(scene.ellipsoids, i, origin, direction, t)
            return point, normal, size
        i -= len(scene.ellipsoids)
    if MESH:
        if LAST_IS_MESH or i < len(scene.triangles):
            flat = scene.ids[index, FLAT] == 1
            point, normal = triangle_surface(scene.triangles, i, origin, direction, t, flat)
            return point, normal, size
        i -= len(scene.triangles)
    if CSG:
        return csg_surface(scene, thread, i, origin, direction)
    return origin, direction, size


@kernel
def occluded(scene, thread, origin, direction, limit):
    """Whether a feeler is stopped before `limit` (HIT-5)."""
    if TREE:
        return search(scene, thread, origin, direction, limit, True)[1] >= 0
    if STREAMED:
        if nearest_in_tiles(scene, origin, direction, limit)[1] >= 0:
            return True
        return CSG and any_csg(scene, thread, origin, direction, limit)
    if SPHERE and any_sphere(scene.spheres, origin, direction, limit):
        return True
    if BOX and any_box(scene.boxes, origin, direction, limit):
        return True
    if POLYGON and any_polygon(scene.polygon_corners, scene.polygon_ranges, origin, direction, limit):
        return True
    if ELLIPSOID and any_ellipsoid(scene.ellipsoids, origin, direction, limit):
        return True
    if MESH and any_triangle(scene.triangles, origin, direction, limit):
        return True
    return CSG and any_csg(scene, thread, origin, direction, limit)
