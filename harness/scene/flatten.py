"""Flattens a scene to the arrays of a job (renderers/README.md)."""

import numpy as np

from harness.picture import colour
from harness.scene.contact import precedence
from harness.scene.media import media
from harness.scene.model import Box, Csg, Ellipsoid, Mesh, Operator, Polygon, Sphere

FLOAT = np.dtype("<f8")
INTEGER = np.dtype("<i4")
SPHERE, BOX, ELLIPSOID, MESH, OR, AND, NOT = range(7)  # words of csg_code
OPERATORS = {Operator.OR: OR, Operator.AND: AND, Operator.NOT: NOT}


def flatten(scene, arithmetic="linear"):
    """The arrays of a job by name, with the dtypes and shapes of the contract.

    arithmetic: "linear" makes colours linear (COL-2), "srgb" leaves them as they are written. Objects are numbered from
    0 in the order of the file. Equal materials share a row. UserError if there are too many media.
    """
    rows = {}
    for thing in scene.objects:
        rows.setdefault(thing.material, len(rows))

    def of(shape):
        return [(number, thing) for number, thing in enumerate(scene.objects) if type(thing) is shape]

    def ids(objects):
        return _table([(number, rows[thing.material]) for number, thing in objects], 2, INTEGER)

    spheres, boxes, polygons, ellipsoids, meshes, solids = map(of, (Sphere, Box, Polygon, Ellipsoid, Mesh, Csg))
    counts = [len(p.vertices) for _, p in polygons]
    firsts = np.cumsum([0, *counts])[:-1]
    triangles = _Triangles()
    ranges = [(*triangles.add(mesh), mesh.closed) for _, mesh in meshes]
    code = _Code(triangles)
    csg_ranges = [code.add(solid) for _, solid in solids]
    ranked = [(i, rows[scene.objects[i].material], eye) for i, eye in media(scene)]
    camera, air = scene.camera, scene.air
    lights = [(*light.position, *light.colour, light.radius) for light in scene.lights]
    materials = [(*m.diffuse, m.k_s, m.exponent, *m.attenuation, m.eps_r, m.mu_r, m.roughness) for m in rows]
    colours = {"linear": colour.decode_exactly, "srgb": np.asarray}[arithmetic]
    return {
        "camera": _table([camera.centre, camera.u, camera.v, camera.e], 3),
        "ambient": colours(np.array(scene.ambient, FLOAT)),
        "background": colours(np.array(scene.background, FLOAT)),
        "air": np.array([air.eps_r, air.mu_r, *air.attenuation], FLOAT),
        "lights": _coloured(_table(lights, 7), slice(3, 6), colours),
        "materials": _coloured(_table(materials, 11), slice(0, 3), colours),
        "spheres": _spheres(s for _, s in spheres),
        "boxes": _boxes(b for _, b in boxes),
        "polygon_vertices": _table([v for _, p in polygons for v in p.vertices], 3),
        "polygon_ranges": _table(list(zip(firsts, counts, strict=True)), 2, INTEGER),
        "ellipsoids": _ellipsoids(e for _, e in ellipsoids),
        "mesh_vertices": np.concatenate([np.empty((0, 3), FLOAT), *triangles.vertices]),
        "mesh_triangles": np.concatenate([np.empty((0, 3), INTEGER), *triangles.triangles]),
        "mesh_ranges": _table(ranges, 3, INTEGER),
        "csg_spheres": _spheres(code.parts[SPHERE]),
        "csg_boxes": _boxes(code.parts[BOX]),
        "csg_ellipsoids": _ellipsoids(code.parts[ELLIPSOID]),
        "csg_meshes": _table(code.parts[MESH], 2, INTEGER),
        "csg_code": _table(code.code, 2, INTEGER),
        "csg_ranges": _table(csg_ranges, 2, INTEGER),
        "sphere_ids": ids(spheres),
        "box_ids": ids(boxes),
        "polygon_ids": ids(polygons),
        "ellipsoid_ids": ids(ellipsoids),
        "mesh_ids": ids(meshes),
        "csg_ids": ids(solids),
        "media": _table(ranked, 3, INTEGER),
        "precedence": precedence(scene),
    }


class _Triangles:
    """Concatenates the triangles of all meshes: of objects first, then of parts of CSG solids."""

    def __init__(self):
        self.vertices, self.triangles = [], []
        self.vertex_count = self.triangle_count = 0

    def add(self, mesh):
        """Adds a mesh; returns the index of its first triangle, and the number of its triangles."""
        first, number = self.triangle_count, len(mesh.triangles)
        self.vertices.append(mesh.vertices.astype(FLOAT))
        self.triangles.append((mesh.triangles + self.vertex_count).astype(INTEGER))
        self.vertex_count += len(mesh.vertices)
        self.triangle_count += number
        return first, number


class _Code:
    """Concatenates the postfix code of all CSG solids, and collects their parts by kind."""

    def __init__(self, triangles):
        self.triangles = triangles
        self.code, self.parts = [], {SPHERE: [], BOX: [], ELLIPSOID: [], MESH: []}

    def add(self, solid):
        """Adds a solid; returns the index of its first row, and the number of its rows."""
        first = len(self.code)
        for word in solid.code:
            if isinstance(word, Operator):
                self.code.append((OPERATORS[word], 0))
            else:
                kind = {Sphere: SPHERE, Box: BOX, Ellipsoid: ELLIPSOID, Mesh: MESH}[type(word)]
                self.code.append((kind, len(self.parts[kind])))
                self.parts[kind].append(self.triangles.add(word) if kind == MESH else word)
        return first, len(solid.code)


def _spheres(spheres):
    return _table([(*s.centre, s.radius) for s in spheres], 4)


def _boxes(boxes):
    return _table([np.ravel((b.corner, *b.edges)) for b in boxes], 12)


def _ellipsoids(ellipsoids):
    return _table([np.ravel((e.centre, *e.axes)) for e in ellipsoids], 12)


def _table(rows, columns, dtype=FLOAT):
    return np.array(rows, dtype).reshape(len(rows), columns)


def _coloured(table, columns, colours):
    table[:, columns] = colours(table[:, columns])
    return table
