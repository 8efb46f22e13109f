"""Surfaces in one place, and the media that they part (MED-6 to MED-8)."""

import numpy as np

from ..needs import MESH, POLYGON, TREE
from ..scene import ATTENUATED, FLAT, INDEX, MATERIAL, OBJECT, PERMEABILITY, RANK, hit_shape, nearest, occluded, surface
from ..shapes.mesh import aimed
from ..target import called, kernel
from ..vector import add, along, dot, scale
from .media import medium
from .reflect import offset

GRAZING = 2.0**-10  # least |d·n| that the way back to a start is worked out with


@kernel
def same(materials, i, t):
    """Whether light cannot tell one medium from another (MED-8). i, t: rows of materials."""
    alike = materials[i, INDEX] == materials[t, INDEX] and materials[i, PERMEABILITY] == materials[t, PERMEABILITY]
    for channel in range(ATTENUATED, ATTENUATED + 3):
        alike = alike and materials[i, channel] == materials[t, channel]
    return alike


@kernel
def bit(scene, index):
    """The set of the solid alone that a shape bounds; empty if it has no rank."""
    rank = np.int64(scene.ids[index, RANK])
    return np.int64(1) << rank if rank >= 0 else np.int64(0)


@called
def crossed(scene, thread, other, direction, slope, point, normal, size):
    """Whether shape `other` is in one place with a hit (MED-6); and point, normal and size there."""
    real = type(slope)
    reach = offset(scene, point, normal, max(size, scene.extents[other]))
    back = real(8) * reach / max(slope, real(GRAZING))
    start = along(point, -back, direction)
    aim = aimed(start, direction) if POLYGON or MESH else 0
    t = hit_shape(scene, thread, other, start, direction, aim, back + back)
    if not (t > 0 and t < back + back):
        return False, point, normal, size
    there, across, extent = surface(scene, thread, other, start, direction, t)
    near = abs(t - back) * max(slope, abs(dot(direction, across))) <= reach
    return near, there, across, extent


@called
def place_of(scene, thread, members, direction, index, point, normal, size):
    """What is there where a ray in the set `members` hits a shape: the shape on top, then point, normal, largest size,
    the sets that the ray was in and is in beyond, and their media (MED-7); and whether there is no surface (MED-8).
    """
    slope = abs(dot(direction, normal))
    entered, left = np.int64(0), np.int64(0)
    if dot(direction, normal) <= 0:
        entered = bit(scene, index)
    else:
        left = bit(scene, index)
    first, at, across, most = index, point, normal, size
    if TREE:
        real = type(slope)
        reach = offset(scene, point, normal, scene.largest_extent)
        reach = real(8) * reach / max(slope, real(GRAZING)) + scene.tree_pad * (reach + scene.tree_reach)
        stack = scene.tree_stack
        height, k = 0, 0
        if len(scene.tree_items) > 0:
            stack[thread, 0] = 0
            height = 1
        count = np.int64(len(scene.tree_loose))
        items, begin = scene.tree_loose, np.int64(0)
        while True:
            for k in range(begin, begin + count):
                other = np.int64(items[k])
                if scene.ids[other, OBJECT] == scene.ids[first, OBJECT]:
                    continue
                near, there, normal_there, extent = crossed(scene, thread, other, direction, slope, point, normal, size)
                if near:
                    most = max(most, extent)
                    if dot(direction, normal_there) <= 0:
                        entered |= bit(scene, other)
                    else:
                        left |= bit(scene, other)
                    if scene.precedence[other] > scene.precedence[index]:
                        index, at, across = other, there, normal_there
            count = np.int64(0)
            if height == 0:
                break
            height -= 1
            node = stack[thread, height]
            apart = False
            for axis in range(3):
                low, high = scene.tree_bounds[node, 0, axis], scene.tree_bounds[node, 1, axis]
                apart = apart or point[axis] + reach < low or high < point[axis] - reach
            if apart:
                continue
            if scene.tree_links[node, 1] == 0:
                stack[thread, height] = scene.tree_links[node, 0]
                stack[thread, height + 1] = scene.tree_links[node, 0] + 1
                height += 2
            else:
                items = scene.tree_items
                begin, count = np.int64(scene.tree_links[node, 0]), np.int64(scene.tree_links[node, 1])
    else:
        for other in range(len(scene.ids)):
            if scene.ids[other, OBJECT] == scene.ids[first, OBJECT]:
                continue
            near, there, normal_there, extent = crossed(scene, thread, other, direction, slope, point, normal, size)
            if near:
                most = max(most, extent)
                if dot(direction, normal_there) <= 0:
                    entered |= bit(scene, other)
                else:
                    left |= bit(scene, other)
                if scene.precedence[other] > scene.precedence[index]:
                    index, at, across = other, there, normal_there
    entered, left = entered & ~left, left & ~entered
    was, beyond = (members | left) & ~entered, (members | entered) & ~left
    i, o, own = medium(scene, was), medium(scene, beyond), np.int64(scene.ids[index, MATERIAL])
    none = False
    if scene.ids[index, RANK] >= 0:
        none = (entered | left) & ~bit(scene, index) != 0 and same(scene.materials, i, o)
    elif scene.ids[index, FLAT] == 0 and dot(direction, across) > 0:
        i, o = own, i
    else:
        o = own
    return np.int64(index), (at, across, most, was, beyond, i, o), none


@called
def lets_by(scene, thread, origin, direction, distance, members):
    """Whether a feeler that starts in the set `members` and meets something passes through it all (MED-8)."""
    while members != 0:
        t, index = nearest(scene, thread, origin, direction)
        if index < 0 or not t < distance:
            return True
        point, normal, size = surface(scene, thread, index, origin, direction, t)
        index, place, none = place_of(scene, thread, members, direction, index, point, normal, size)
        if not none:
            return False
        point, normal, size, _, members, _, _ = place
        step = scale(offset(scene, point, normal, size), normal)
        origin = add(point, step) if dot(direction, normal) > 0 else along(point, type(t)(-1), step)
        distance -= t
    return not occluded(scene, thread, origin, direction, distance)
