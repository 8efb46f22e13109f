"""Lays out a job's scene as the kernel reads it: a table of numbers, one of integers, and where in them is what.

kernel/scene.h has the columns of the tables and the names of the layout.
"""

import math
import re
from pathlib import Path

import numpy as np

from . import bounds, bvh

SOURCE = Path(__file__).parent / "kernel" / "scene.h"
SAMPLERS = ("one", "uniform", "jittered", "adaptive", "sobol")
SHAPES = ("sphere", "box", "polygon", "ellipsoid", "mesh", "csg")  # in the order of HIT-2
MOST_OF_MESH = 64  # crossings of a line with one mesh (CSG-6)
MESH_PART, OPERATORS = 3, 4  # of csg_code
POLYGON, CORNER = 4, 6  # numbers of each (kernel/scene.h)


def layout_names():
    """Returns the names of Layout in scene.h, in their order."""
    text = re.sub(r"//.*", "", SOURCE.read_text(encoding="utf-8"))
    body = text[text.index("{") : text.index("} Layout;")]
    return re.findall(r"\w+(?=[,;])", body)


class Tables:
    """Tables of one type, one after the other."""

    def __init__(self, dtype):
        self.dtype, self.parts, self.size = dtype, [], 0

    def add(self, table):
        """Returns where the table begins."""
        place = self.size
        self.parts.append(np.asarray(table).ravel().astype(self.dtype))
        self.size += self.parts[-1].size
        return place

    def joined(self):
        """All of them; never empty, as a device has no buffer of 0 bytes."""
        return np.concatenate([*self.parts, np.zeros(1, self.dtype)])

    def nbytes(self):
        """Bytes of `joined`."""
        return (self.size + 1) * self.dtype(0).nbytes


class Scene:
    """A job's scene, all numbers rounded once to the type `real` (NUM-1).

    layout: integers by the names of scene.h. crossings, parts: the most that a CSG solid has. corners: of a polygon.
    """

    def __init__(self, job, real):
        self.real, self.numbers, self.integers = real, Tables(real), Tables(np.int32)
        self.layout = dict.fromkeys(layout_names(), 0)
        read = {path.stem: np.load(path) for path in Path(job.folder).glob("*.npy")}
        self.numbers.add(_head(read, job, real))
        self._take_job(job)
        self._take_light(job, read)
        self.part_boxes = self._take_parts(read)
        self.boxes = self._take_shapes(read)
        self._take_roles(read)
        self._take_contact(read)
        if job.sampler == "sobol":
            self._take_sequence(job, read)
        if job.sphere in ("textbook", "stable"):  # whose roots err by more than any padding (HIT-6)
            self.always[: len(read["spheres"])] = True
            self.always[self._kinds == SHAPES.index("ellipsoid")] = True

    def size(self):
        """Bytes of both tables."""
        return self.numbers.nbytes() + self.integers.nbytes()

    def corners_in(self, size):
        """The most corners of a polygon that a tile of so many bytes holds, with what else there is of it."""
        return (size // self.real(0).nbytes - POLYGON) // CORNER

    def work(self):
        """Work of trying all shapes, in spheres."""
        return 4 * self.layout["shapes"] - 3 * self.layout["spheres"]

    def part_work(self):
        """The same of the largest mesh that is a part of a solid."""
        return 4 * max((len(low) for low, _ in self.part_boxes), default=0)

    def build(self):
        """Builds the hierarchies of all shapes and of the meshes in CSG solids (HIT-6)."""
        loose, inside = np.flatnonzero(self.always), np.flatnonzero(~self.always)
        trees = [self._tree([side[inside] for side in self.boxes], inside)] if len(inside) else []
        first = 0
        roots = []
        for low, high in self.part_boxes:
            roots.append(sum(len(nodes) for nodes, _, _ in trees))
            trees.append(self._tree((low, high), first + np.arange(len(low))))
            first += len(low)
        nodes, links, items = [], [], []
        made = placed = 0
        for of_tree, link, item in trees:
            link[:, 0] += np.where(link[:, 1] > 0, placed, made).astype(np.int32)
            made, placed = made + len(of_tree), placed + len(item)
            nodes.append(of_tree), links.append(link), items.append(item)
        self.layout |= {
            "tree_at": self.numbers.add(np.concatenate(nodes) if nodes else []),
            "links_at": self.integers.add(np.concatenate(links) if nodes else []),
            "items_at": self.integers.add(np.concatenate(items) if nodes else []),
            "in_tree": len(inside),
            "loose": len(loose),
            "loose_at": self.integers.add(loose),
            "roots_at": self.integers.add(roots),
        }

    def packed_layout(self):
        """The Layout as the kernel gets it: int32 in the order of scene.h."""
        return np.array([self.layout[name] for name in layout_names()], np.int64).astype(np.uint32).view(np.int32)

    def _tree(self, boxes, numbers):
        low, high = bounds.padded(*boxes, self.real)
        nodes, links, order = bvh.build(low, high)
        return _outward(nodes, self.real), links, numbers[order]

    def _take_job(self, job):
        x0, y0, x1, y1 = job.region
        self.layout |= {"width": job.width, "height": job.height, "x0": x0, "y0": y0, "x1": x1, "y1": y1}
        self.layout |= {
            "depth": job.depth,
            "shadows": int(job.shadows),
            "feelers": job.feelers if "soft" in job.needs else 0,
            "glossy_rays": job.glossy_rays,
            "study_weight": int(job.glossy_weight == "study"),
            "seed": job.seed,
            "sampler": SAMPLERS.index(job.sampler),
            **_samples(job),
            "levels": job.adaptive_depth if job.sampler == "adaptive" else 0,
            "lens": int(job.lens_radius > 0),
        }

    def _take_sequence(self, job, read):
        """The dimensions of purposes, and what makes the points of them (SOB-1, SOB-2)."""
        lights = read["lights"]
        soft = job.shadows and "soft" in job.needs and job.feelers > 0 and (lights[:, 6] > 0).any()
        of_lights = 2 * len(lights) if soft else 0
        self.layout |= {
            "sobol_at": self.integers.add(read["sobol"].view(np.int32)),
            "first_light": 4 if job.lens_radius > 0 else 2,
            "each_order": of_lights + (2 if job.glossy_rays > 0 else 0),
            "light_dimensions": of_lights,
        }

    def _take_light(self, job, read):
        media = read["media"]
        eye = sum(1 << rank for rank, row in enumerate(media) if row[2])
        self.layout |= {
            "lights": len(read["lights"]),
            "lights_at": self.numbers.add(read["lights"]),
            "materials_at": self.numbers.add(_materials(read["materials"], read["air"], "glossy" in job.needs)),
            "air": len(read["materials"]),
            "media_at": self.integers.add(media[:, 1]),
            "eye_low": eye & 0xFFFFFFFF,
            "eye_high": eye >> 32,
        }

    def _take_parts(self, read):
        """The parts of CSG solids. Returns lower and upper corners of the triangles of each mesh."""
        spheres, boxes, ellipsoids = (read[f"csg_{name}"] for name in ("spheres", "boxes", "ellipsoids"))
        meshes, code, ranges = read["csg_meshes"], read["csg_code"], read["csg_ranges"]
        triangles = read["mesh_triangles"][_rows_of(meshes)]
        firsts = np.cumsum(meshes[:, 1]) - meshes[:, 1]
        self.layout |= {
            "solids": len(ranges),
            "solids_at": self.integers.add(ranges),
            "code_at": self.integers.add(code),
            "part_spheres_at": self.numbers.add(spheres),
            "part_boxes_at": self.numbers.add(_box_table(boxes)),
            "part_ellipsoids_at": self.numbers.add(_ellipsoid_table(ellipsoids)),
            "part_triangles_at": self.numbers.add(_triangle_table(read["mesh_vertices"], triangles, 1)),
            "part_meshes_at": self.integers.add(np.column_stack([firsts, meshes[:, 1]])),
        }
        crossings = np.where(code[:, 0] < MESH_PART, 2, 0)
        of_mesh = code[:, 0] == MESH_PART
        crossings[of_mesh] = np.minimum(meshes[code[of_mesh, 1], 1], MOST_OF_MESH)
        self.crossings = max((int(crossings[first : first + count].sum()) for first, count in ranges), default=1)
        self.parts = max((int(count) for _, count in ranges), default=1)

        low, high = bounds.of_corners(read["mesh_vertices"][triangles])
        slices = [slice(first, first + count) for first, count in zip(firsts, meshes[:, 1], strict=True)]
        of_parts = [(low[rows], high[rows]) for rows in slices]
        self._bounds_of_parts = [
            bounds.of_spheres(spheres),
            bounds.of_boxes(boxes),
            bounds.of_ellipsoids(ellipsoids),
            ([one.min(axis=0) for one, _ in of_parts], [one.max(axis=0) for _, one in of_parts]),
        ]
        skewed = [np.zeros(len(spheres), bool), _skewed(boxes), _skewed(ellipsoids), np.zeros(len(meshes), bool)]
        self._always_of_solids = [
            any(kind < OPERATORS and skewed[kind][row] for kind, row in code[first : first + count])
            for first, count in ranges
        ]
        return of_parts

    def _take_shapes(self, read):
        """Returns lower and upper corners (n, 3) of all shapes; notes which of them no hierarchy may have."""
        spheres, boxes, ellipsoids = read["spheres"], read["boxes"], read["ellipsoids"]
        vertices, ranges = read["polygon_vertices"], read["polygon_ranges"]
        polygons, corners = _polygon_tables(vertices, ranges)
        meshes = read["mesh_ranges"]
        triangles = read["mesh_triangles"][_rows_of(meshes)]
        closed = np.repeat(meshes[:, 2], meshes[:, 1])
        numbers = {
            "spheres": spheres,
            "boxes": _box_table(boxes),
            "polygons": polygons,
            "ellipsoids": _ellipsoid_table(ellipsoids),
            "triangles": _triangle_table(read["mesh_vertices"], triangles, closed),
        }
        self.layout |= {name: len(table) for name, table in numbers.items()}
        self.layout |= {f"{name}_at": self.numbers.add(table) for name, table in numbers.items()}
        firsts = np.cumsum(ranges[:, 1]) - ranges[:, 1]
        self.corners = int(ranges[:, 1].max(initial=0))
        self.layout["corners_at"] = self.numbers.add(corners)
        self.layout["polygon_ranges_at"] = self.integers.add(np.column_stack([firsts, ranges[:, 1]]))

        solids = read["csg_ranges"]
        each = [
            (bounds.of_spheres(spheres), np.zeros(len(spheres), bool)),
            (bounds.of_boxes(boxes), _skewed(boxes)),
            (bounds.of_ranges(vertices, ranges), np.zeros(len(ranges), bool)),
            (bounds.of_ellipsoids(ellipsoids), _skewed(ellipsoids)),
            (bounds.of_corners(read["mesh_vertices"][triangles]), np.zeros(len(triangles), bool)),
            (bounds.of_solids(read["csg_code"], solids, self._bounds_of_parts), self._always_of_solids),
        ]
        self.layout["shapes"] = sum(len(always) for _, always in each)
        self.always = np.concatenate([np.asarray(always, bool) for _, always in each])
        self._kinds = np.repeat(np.arange(len(SHAPES)), [len(always) for _, always in each])
        return tuple(np.concatenate([box[side] for box, _ in each]) for side in (0, 1))

    def _take_roles(self, read):
        """Object, material, rank and flatness of each shape; a triangle has those of its mesh."""
        meshes = read["mesh_ranges"]
        ids = {name: read[f"{name}_ids"] for name in SHAPES}
        flat = {name: np.zeros(len(ids[name]), int) for name in SHAPES}
        flat["polygon"][:] = 1
        flat["mesh"] = np.repeat(1 - meshes[:, 2], meshes[:, 1])
        ids["mesh"] = np.repeat(ids["mesh"], meshes[:, 1], axis=0)
        of_object = {number: rank for rank, number in enumerate(read["media"][:, 0].tolist())}
        table, flat = np.concatenate(list(ids.values())), np.concatenate(list(flat.values()))
        rank = np.array([of_object.get(number, -1) for number in table[:, 0].tolist()], int)
        self.layout["roles_at"] = self.integers.add(np.column_stack([table, np.where(flat, -1, rank), flat]))

    def _take_contact(self, read):
        """Precedence of all shapes, and their sizes: of a CSG solid that of its largest part (MED-6)."""
        precedence, code = read["precedence"], read["csg_code"]
        self.layout["touching"] = int(len(precedence) > 0)
        if not len(precedence):
            return
        counts = read["mesh_ranges"][:, 1]
        ids = [read[f"{name}_ids"] for name in SHAPES]
        ids[SHAPES.index("mesh")] = np.repeat(read["mesh_ids"], counts, axis=0)
        parts = np.zeros(len(code))
        vertices, triangles = read["mesh_vertices"], read["mesh_triangles"]
        of_kinds = [read["csg_spheres"][:, 3], _across(read["csg_boxes"]), _across(read["csg_ellipsoids"])]
        of_kinds.append([_sides(vertices[triangles[first : first + n]]).max() for first, n in read["csg_meshes"]])
        for kind, sizes in enumerate(of_kinds):
            parts[code[:, 0] == kind] = np.asarray(sizes)[code[code[:, 0] == kind, 1]]
        polygons = [read["polygon_vertices"][first : first + n] for first, n in read["polygon_ranges"]]
        extents = [
            read["spheres"][:, 3],
            _across(read["boxes"]),
            [np.abs(vertices - vertices[0]).max() for vertices in polygons],
            _across(read["ellipsoids"]),
            _sides(vertices[triangles[_rows_of(read["mesh_ranges"])]]),
            [parts[first : first + count].max() for first, count in read["csg_ranges"]],
        ]
        extents = np.concatenate(extents)
        self.layout["precedence_at"] = self.integers.add(precedence[np.concatenate(ids)[:, 0]])
        self.layout["extents_at"] = self.numbers.add([*extents, extents.max(initial=0)])


def _samples(job):
    """How many a pixel has, and a row of them (SAM-1 to SAM-3, SAM-7)."""
    if job.sampler == "sobol":
        return {"samples": job.spp, "row_length": math.isqrt(job.spp - 1) + 1}
    n = 1 if job.sampler == "one" else job.samples
    return {"samples": n * n, "row_length": n}


def _across(shapes):
    """Size of boxes or ellipsoids (OFF-1)."""
    return np.abs(shapes[:, 3:]).max(axis=1, initial=0)


def _sides(triangles):
    """Size of triangles (n, 3, 3) (OFF-1)."""
    return np.abs(triangles - triangles[:, :1]).max(axis=(1, 2), initial=0)


def _head(read, job, real):
    """The numbers at the start of the table."""
    centre, u, v, e = read["camera"]
    lens = [job.lens_radius * axis / np.linalg.norm(axis) for axis in (u, v)]
    unit = np.finfo(real).eps / 2  # u of NUM-2
    numbers = [job.focal_distance / np.linalg.norm(e), job.epsilon, job.sliver or 16 * unit]
    numbers += [job.cutoff if job.cutoff > 0 else -1, job.adaptive_threshold]  # -1: below any weight
    return np.concatenate([centre + e, u, v, e, *lens, read["ambient"], read["background"], job.sample, numbers])


def _materials(materials, air, glossy):
    """The columns that the kernel reads, with AIR as the last row. What is opaque attenuates nothing (ATT-1).

    glossy: whether the kernel has lobes.
    """
    rows = np.vstack([materials, [*np.zeros(5), *air[2:], *air[:2], 0]])
    clear = rows[:, 5:8].any(axis=1)
    attenuates = clear & (rows[:, 5:8] != 1).any(axis=1)
    rough = rows[:, 10] > 0
    lobes = np.where(rough, 2 / np.where(rough, rows[:, 10], 1) ** 2 - 2, -1)  # GLO-2; -1: of a perfect mirror
    indices = np.sqrt(rows[:, 8] * rows[:, 9])  # REF-1
    return np.column_stack([rows[:, :5], indices, rows[:, 9], rows[:, 5:8], attenuates, clear, *([lobes] * glossy)])


def _axes(shapes):
    """Three vectors (n, 3, 3) of boxes or ellipsoids, and their reciprocals g, with g_a · e_b = 1 if a = b, else 0."""
    e = shapes[:, 3:].reshape(-1, 3, 3)
    g = np.stack([np.cross(e[:, (a + 1) % 3], e[:, (a + 2) % 3]) for a in range(3)], axis=1)
    return e, g / np.sum(e[:, 0] * g[:, 0], axis=1)[:, None, None]


def _skewed(shapes):
    return bounds.skewed(*_axes(shapes))


def _box_table(boxes):
    e, g = _axes(boxes)
    normals = g / np.linalg.norm(g, axis=2, keepdims=True)
    size = np.abs(e).max(axis=(1, 2), initial=0)
    return np.column_stack([boxes, g.reshape(-1, 9), normals.reshape(-1, 9), size])


def _ellipsoid_table(ellipsoids):
    e, g = _axes(ellipsoids)
    return np.column_stack([ellipsoids, g.reshape(-1, 9), np.abs(e).max(axis=(1, 2), initial=0)])


def _triangle_table(vertices, triangles, closed):
    v = vertices[triangles]
    normal = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    size = np.abs(v - v[:, :1]).max(axis=(1, 2), initial=0)
    return np.column_stack([v.reshape(-1, 9), normal, size, np.broadcast_to(closed, len(v))])


def _polygon_tables(vertices, ranges):
    """Normal and size of each polygon; place of each corner, and inward vector of its edge (POL-1, POL-2)."""
    polygons, corners = [np.zeros((0, POLYGON))], [np.zeros((0, CORNER))]
    for first, count in ranges:
        v = vertices[first : first + count]
        normal = np.cross(v - v[0], np.roll(v, -1, axis=0) - v[0]).sum(axis=0)
        normal /= np.linalg.norm(normal)
        polygons.append([[*normal, np.abs(v - v[0]).max()]])
        corners.append(np.column_stack([v, np.cross(normal, np.roll(v, -1, axis=0) - v)]))
    return np.concatenate(polygons), np.concatenate(corners)


def _rows_of(ranges):
    """The rows that ranges (n, ..) of first and number name, one range after the other."""
    return np.concatenate([np.arange(first, first + count) for first, count in ranges[:, :2]] + [np.zeros(0, np.int64)])


def _outward(nodes, real):
    """Boxes (N, 2, 3) rounded to the type, never inward."""
    rounded = nodes.astype(real)
    low, high = rounded[:, 0], rounded[:, 1]
    low[low > nodes[:, 0]] = np.nextafter(low[low > nodes[:, 0]], real(-np.inf))
    high[high < nodes[:, 1]] = np.nextafter(high[high < nodes[:, 1]], real(np.inf))
    return rounded
