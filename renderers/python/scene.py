"""The scene of a job, as objects made of the job's type of number."""

from . import box, ellipsoid, npy, polygon, sphere


class Material:
    def __init__(self, row):
        self.diffuse = row[0:3]
        self.k_s, self.exponent = row[3], row[4]
        self.eps_r, self.mu_r = row[8], row[9]


class Scene:
    """Everything that rays meet.

    `kinds` holds, for each kind of shape that the scene has, its search function and the shapes, in the order of
    HIT-2: what the scene lacks costs nothing.
    """

    def __init__(self, job, number):
        real = number.real

        def rows(name):
            return [tuple(real(x) for x in row) for row in npy.read(job.array(name))]

        def vector(name):
            return tuple(real(x) for x in npy.read(job.array(name)))

        self.number = number
        self.epsilon = real(job.epsilon)
        self.camera = rows("camera")
        self.ambient = vector("ambient")
        self.background = vector("background")
        self.air = vector("air")
        self.lights = [(row[0:3], row[3:6]) for row in rows("lights")]
        materials = [Material(row) for row in rows("materials")]

        def shapes(make, parts, name):
            ids = npy.read(job.array(name + "_ids"))
            return [
                make(*part, materials[material], identity, number)
                for part, (identity, material) in zip(parts, ids, strict=True)
            ]

        def corner_and_three(row):
            return row[0:3], (row[3:6], row[6:9], row[9:12])

        vertices = rows("polygon_vertices")
        spheres = shapes(sphere.Sphere, ((row[0:3], row[3]) for row in rows("spheres")), "sphere")
        boxes = shapes(box.Box, map(corner_and_three, rows("boxes")), "box")
        polygons = shapes(
            polygon.Polygon,
            ((vertices[first : first + count],) for first, count in npy.read(job.array("polygon_ranges"))),
            "polygon",
        )
        ellipsoids = shapes(ellipsoid.Ellipsoid, map(corner_and_three, rows("ellipsoids")), "ellipsoid")
        searches = [
            (sphere.nearest, [one.row for one in spheres]),
            (box.nearest, boxes),
            (polygon.nearest, polygons),
            (ellipsoid.nearest, ellipsoids),
        ]
        self.kinds = [(search, found) for search, found in searches if found]

    def nearest(self, origin, direction, limit):
        """The first hit (t, shape, face) with 0 < t < limit, or None (HIT-1, HIT-2)."""
        best = nothing = (limit, None, None)
        for search, shapes in self.kinds:
            best = search(shapes, origin, direction, best, self.number.sqrt)
        return None if best is nothing else best


def first_hit(scene, origin, direction, limit):
    """Distance, point, normal and shape of the first hit, or None (HIT-3, HIT-4)."""
    found = scene.nearest(origin, direction, limit)
    if found is None:
        return None
    t, shape, face = found
    point, normal = shape.surface(origin, direction, t, face)
    return t, point, normal, shape
