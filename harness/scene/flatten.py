"""A scene as the arrays of a job (renderers/README.md)."""

import numpy as np

from harness import colour
from harness.scene.model import Box, Ellipsoid, Polygon, Sphere

FLOAT = np.dtype("<f8")
INTEGER = np.dtype("<i4")


def flatten(scene):
    """The arrays of a job by name, with the dtypes and shapes of the contract. Colours are linear (COL-2).

    Objects are numbered from 0 in the order of the file. Equal materials share a row.
    """
    rows = {}
    for thing in scene.objects:
        rows.setdefault(thing.material, len(rows))

    def of(shape):
        return [(number, thing) for number, thing in enumerate(scene.objects) if isinstance(thing, shape)]

    def ids(found):
        return _table([(number, rows[thing.material]) for number, thing in found], 2, INTEGER)

    spheres, boxes, polygons, ellipsoids = of(Sphere), of(Box), of(Polygon), of(Ellipsoid)
    counts = [len(p.vertices) for _, p in polygons]
    firsts = np.cumsum([0, *counts])[:-1]
    camera, air = scene.camera, scene.air
    return {
        "camera": _table([camera.centre, camera.u, camera.v, camera.e], 3),
        "ambient": colour.decode(scene.ambient),
        "background": colour.decode(scene.background),
        "air": np.array([air.eps_r, air.mu_r, *air.attenuation], FLOAT),
        "lights": _decoded(_table([_light(light) for light in scene.lights], 7), slice(3, 6)),
        "materials": _decoded(_table([_material(material) for material in rows], 11), slice(0, 3)),
        "spheres": _table([(*s.centre, s.radius) for _, s in spheres], 4),
        "boxes": _table([np.ravel((b.corner, *b.edges)) for _, b in boxes], 12),
        "polygon_vertices": _table([v for _, p in polygons for v in p.vertices], 3),
        "polygon_ranges": _table(list(zip(firsts, counts, strict=True)), 2, INTEGER),
        "ellipsoids": _table([np.ravel((e.centre, *e.axes)) for _, e in ellipsoids], 12),
        "sphere_ids": ids(spheres),
        "box_ids": ids(boxes),
        "polygon_ids": ids(polygons),
        "ellipsoid_ids": ids(ellipsoids),
    }


def _light(light):
    return (*light.position, *light.colour, light.radius)


def _material(m):
    return (*m.diffuse, m.k_s, m.exponent, *m.attenuation, m.eps_r, m.mu_r, m.roughness)


def _table(rows, columns, dtype=FLOAT):
    return np.array(rows, dtype).reshape(len(rows), columns)


def _decoded(table, columns):
    table[:, columns] = colour.decode(table[:, columns])
    return table
