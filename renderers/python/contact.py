"""Surfaces in one place, and the media that they part (MED-6 to MED-8)."""

from .shapes import csg
from .vector import add, dot, largest, scale

GRAZING = 2.0**-10  # least |d·n| that the way back to the start of MED-6 is worked out with


class Place:
    """Where a ray ends, in place of a shape: what is there of all the surfaces that it crosses there (MED-7).

    thing: the shape. sets: those that the ray was in and is in beyond. i, o: their media. none: there is no surface
    (MED-8).
    """

    def __init__(self, thing, size, sets, i, o):
        self.material, self.flat, self.identity, self.size = thing.material, thing.flat, thing.identity, size
        self.thing, self.sets, self.i, self.o = thing, sets, i, o


class Contact:
    """The surfaces of a scene, to be asked which of them are in one place.

    numbers: of precedence.npy. shift: of shade.shifting. offset, epsilon: of OFF-1.
    """

    def __init__(self, scene, numbers, shift, offset, epsilon):
        self.scene, self.numbers, self.shift = scene, numbers, shift
        self.pairs = [(search, shape.row) for search, shape in scene.items]
        self.sizes = {shape: extent(shape) for _, shape in scene.items}
        self.largest, self.offset, self.epsilon = max(self.sizes.values()), offset, epsilon

    def reach(self, distance, light):
        """How far what stops a feeler to a light may be: less far than what the light lies on (LOC-2)."""
        if self.offset in ("fixed", "none"):
            return distance - 512 * (self.epsilon if self.offset == "fixed" else 0)
        return distance - 512 * self.epsilon * (self.largest + largest(light))

    def near(self, point, normal, slope):
        """Pairs (search, row) of the shapes that may be in one place with `point`."""
        if not self.scene.grown:
            return self.pairs
        reach = self.shift(point, normal, self.largest)
        return self.scene.tree.around(point, 8 * reach / max(abs(slope), GRAZING))

    def meet(self, inside, direction, point, normal, shape):
        """Returns the point, the normal and the Place where a ray in the set `inside` hits `shape`."""
        numbers, sqrt = self.numbers, self.scene.number.sqrt
        slope = dot(direction, normal)
        size, top = shape.size, (shape, point, normal)
        changes = [shape.bit, 0] if slope <= 0 else [0, shape.bit]  # solids entered, and left
        for search, row in self.near(point, normal, slope):
            other = row[-1] if isinstance(row, tuple) else row
            if other.identity == shape.identity:
                continue
            reach = self.shift(point, normal, max(shape.size, self.sizes[other]))
            back = 8 * reach / max(abs(slope), GRAZING)
            start = add(point, scale(direction, -back))
            t, thing, face = search([row], start, direction, (2 * back, None, None), sqrt)
            if thing is None:
                continue
            other_point, other_normal = thing.surface(start, direction, t, face)
            other_slope = dot(direction, other_normal)
            if not abs(t - back) * max(abs(slope), abs(other_slope)) <= reach:
                continue
            size = max(size, thing.size)
            changes[other_slope > 0] |= thing.bit
            if numbers[thing.identity] > numbers[top[0].identity]:
                top = thing, other_point, other_normal
        return self.beyond(inside, direction, changes, size, *top)

    def beyond(self, inside, direction, changes, size, thing, point, normal):
        """MED-7 and MED-8, of the surface on top."""
        entered, left = changes[0] & ~changes[1], changes[1] & ~changes[0]
        was, beyond = (inside | left) & ~entered, (inside | entered) & ~left
        media = self.scene.media
        i, o = media.of(was), media.of(beyond)
        none = False
        if thing.bit:
            several = (entered | left) & ~thing.bit
            none = several and i.same(o)
        elif not thing.flat and dot(direction, normal) > 0:
            i, o = thing.material, i
        else:
            o = thing.material
        place = Place(thing, size, (was, beyond), i, o)
        place.none = none
        return point, normal, place

    def lets_by(self, start, direction, distance, inside):
        """Whether a feeler that starts in the set `inside` and meets something passes through it all (MED-8)."""
        scene = self.scene
        while True:
            found = scene.nearest(start, direction, distance)
            if found is None:
                return True
            t, shape, face = found
            point, normal = shape.surface(start, direction, t, face)
            point, normal, place = self.meet(inside, direction, point, normal, shape)
            if not place.none:
                return False
            start = scene.leave(point, normal, place.size, 1 if dot(direction, normal) > 0 else -1)
            distance, inside = distance - t, place.sets[1]


def extent(shape):
    """Its size, or the largest of a solid's parts."""
    if not isinstance(shape, csg.Solid):
        return shape.size
    parts = (part.triangles if isinstance(part, csg.Mesh) else [part] for part in shape.parts)
    return max(each.size for some in parts for each in some)
