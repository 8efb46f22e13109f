"""The scene in the form that the kernel in lanes reads: the Scene of one ray after another, and tables for packets."""

from collections import namedtuple

import numpy as np

from .. import load as tables
from .. import needs
from .. import scene as scalar
from ..shapes import box, ellipsoid, mesh, polygon
from . import rays, spheres
from .lanes import COUNT

SIDE = 32  # of a tile, in pixels

# Kinds of surfaces. A plane is a side of a box, a polygon or a triangle.
SPHERE, PLANE, ELLIPSOID, SOLID = range(4)

# A face is what a ray can hit: a sphere, each side of a box, a polygon, an ellipsoid, a triangle, a CSG solid, in the
# order of HIT-2. Rows of the table of faces, a column each: a point of the plane, or the centre; size of OFF-1 (of a
# sphere its radius); the normal of a plane. Rows of the table of their links: column of the tables of roles; number
# among ellipsoids or solids.
PLACE, SIZE, NORMAL = 0, 3, 4
ROLE, NUMBER = 0, 1

# A role is what faces have in common. Rows of its tables: diffuse colour, k_s, m, N and M of REF-1 in AIR for a ray
# from outside and from inside, 1 if clear, kind, 1 if flat (POL-3), exponent of the lobe or -1 (GLO-2); rank (MED-2) or
# -1, row of materials.
DIFFUSE, SPECULAR, EXPONENT, FROM_OUTSIDE, FROM_INSIDE, CLEAR, KIND, FLAT, LOBE = 0, 3, 4, 5, 7, 9, 10, 11, 12
RANK, MATERIAL = 0, 1

# Rows of the table of optics, a column for each row of materials: index, μ_r, and log2 of the attenuation (ATT-1).
INDEX, PERMEABILITY, ATTENUATION = 0, 1, 2

OTHERS = needs.BOX or needs.POLYGON or needs.ELLIPSOID or needs.MESH or needs.CSG
SPHERES_ALONE = not OTHERS  # then each has a role of its own, of the same number: one look-up less for every hit

# Numbers of the job's precision, but for integers. Of the n shapes, S are spheres and O others.
FIELDS = {
    "eye": True,  # (1, 3): C + e. These six are rows of `camera` and `colours`, each a version of `row` for itself
    "u": True,
    "v": True,
    "e": True,
    "background": True,
    "ambient": True,
    "sphere_columns": needs.SPHERE,  # (6, S and more): see spheres.py
    "sphere_numbers": needs.SPHERE,  # int32 (1, S and more): 0, 1, ..
    "ball_columns": OTHERS,  # (4, O and more): centre and radius of a ball around each shape that is no sphere
    "ball_numbers": OTHERS,  # int32 (1, O and more): 0, 1, ..
    "first_faces": True,  # int32 (n,): of each shape
    "faces": True,  # (7, F)
    "links": True,  # int32 (2, F)
    "roles": True,  # (13, R)
    "role_ids": True,  # int32 (2, R)
    "ellipsoid_columns": needs.ELLIPSOID,  # (21, E): the numbers of each row of `ellipsoids`
    "optics": needs.MEDIA or needs.ATTENUATION,  # (5, M)
    # Work memory, a block for each thread.
    "seen_spheres": needs.SPHERE,  # as `sphere_columns`, of those that the tile can see
    "seen_sphere_numbers": needs.SPHERE,
    "seen_balls": OTHERS,  # as `ball_numbers`
    "rays": True,  # (threads, rows, rays and more): those that wait; see rays.py
    "places": True,  # int32, likewise
    "progress": True,  # int64 (threads, 2, orders and more): rays of each order that wait, and that have been read
    "light": True,  # (threads, 3, pixels and more): of the tile's samples
    "lines": needs.SUPERSAMPLING,  # likewise: of rows of samples (SAM-3)
    "losses": needs.CUTOFF,  # (threads, 1, pixels and more): their dropped weight (CUT-2)
    # Of adaptive samples, with `lattice` and `squares` for all pixels in work: P points, S squares.
    "work_width": needs.ADAPTIVE,  # of the pixels that a thread has in work
    "work_height": needs.ADAPTIVE,
    "points": needs.ADAPTIVE,  # int32 (threads, 2, pixels and more): a and b of those that are traced together (SAM-4)
    "lattice_known": needs.ADAPTIVE,  # bool (threads, P): points whose colours `lattice` (threads, P, 3) has, or will
    "wanted": needs.ADAPTIVE,  # int32 (threads, P): those that are to be traced
    "means": needs.ADAPTIVE,  # (threads, S, 3): of `squares`, int32 (threads, S, 5): pixel, a, b, side, first quarter
}
Scene = namedtuple("Scene", [*scalar.Scene._fields, *(name for name, needed in FIELDS.items() if needed)])


def tiles(job):
    """The largest number of tiles of a pass over the region: of adaptive samples the corners of pixels have one too."""
    x0, y0, x1, y1 = job.region
    if not needs.ADAPTIVE:
        return -(-(x1 - x0) // SIDE) * -(-(y1 - y0) // SIDE)
    sizes = (SIDE, SIDE), work_size(job.adaptive_depth)
    return max(-(-(x1 + 1 - x0) // across) * -(-(y1 + 1 - y0) // down) for across, down in sizes)


def work_size(levels):
    """Width and height of the pixels in work: as many as have 65,536 points of the lattice, 32 by 16 at most."""
    most = max(1, 2**16 // ((1 << levels) + 1) ** 2)
    height = min(max(most // 16, 1), 16)
    return min(most // height, 32), height


def adaptive_work(threads, levels, real):
    """Work memory of adaptive samples (SAM-4), by field of the Scene."""
    across, down = work_size(levels)
    points = across * down * ((1 << levels) + 1) ** 2
    squares = across * down * (4 ** (levels + 1) - 1) // 3
    return {
        "work_width": across,
        "work_height": down,
        "points": np.zeros((threads, 2, SIDE * SIDE + COUNT), np.int32),
        "lattice": np.zeros((threads, points, 3), real),
        "lattice_known": np.zeros((threads, points), np.bool_),
        "wanted": np.zeros((threads, points), np.int32),
        "squares": np.zeros((threads, squares, 5), np.int32),
        "means": np.zeros((threads, squares, 3), real),
    }


def scene_of(values):
    """The Scene of its fields by name."""
    return Scene(**{name: values[name] for name in Scene._fields})


def load(job, real, threads):
    """Fields of the Scene of as many threads by name, but the tree, which `build` of the module load adds."""
    values = tables.load(job, real, threads)
    low, high = values["bounds"].low, values["bounds"].high
    if not needs.TREE:
        del values["bounds"]

    def block(rows, columns, dtype=real):
        return np.zeros((threads, rows, columns + COUNT), dtype)  # lanes may be read and written beyond the end

    def wide(table):
        return np.ascontiguousarray(np.pad(table, ((0, 0), (0, COUNT))), real)

    camera, colours, balls = values["camera"], values["colours"], np.load(job.array("spheres"))
    count, others, pixels = len(balls), len(low) - len(balls), SIDE * SIDE
    orders, columns = rays.orders(job.depth), max(pixels, 2 * COUNT * rays.children(job.glossy_rays))
    lanes = {
        "eye": (np.load(job.array("camera"))[:1] + np.load(job.array("camera"))[3:]).astype(real),
        "u": camera[1:2],
        "v": camera[2:3],
        "e": camera[3:],
        "background": colours[1:],
        "ambient": colours[:1],
        "sphere_columns": wide(columns_of_spheres(balls, np.finfo(real).eps)),
        "sphere_numbers": np.arange(count + COUNT, dtype=np.int32)[None],
        "ball_columns": wide(columns_of_balls(low[count:], high[count:], np.finfo(real).eps)),
        "ball_numbers": np.arange(others + COUNT, dtype=np.int32)[None],
        "ellipsoid_columns": np.ascontiguousarray(values["ellipsoids"].reshape(-1, 21).T),
        "optics": np.ascontiguousarray(optics(np.load(job.array("materials")), np.load(job.array("air"))), real),
        "seen_spheres": block(spheres.ROWS, count),
        "seen_sphere_numbers": block(1, count, np.int32),
        "seen_balls": block(1, others, np.int32),
        "rays": block(orders * rays.REALS, columns),
        "places": block(orders * rays.INTEGERS, columns, np.int32),
        "progress": block(2, job.depth + 2, np.int64),
        "light": block(3, pixels),
        "lines": block(3, pixels),
        "losses": block(1, pixels),
    }
    if needs.ADAPTIVE:
        lanes |= adaptive_work(threads, job.adaptive_depth, real)
    return values | lanes | faces(values, np.load(job.array("materials")), np.load(job.array("air")), real)


def columns_of_spheres(balls, eps):
    """A ray whose b is below BEHIND is outside and moves away: |b| ≤ |f|, but for some u, and inside |f| ≤ r."""
    radius = balls[:, 3]
    return np.vstack([balls.T, radius**2, -(1 + 32 * eps) * radius])


def columns_of_balls(low, high, eps):
    """Of balls around boxes with the corners `low` and `high` (n, 3); one without bounds is everywhere.

    Centres and vertices are then rounded: by less than 4 eps of their coordinates, together.
    """
    bounded = (np.isfinite(low) & np.isfinite(high)).all(axis=1)
    low, high = np.where(bounded[:, None], low, -1), np.where(bounded[:, None], high, 1)
    radius = (1 + 1e-5) * np.linalg.norm(high - low, axis=1) / 2
    radius += 4 * eps * np.maximum(np.abs(low), np.abs(high)).max(axis=1)
    return np.vstack([(low / 2 + high / 2).T, np.where(bounded, radius, np.inf)])


def optics(materials, air):
    """Of the materials, and of AIR as the last row."""
    rows = np.vstack([materials[:, 5:10], np.concatenate([air[2:], air[:2]])])
    clear = rows[:, :3].any(axis=1)
    with np.errstate(divide="ignore"):
        attenuation = np.log2(np.where(clear[:, None], rows[:, :3], 1))  # what is opaque attenuates nothing
    return np.column_stack([np.sqrt(rows[:, 3] * rows[:, 4]), rows[:, 4], attenuation]).T


def faces(values, materials, air, real):
    """The tables of faces and roles by name. values: the other fields by name, with the tables of all shapes."""
    ids, sizes = values["ids"], values["sizes"]
    spheres, boxes, ellipsoids, triangles = (values[name] for name in ("spheres", "boxes", "ellipsoids", "triangles"))
    corners = values["polygon_corners"][values["polygon_ranges"][:, 0]]
    solids = np.zeros((len(values["csg_ranges"]), 3), real)
    low = boxes[:, None, box.CORNER].repeat(3, axis=1)
    high, normals = low + boxes[:, box.EDGE : box.EDGE + 3], boxes[:, box.NORMAL : box.NORMAL + 3]
    sides = np.stack([low, high], axis=2).reshape(-1, 3)
    # Of each kind of shape: kind of surface, faces of a shape, points and normals of all faces.
    kinds = [
        (SPHERE, 1, spheres[:, :3], None),
        (PLANE, 6, sides, np.stack([-normals, normals], axis=2).reshape(-1, 3)),
        (PLANE, 1, corners[:, polygon.VERTEX], corners[:, polygon.NORMAL]),
        (ELLIPSOID, 1, ellipsoids[:, ellipsoid.CENTRE], None),
        (PLANE, 1, triangles[:, mesh.VERTEX], triangles[:, mesh.NORMAL]),
        (SOLID, 1, solids, None),
    ]
    shapes = [len(places) // faces for _, faces, places, _ in kinds]
    each = np.repeat([faces for _, faces, _, _ in kinds], shapes)
    kind = np.repeat([kind for kind, _, _, _ in kinds], shapes)
    number = np.concatenate([np.arange(count) for count in shapes])
    places = np.concatenate([places for _, _, places, _ in kinds])
    normals = np.concatenate([np.zeros_like(places) if n is None else n for _, _, places, n in kinds])
    of_face = np.repeat(np.arange(len(ids)), each)
    keys = np.column_stack([ids[:, scalar.MATERIAL], ids[:, scalar.RANK], kind, ids[:, scalar.FLAT]])
    roles, role = (keys, np.arange(len(keys))) if SPHERES_ALONE else np.unique(keys, axis=0, return_inverse=True)
    material, rank, kind, flat = roles.T
    found = materials[material]
    index, permeability = np.sqrt(found[:, 8] * found[:, 9]), found[:, 9]
    n, m = np.sqrt(air[0] * air[1]) / index, air[1] / permeability
    clear = found[:, 5:8].any(axis=1)
    rows = [*found[:, :3].T, found[:, 3], found[:, 4], n, m, 1 / n, 1 / m, clear, kind, flat]
    if needs.GLOSSY:
        rows.append(values["materials"][material, scalar.LOBE])
    tables = {
        "first_faces": np.cumsum(each) - each,
        "faces": np.vstack([places.T, sizes[of_face], normals.T]),
        "links": np.vstack([role.reshape(-1)[of_face], number[of_face]]),
        "roles": np.vstack(rows),
        "role_ids": np.vstack([rank, material]),
    }
    return {
        name: np.ascontiguousarray(table, real if name in ("faces", "roles") else np.int32)
        for name, table in tables.items()
    }
