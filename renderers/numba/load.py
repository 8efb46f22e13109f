"""Loads the arrays of a job as the kernel's Scene."""

import math
from collections import namedtuple

import numpy as np

from renderers import worker

from . import needs
from .scene import Scene
from .shapes import bounds, bvh, quadratic
from .shapes.box import box_table
from .shapes.ellipsoid import ellipsoid_table
from .shapes.mesh import rows_of, triangle_table
from .shapes.polygon import polygon_table
from .trace import walk

TABLE_LIMIT = 2**31  # bytes (WLK-2)

# What the trees are built over: lower and upper corners (n, 3) of all shapes, and how skewed they are at most; likewise
# corners of the triangles of CSG solids, with the first and the number of each mesh.
Bounds = namedtuple("Bounds", ["low", "high", "skewness", "of_parts"])


def load(job, real, threads):
    """Fields of the Scene of as many threads by name, but the trees, which `build` adds."""
    values = tables(job, real)
    return values | {name: _block(threads, *block) for name, block in work(job, real, values).items()}


def scene_of(values):
    """The Scene of its fields by name."""
    return Scene(**{name: values[name] for name in Scene._fields})


def tables(job, real):
    """Fields of the Scene by name, but the trees and the work memory of threads.

    All numbers are rounded once to the type `real` (NUM-1).
    """

    def read(name):
        return np.load(job.array(name))

    def rounded(array):
        return np.ascontiguousarray(array, dtype=real)

    lights = read("lights")
    if not (job.shadows and job.feelers > 0):  # SOF-1: every light is a point
        lights[:, 6] = 0
    unit = np.finfo(real).eps / 2  # u of NUM-2
    values = {
        "camera": rounded(read("camera")),
        "sample": rounded(job.sample),
        "colours": rounded([read("ambient"), read("background")]),
        "epsilon": real(job.epsilon),
        "lights": rounded(lights),
        "materials": rounded(_materials(job, read("materials"), read("air"))),
        "feelers": job.feelers,
        "glossy_rays": max(1, job.glossy_rays),
        "seed": job.seed,
        **samples(job),
        "levels": job.adaptive_depth,
        "threshold": real(job.adaptive_threshold),
        "cutoff": real(job.cutoff if job.cutoff > 0 else -1),  # below any weight where nothing is cut off
        "shadows": job.shadows,
        "lensed": job.lens_radius > 0,
        "adapted": job.sampler == "adaptive",
        "single": job.sampler == "one",
        "jittered": job.sampler in ("jittered", "sobol"),
        "sequenced": job.sampler == "sobol",
        "numbered": job.lens_radius > 0 or job.sampler in ("jittered", "sobol"),
        "infinite": real(np.inf).view(np.int32 if real == np.float32 else np.int64),
    }
    shapes, sizes, found = _shapes(read)
    media = read("media")
    values |= {name: rounded(array) if array.dtype == np.float64 else array for name, array in shapes.items()}
    values |= {
        "ids": _ids(read, media),
        "sizes": rounded(sizes),
        "sliver": real(job.sliver or 16 * unit),
        "media": np.ascontiguousarray(media[:, 1]),
        "eye_media": sum(1 << rank for rank, (_, _, holds) in enumerate(media.tolist()) if holds),
    }
    if needs.TOUCHING:
        values |= _contact(read, shapes, sizes, values["ids"], rounded, real)
    if needs.SOBOL:
        values |= _sequence(job, read("sobol"), lights)
    if needs.LENS:
        values |= _lens(read("camera"), job, rounded, real)
    x0, y0, x1, y1 = job.region
    if needs.ADAPTIVE:
        asked = job.sampler == "adaptive"
        values["corners"] = np.zeros((y1 - y0 + 1, x1 - x0 + 1, 3) if asked else (1, 1, 3), real)
    if needs.CUTOFF:
        values["dropped"] = np.zeros((y1 - y0, x1 - x0), real)
    if needs.TREE or needs.VECTOR:
        values["bounds"] = found
    return values


def samples(job):
    """Returns how many a pixel has, and a row of them (SAM-1 to SAM-3, SAM-7)."""
    if job.sampler == "sobol":
        return {"samples": job.spp, "row_length": math.isqrt(job.spp - 1) + 1}
    n = 1 if job.sampler == "one" else job.samples
    return {"samples": n * n, "row_length": n}


def _sequence(job, matrices, lights):
    """The fields of SOB-1. lights: rows, of which those of points have the radius 0."""
    of_lights = 2 * len(lights) if lights[:, 6].any() else 0
    return {
        "matrices": matrices,
        "first_light": 4 if job.lens_radius > 0 else 2,
        "each_order": of_lights + (2 if job.glossy_rays > 0 else 0),
        "light_dimensions": of_lights,
    }


def build(values, real):
    """Put the trees (HIT-6) among the fields, in the place of the Bounds that they are built over."""
    found = values.pop("bounds")
    unit = np.finfo(real).eps / 2
    pad = 64 * unit
    if quadratic.QUADRATIC:  # r² errs by some u |f|², r then by the root of that
        pad = 16 * np.sqrt(unit)
    trees = _trees(*found.of_parts) | _tree(found.low, found.high)
    values |= {name: array.astype(real) if array.dtype == np.float64 else array for name, array in trees.items()}
    values["tree_pad"] = real(pad * found.skewness)
    values["tree_reach"] = real(np.abs(trees["tree_bounds"][0]).max())


def _materials(job, materials, air):
    """The columns that the kernel reads, with AIR as the last row. What is opaque attenuates nothing (ATT-1)."""
    air = np.concatenate([np.zeros(5), air[2:], air[:2], np.zeros(1)])
    rows = np.vstack([materials, air])
    clear = rows[:, 5:8].any(axis=1)
    attenuation = np.where(clear[:, None], rows[:, 5:8], 1)
    columns = [rows[:, :5], np.sqrt(rows[:, 8] * rows[:, 9]), rows[:, 9], attenuation, clear]
    return np.column_stack([*columns, lobes(job, rows)] if needs.GLOSSY else columns)


def lobes(job, materials):
    """Exponents of the lobes of materials, rows of materials.npy; -1 of a perfect mirror (GLO-1, GLO-2)."""
    rough = (materials[:, 10] > 0) & (job.glossy_rays > 0)
    return np.where(rough, 2 / np.where(rough, materials[:, 10], 1) ** 2 - 2, -1)


def _shapes(read):
    """The tables of all shapes by name, of each shape its size, and the Bounds."""
    spheres, boxes, ellipsoids = read("spheres"), read("boxes"), read("ellipsoids")
    vertices, ranges = read("polygon_vertices"), read("polygon_ranges")
    corners, polygon_sizes = polygon_table(vertices, ranges)
    mesh_vertices, mesh_triangles = read("mesh_vertices"), read("mesh_triangles")
    triangles, triangle_sizes = triangle_table(mesh_vertices, mesh_triangles[rows_of(read("mesh_ranges"))])
    tables = {
        "spheres": spheres,
        "boxes": box_table(boxes),
        "polygon_corners": corners,
        "polygon_ranges": ranges,
        "ellipsoids": ellipsoid_table(ellipsoids),
        "triangles": triangles,
    }
    parts, part_bounds, of_parts = _parts(read, mesh_vertices, mesh_triangles)
    solids = parts["csg_ranges"]
    each = [
        (spheres[:, 3], bounds.of_spheres(spheres)),
        (_axis_sizes(boxes), bounds.of_boxes(boxes)),
        (polygon_sizes, bounds.of_polygons(vertices, ranges)),
        (_axis_sizes(ellipsoids), bounds.of_ellipsoids(ellipsoids)),
        (triangle_sizes, bounds.of_triangles(triangles)),
        (np.zeros(len(solids)), bounds.of_solids(parts["csg_code"], solids, part_bounds)),
    ]
    low, high = (np.concatenate([both[side] for _, both in each]) for side in (0, 1))
    slanted = [tables["boxes"], tables["ellipsoids"], parts["csg_boxes"], parts["csg_ellipsoids"]]
    sizes = np.concatenate([size for size, _ in each])
    return tables | parts, sizes, Bounds(low, high, bounds.skewness(slanted), of_parts)


def _parts(read, vertices, triangles):
    """The tables of the parts of CSG solids by name, the bounds of the parts by kind, and those of Bounds."""
    spheres, boxes, ellipsoids = read("csg_spheres"), read("csg_boxes"), read("csg_ellipsoids")
    meshes, code = read("csg_meshes"), read("csg_code")
    table, triangle_sizes = triangle_table(vertices, triangles[rows_of(meshes)])
    sizes = np.zeros(len(code))
    for kind, of_kind in enumerate((spheres[:, 3], _axis_sizes(boxes), _axis_sizes(ellipsoids))):
        sizes[code[:, 0] == kind] = of_kind[code[code[:, 0] == kind, 1]]
    counts = meshes[:, 1]
    firsts = (np.cumsum(counts) - counts).astype(np.int32)
    low, high = bounds.of_triangles(table)
    of_meshes = [
        np.array([side(array[first : first + n], axis=0) for first, n in zip(firsts, counts, strict=True)])
        for side, array in ((np.min, low), (np.max, high))
    ]
    tables = {
        "csg_spheres": spheres,
        "csg_boxes": box_table(boxes),
        "csg_ellipsoids": ellipsoid_table(ellipsoids),
        "csg_triangles": table,
        "csg_meshes": np.ascontiguousarray(np.stack([firsts, counts], axis=1)),
        "csg_code": code,
        "csg_ranges": read("csg_ranges"),
        "csg_sizes": sizes,
        "csg_triangle_sizes": triangle_sizes,
    }
    of_kinds = [bounds.of_spheres(spheres), bounds.of_boxes(boxes), bounds.of_ellipsoids(ellipsoids), of_meshes]
    return tables, of_kinds, (low, high, firsts, counts)


def _trees(low, high, firsts, counts):
    """A tree over each mesh that is a part, all in the same arrays."""
    bounds, links, items, roots = [np.zeros((0, 2, 3))], [np.zeros((0, 2), np.int32)], [np.zeros(0, np.int32)], []
    made = 0
    for first, count in zip(firsts, counts, strict=True):
        nodes, link, order = bvh.build(low[first : first + count], high[first : first + count])
        leaf = link[:, 1] > 0
        link[:, 0] += np.where(leaf, first, made).astype(np.int32)
        roots.append(made)
        made += len(nodes)
        bounds.append(nodes)
        links.append(link)
        items.append(order + np.int32(first))
    bounds, roots = np.concatenate(bounds), np.array(roots, np.int32)
    return {
        "csg_bounds": bounds,
        "csg_links": np.concatenate(links),
        "csg_items": np.concatenate(items),
        "csg_roots": roots,
        "csg_reaches": np.abs(bounds[roots]).max(axis=(1, 2), initial=0),
    }


def _axis_sizes(shapes):
    """Size of boxes or ellipsoids (OFF-1)."""
    return np.abs(shapes[:, 3:]).max(axis=1, initial=0)


def _ids(read, media):
    """Object, material, rank and flatness of each shape; a triangle has those of its mesh."""
    meshes, ranges = read("mesh_ids"), read("mesh_ranges")
    names = ("sphere_ids", "box_ids", "polygon_ids", "ellipsoid_ids")
    parts = [*(read(name) for name in names), np.repeat(meshes, ranges[:, 1], axis=0), read("csg_ids")]
    nothing = [np.zeros(len(part), np.int32) for part in parts]
    nothing[2][:] = 1  # polygons, and open meshes
    nothing[4] = np.repeat(1 - ranges[:, 2], ranges[:, 1])
    ids, flat = np.concatenate(parts), np.concatenate(nothing)
    ranks = {number: rank for rank, number in enumerate(media[:, 0].tolist())}
    rank = np.array([ranks.get(number, -1) for number in ids[:, 0].tolist()])
    return np.column_stack([ids, rank, flat]).astype(np.int32)


def _contact(read, shapes, sizes, ids, rounded, real):
    """MED-6: precedence and extents of all shapes."""
    precedence, extents = read("precedence"), sizes.copy()
    code, meshes, of_triangles = shapes["csg_code"], shapes["csg_meshes"], shapes["csg_triangle_sizes"]
    of_parts = shapes["csg_sizes"].copy()
    for place in np.flatnonzero(code[:, 0] == 3):
        first, count = meshes[code[place, 1]]
        of_parts[place] = of_triangles[first : first + count].max()
    solids = shapes["csg_ranges"]
    for place, (first, count) in enumerate(solids, len(sizes) - len(solids)):
        extents[place] = of_parts[first : first + count].max()
    return {
        "precedence": np.ascontiguousarray(precedence[ids[:, 0]] if len(precedence) else precedence, np.int32),
        "extents": rounded(extents),
        "largest_extent": real(extents.max(initial=0)),
    }


def _lens(camera, job, rounded, real):
    """LEN-1."""
    _, u, v, e = camera
    axes = job.lens_radius * np.array([u / np.linalg.norm(u), v / np.linalg.norm(v)])
    return {"lens": rounded(axes), "focus": real(job.focal_distance / np.linalg.norm(e))}


def _tree(low, high):
    """The tree over all bounded shapes."""
    bounded = np.isfinite(low).all(axis=1)
    inside = np.flatnonzero(bounded)
    nodes, links, items = np.zeros((1, 2, 3)), np.zeros((1, 2), np.int32), np.zeros(0, np.int32)
    if len(inside):
        nodes, links, items = bvh.build(low[inside], high[inside])
    return {
        "tree_bounds": nodes,
        "tree_links": links,
        "tree_items": inside[items].astype(np.int32),
        "tree_loose": np.flatnonzero(~bounded).astype(np.int32),
    }


def work_of_walk(job, real):
    """`walk_rows` and `walk_bytes` of WLK-2, for the walks that have rows."""
    rows = walk.rows(job.depth, job.glossy_rays)
    if rows == 0:
        return {}
    size = rows * (walk.REALS * np.dtype(real).itemsize + walk.INTEGERS * 8)
    if size > TABLE_LIMIT:
        worker.refuse(f"walk {needs.WALK}: one pixel takes {size} bytes, more than {TABLE_LIMIT}")
    return {"walk_rows": rows, "walk_bytes": size}


def work(job, real, values):
    """Shape and type of a thread's work memory, by field of the Scene. values: of `tables`."""
    rows = walk.rows(job.depth, job.glossy_rays)
    code, ranges, meshes = values["csg_code"], values["csg_ranges"], values["csg_meshes"]
    crossings = np.where(code[:, 0] < 3, 2, 0)
    most = needs.CROSSINGS if needs.LIMITED else None
    crossings[code[:, 0] == 3] = meshes[code[code[:, 0] == 3, 1], 1].clip(max=most)
    boundaries = max((int(crossings[first : first + count].sum()) for first, count in ranges), default=1)
    cells = 1 << (job.adaptive_depth if needs.ADAPTIVE else 0)
    points = (cells + 1) ** 2 if needs.ADAPTIVE else 0
    blocks = {
        "walk_reals": ((rows, walk.REALS), real),
        "walk_integers": ((rows, walk.INTEGERS), np.int64),
        "csg_reals": ((boundaries, 3), real),
        "csg_integers": ((boundaries, 3), np.int32),
        "csg_values": ((2 * int(ranges[:, 1].max(initial=1)),), np.int32),
        "csg_stack": ((bvh.LEVELS + 1,), np.int32),
        "csg_overflow": ((1,), np.int64),
        "tree_stack": ((bvh.LEVELS,), np.int32),
        "tree_entries": ((bvh.LEVELS,), real),
        "lattice": ((points, 3), real),
        "lattice_marks": ((points + 1,), np.int64),
        "quarters": ((job.adaptive_depth + 1, 4, 3), real),
        "squares": ((job.adaptive_depth + 1, 3), np.int64),
    }
    return {name: block for name, block in blocks.items() if name in Scene._fields}


def _block(threads, shape, dtype):
    """Work memory: `shape` and a little more for each thread, so that no two of them share a cache line."""
    row = int(np.prod(shape[1:])) * np.dtype(dtype).itemsize
    return np.zeros((threads, shape[0] + -(-128 // row), *shape[1:]), dtype)
