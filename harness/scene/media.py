"""Ranks the clear solids that overlap other objects (MED-2), and finds those that contain the eye."""

from itertools import islice

import numpy as np

from harness.errors import UserError
from harness.scene import check, surface
from harness.scene.bounds import bounds, padded, volume
from harness.scene.model import Box, Csg, Ellipsoid, Mesh, Sphere

MOST = 63  # ranked solids: a renderer stores a set of them in the bits of one integer
OPAQUE = (0.0, 0.0, 0.0)
LENS_POINTS, GOLDEN_ANGLE = 256, np.pi * (3 - np.sqrt(5))  # the points of a sunflower: even over a disc (Vogel 1979)
TOGETHER = 64  # neighbouring solids that are compared at once with all objects near them


def solid(thing):
    """Whether an object has an inside: all but polygons and open meshes have one (HIT-3)."""
    return isinstance(thing, Sphere | Box | Ellipsoid | Csg) or (isinstance(thing, Mesh) and thing.closed)


def media(scene):
    """(index of the object, whether it contains the eye) of each ranked clear solid, lowest rank first.

    A solid with k_s = 0 transmits nothing, so only the eye can be in it. UserError if there are more than MOST.
    """
    clear = [i for i, t in enumerate(scene.objects) if t.material.attenuation != OPAQUE and solid(t)]
    if not clear:
        return []
    exact = bounds(scene.objects)
    boxes = padded(exact)
    eye = np.add(scene.camera.centre, scene.camera.e)
    around = ((boxes[clear, 0] <= eye) & (eye <= boxes[clear, 1])).all(axis=1)
    holding = {i for i, near in zip(clear, around, strict=True) if near and holds(scene.objects[i], eye)}
    entered = [i for i in clear if scene.objects[i].material.k_s > 0]
    ranked = sorted(holding | set(islice(_meeting(boxes, np.array(entered, int)), MOST + 1)))
    if len(ranked) > MOST:
        last = scene.objects[ranked[MOST]]
        raise UserError(
            f"more than {MOST} clear solids touch other objects or contain the eye",
            file=scene.file,
            line=last.line or None,
            remedy="make some opaque, with attenuation (0,0,0), move them apart or join them with OR",
        )
    # stable: of equal ones of one material, the later in the file is the higher
    ranked.sort(key=lambda i: (-volume(exact[i]), density(scene.objects[i].material)))
    return [(i, i in holding) for i in ranked]


def lens_cut(scene, radius):
    """Whether a clear solid holds a part of the lens around the eye but not all of it, by LENS_POINTS points of it.

    A job says in which solids eye rays begin (MED-2), once for all of them.
    """
    camera = scene.camera
    eye = np.add(camera.centre, camera.e)
    solids = [t for t in scene.objects if t.material.attenuation != OPAQUE and solid(t)]
    boxes = padded(bounds(solids))
    near = ((boxes[:, 0] <= eye + radius) & (eye - radius <= boxes[:, 1])).all(axis=1)
    if not near.any():
        return False
    across, up = (np.divide(side, check.length(side)) for side in (camera.u, camera.v))
    number = np.arange(LENS_POINTS)
    out = radius * np.sqrt(number / (LENS_POINTS - 1))[:, None]
    turn = number[:, None] * GOLDEN_ANGLE
    points = eye + out * (np.cos(turn) * across + np.sin(turn) * up)
    return any(len({holds(solids[i], point) for point in points}) > 1 for i in np.flatnonzero(near))


def density(material):
    """Orders materials whatever their place in the file: by the index of refraction, then by their other numbers."""
    m = material
    return (m.eps_r * m.mu_r, m.mu_r, m.attenuation, m.k_s, m.diffuse, m.exponent, m.roughness)


def _meeting(boxes, chosen):
    """Yields those of `chosen` whose box meets the box of any other object. Boxes whose faces touch meet."""
    for some in close(boxes[chosen, 0]):
        some = chosen[some]
        low, high = boxes[some, 0], boxes[some, 1]
        near = np.flatnonzero(((boxes[:, 0] <= high.max(axis=0)) & (low.min(axis=0) <= boxes[:, 1])).all(axis=1))
        meet = (near != some[:, None]) & (boxes[near, 0] <= high[:, None]).all(axis=2)
        meet &= (low[:, None] <= boxes[near, 1]).all(axis=2)
        yield from some[meet.any(axis=1)].tolist()


def close(points):
    """Yields indices of neighbouring points (N, 3), TOGETHER at a time: slabs of x, columns of y, sorted by z."""
    ranks = points.argsort(axis=0).argsort(axis=0)
    cuts = max(round((len(points) / TOGETHER) ** (1 / 3)), 1)
    slab, column, _ = (ranks * cuts // max(len(points), 1)).T
    order = np.lexsort((ranks[:, 2], column, slab))
    return (order[first : first + TOGETHER] for first in range(0, len(order), TOGETHER))


def holds(thing, point):
    """Whether a point (3,) is inside a solid; its surface is outside."""
    return bool(_HOLDS[type(thing)](thing, point))


def _sphere(sphere, point):
    return check.length(np.subtract(point, sphere.centre)) < sphere.radius


def _box(box, point):
    place = np.linalg.solve(np.transpose(box.edges), np.subtract(point, box.corner))
    return ((place > 0) & (place < 1)).all()


def _ellipsoid(ellipsoid, point):
    return check.length(np.linalg.solve(np.transpose(ellipsoid.axes), np.subtract(point, ellipsoid.centre))) < 1


def _mesh(mesh, point):
    return abs(surface.winding(mesh.vertices, mesh.triangles, [point])[0]) > 0.5


def _csg(csg, point):
    def part(thing):
        return holds(thing, point)

    return csg.fold(part, lambda a, b: a or b, lambda a, b: a and b, lambda a: not a)


_HOLDS = {Sphere: _sphere, Box: _box, Ellipsoid: _ellipsoid, Mesh: _mesh, Csg: _csg}
