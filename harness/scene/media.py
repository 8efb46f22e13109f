"""The clear solids that can share a place with something else, ranked (MED-2), and which of them hold the eye."""

import numpy as np

from harness.errors import UserError
from harness.scene import check, surface
from harness.scene.bounds import bounds, padded, volume
from harness.scene.model import Box, Csg, Ellipsoid, Mesh, Sphere

MOST = 63  # a renderer keeps a set of them in the bits of one integer
OPAQUE = (0.0, 0.0, 0.0)
BLOCK = 1 << 20  # pairs of boxes compared at once


def solid(thing):
    """Whether it has an inside: everything but a polygon and an open mesh (HIT-3)."""
    return isinstance(thing, Sphere | Box | Ellipsoid | Csg) or (isinstance(thing, Mesh) and thing.closed)


def media(scene):
    """(object, holds the eye) of the clear solids with a rank, lowest first. UserError if there are more than MOST.

    One with k_s = 0 transmits nothing: nothing is ever in it but an eye.
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
    ranked = sorted(holding | set(_meeting(boxes, entered)))
    if len(ranked) > MOST:
        last = scene.objects[ranked[MOST]]
        raise UserError(
            f"{len(ranked)} clear solids touch other objects or hold the eye, and {MOST} are the most",
            file=scene.file,
            line=last.line or None,
            remedy="make some opaque, with attenuation (0,0,0), move them apart or join them with OR",
        )
    ranked.sort(key=lambda i: -volume(exact[i]))  # stable: of equal ones, the later in the file is the higher
    return [(i, i in holding) for i in ranked]


def _meeting(boxes, chosen):
    """Those of `chosen` whose box meets that of any other object; faces that touch meet."""
    step = max(1, BLOCK // max(len(boxes), 1))
    for first in range(0, len(chosen), step):
        some = chosen[first : first + step]
        meet = np.ones((len(some), len(boxes)), bool)
        for axis in range(3):
            low, high = boxes[:, 0, axis], boxes[:, 1, axis]
            meet &= (low[some, None] <= high) & (low <= high[some, None])
        meet[np.arange(len(some)), some] = False
        yield from (i for i, found in zip(some, meet.any(axis=1), strict=True) if found)


def holds(thing, point):
    """Whether a point is inside of a solid; the surface is not."""
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
