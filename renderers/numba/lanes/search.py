"""What each ray of a packet meets first, and what is in its way to a light."""

import math

import numpy as np

from .. import scene as scalar
from ..needs import BOX, CSG, ELLIPSOID, LIMITED, MESH, POLYGON, SPHERE, TREE
from ..shapes.box import hit_box as hit_one_box
from ..shapes.csg import hit_csg
from ..target import kernel
from . import spheres
from .lanes import COUNT, any_of, lane, put, select, spread
from .scene import OTHERS
from .shapes import hit_box, hit_ellipsoid, hit_polygon, hit_triangle, near_ball, shear
from .vector import of_lane

SPOILS = CSG and LIMITED  # whether a line may cross a mesh too often


@kernel
def spoil(scene, thread, place):
    """Make the colour of a place NaN if a line has crossed a mesh too often (CSG-6)."""
    if SPOILS and scene.csg_overflow[thread, 0] != 0:
        scene.csg_overflow[thread, 0] = 0
        for c in range(3):
            scene.light[thread, c, place] = math.nan


@kernel
def hit_solid(scene, thread, i, ball, asked, origin, direction, place):
    """Distance to CSG solid `i`, one ray after another."""
    t = spread(0.0)
    near = asked & near_ball(scene.ball_columns, ball, origin, direction)
    if any_of(near):
        for k in range(COUNT):
            if lane(near, k):
                t = put(t, k, hit_csg(scene, thread, i, of_lane(origin, k), of_lane(direction, k)))
                spoil(scene, thread, lane(place, k))
    return t


@kernel
def hit_other(scene, thread, number, aim, limit, asked, origin, direction, place):
    """Distance to a shape that is no sphere, and its face, counted from its first.

    aim: of `shear`, if there are polygons or meshes.
    """
    i, first = number, spread(np.int32(0))
    if BOX:
        if i < len(scene.boxes):
            return hit_box(scene.boxes, i, origin, direction)
        i -= len(scene.boxes)
    if POLYGON:
        if i < len(scene.polygon_ranges):
            return hit_polygon(scene.polygon_corners, scene.polygon_ranges, i, origin, direction, limit, aim), first
        i -= len(scene.polygon_ranges)
    if ELLIPSOID:
        if i < len(scene.ellipsoids):
            return hit_ellipsoid(scene.ellipsoids, i, origin, direction), first
        i -= len(scene.ellipsoids)
    if MESH:
        if i < len(scene.triangles):
            return hit_triangle(scene.triangles, i, aim), first
        i -= len(scene.triangles)
    if CSG:
        return hit_solid(scene, thread, i, number, asked, origin, direction, place), first
    return spread(0.0), first


@kernel
def spheres_before(scene):
    """The number of spheres, after which the other shapes are counted."""
    if SPHERE:
        return len(scene.spheres)
    return 0


@kernel
def nearest(scene, thread, balls, numbers, count, others, other_count, asked, origin, direction, place):
    """Distance to the nearest shape and its face; inf and -1 for a miss (HIT-1, HIT-2).

    balls, numbers, count: columns of spheres to be tried, their numbers, how many; others, other_count: likewise of the
    other shapes. asked: mask of the rays. place: of their samples.
    """
    best, face = spread(math.inf), spread(np.int32(-1))
    if TREE:
        return nearest_one_by_one(scene, thread, asked, origin, direction, place)
    if SPHERE:
        best, face = spheres.nearest(balls, numbers, count, origin, direction)
    if OTHERS:
        before = spheres_before(scene)
        aim = shear(origin, direction) if POLYGON or MESH else 0
        for j in range(other_count):
            i = others[0, j]
            t, side = hit_other(scene, thread, i, aim, best, asked, origin, direction, place)
            nearer = (t > 0.0) & (t < best)
            best, face = select(nearer, t, best), select(nearer, side + scene.first_faces[before + i], face)
    return best, face


@kernel
def occluded(scene, thread, asked, origin, direction, limit, place):
    """The rays of the mask `asked` that something stops before the distance `limit` (HIT-5)."""
    if TREE:
        return occluded_one_by_one(scene, thread, asked, origin, direction, limit, place)
    open_ = asked
    if SPHERE:
        open_ = spheres.unstopped(scene.sphere_columns, len(scene.spheres), origin, direction, limit, asked)
    if OTHERS:
        aim = shear(origin, direction) if POLYGON or MESH else 0
        for i in range(scene.ball_columns.shape[1] - COUNT):
            if not any_of(open_):
                break
            t, _ = hit_other(scene, thread, i, aim, limit, open_, origin, direction, place)
            open_ = open_ & ~((t > 0.0) & (t < limit))
    return asked & ~open_


@kernel
def nearest_one_by_one(scene, thread, asked, origin, direction, place):
    """`nearest` through the tree (HIT-6)."""
    best, face = spread(math.inf), spread(np.int32(-1))
    for k in range(COUNT):
        if lane(asked, k):
            one, way = of_lane(origin, k), of_lane(direction, k)
            t, i = scalar.nearest(scene, thread, one, way)
            if i >= 0:
                number = scene.first_faces[i]
                if BOX:
                    of_box = i - spheres_before(scene)
                    if of_box >= 0 and of_box < len(scene.boxes):
                        number += np.int32(hit_one_box(scene.boxes, of_box, one, way)[1])
                best, face = put(best, k, t), put(face, k, number)
            spoil(scene, thread, lane(place, k))
    return best, face


@kernel
def occluded_one_by_one(scene, thread, asked, origin, direction, limit, place):
    """`occluded` through the tree (HIT-6)."""
    stopped = asked & ~asked
    for k in range(COUNT):
        if lane(asked, k):
            found = scalar.occluded(scene, thread, of_lane(origin, k), of_lane(direction, k), lane(limit, k))
            stopped = put(stopped, k, found)
            spoil(scene, thread, lane(place, k))
    return stopped
