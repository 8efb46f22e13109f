"""The scene of a job, as objects made of the job's type of number."""

from functools import partial
from itertools import groupby

from . import npy
from .contact import Contact
from .media import Media, Medium
from .shade import leaving, power, shifting
from .shapes import box, bvh, csg, ellipsoid, mesh, polygon, sphere


class Material(Medium):
    def __init__(self, row, air, number):
        super().__init__(row[8], row[9], row[5:8], number)
        self.diffuse = row[0:3]
        self.k_s, self.exponent = row[3], row[4]
        self.rough = self.k_s > 0 and row[10] > 0
        self.lobe = number.real(2 / float(row[10]) ** 2 - 2) if self.rough else None  # GLO-2, in float64
        # N and M of REF-1 where a ray comes from AIR, and where it comes from inside
        self.entering = air.n / self.n, air.mu_r / self.mu_r
        self.leaving = self.n / air.n, self.mu_r / air.mu_r


class Reader:
    """The arrays of a job in its type of number."""

    def __init__(self, job, number):
        self.job, self.number = job, number

    def integers(self, name):
        return npy.read(self.job.array(name))

    def rows(self, name):
        return [tuple(map(self.number.real, row)) for row in npy.read(self.job.array(name))]

    def vector(self, name):
        return tuple(map(self.number.real, npy.read(self.job.array(name))))


class Scene:
    """All shapes, lights and media. `nearest` is the search for a first hit that suits the scene.

    If `accel` is "bvh", `build` comes before the first ray.
    """

    def __init__(self, job, number):
        read = Reader(job, number)
        self.number = number
        self.leave = leaving(job.offset, number.real(job.epsilon))
        self.power = None if job.phong == "clamped" else power
        self.camera = read.rows("camera")
        self.ambient = read.vector("ambient")
        self.background = read.vector("background")
        self.lights = [(row[0:3], row[3:6], row[6]) for row in read.rows("lights")]
        air = read.vector("air")
        self.air = Medium(air[0], air[1], air[2:5], number)
        self.materials = [Material(row, self.air, number) for row in read.rows("materials")]
        self.rough = any(material.rough for material in self.materials)
        self.matrices = read.integers("sobol") if job.sampler == "sobol" else None  # SOB-2
        self.media = Media(read.integers("media"), self.air, self.materials)
        self.accelerate(job.accel, shapes(read, self.materials, job.accel, self.leave))
        self.contact = None
        numbers = read.integers("precedence")
        if "contact" in job.needs and job.merge == "tolerant" and len(numbers):
            epsilon = number.real(job.epsilon)
            self.contact = Contact(self, numbers, shifting(job.offset, epsilon), job.offset, epsilon)

    def accelerate(self, accel, items):
        """Choose the search among `items`, pairs (search, shape) in the order of HIT-2. grown: is it by a tree?"""
        for _, shape in items:
            shape.bit = self.media.bits.get(shape.identity, 0)
        self.items = items
        self.grown = bvh.pays(accel, [search for search, _ in items])
        self.accel = "bvh" if self.grown or any(solid.has_tree for solid in self.solids()) else "none"
        if self.grown:
            self.nearest = self.by_tree
        else:
            # the search and the rows of each kind of shape that the scene has; absent kinds cost nothing
            self.kinds = [(search, [shape.row for _, shape in kind]) for search, kind in groupby(items, lambda i: i[0])]
            self.nearest, self.eye = self.by_trying_all, None

    def look_from(self, eye):
        """Precomputes the common part of the tests of all rays that start at `eye`, this very tuple."""
        if not self.grown:
            self.eye = eye
            self.seen = [
                (sphere.nearest_seen, sphere.seen_from(eye, rows, self.number.roundoff))
                if search is sphere.nearest
                else (search, rows)
                for search, rows in self.kinds
            ]

    def solids(self):
        return [shape for search, shape in self.items if search is csg.nearest]

    def build(self):
        """The hierarchies (HIT-6): over all shapes, and over the meshes that are parts of solids."""
        for solid in self.solids():
            for part in solid.meshes:
                part.build()
        if self.grown:
            self.tree = bvh.Tree(self.items, self.number)

    def by_trying_all(self, origin, direction, limit):
        """The first hit (t, shape, face) with 0 < t < limit, or None (HIT-1, HIT-2)."""
        best = nothing = (limit, None, None)
        for search, rows in self.seen if origin is self.eye else self.kinds:
            best = search(rows, origin, direction, best, self.number.sqrt)
        return None if best is nothing else best

    def by_tree(self, origin, direction, limit):
        """The same (HIT-6)."""
        nothing = limit, None, None
        best = self.tree.nearest(origin, direction, nothing)
        return None if best is nothing else best


def shapes(read, materials, accel, leave):
    """All shapes as pairs (search, shape), in the order of HIT-2."""
    job, number = read.job, read.number
    ball = sphere.Sphere if job.renormalise == "on" else sphere.Unnormalised
    items = []

    def put(search, name, make, parts):
        for (identity, material), part in zip(read.integers(name + "_ids"), parts, strict=True):
            items.append((search, make(*part, materials[material], identity, number)))

    vertices = read.rows("polygon_vertices")
    polygons = [(vertices[first : first + count],) for first, count in read.integers("polygon_ranges")]
    make = partial(ball, method=job.sphere)
    put(sphere.SEARCHES[job.sphere], "sphere", make, [(row[0:3], row[3]) for row in read.rows("spheres")])
    put(box.SEARCHES[job.slab], "box", box.Box, map(point_and_three, read.rows("boxes")))
    put(polygon.SEARCHES[job.triangle], "polygon", polygon.Polygon, polygons)
    make = partial(ellipsoid.Ellipsoid, method=job.sphere)
    put(ellipsoid.SEARCHES[job.sphere], "ellipsoid", make, map(point_and_three, read.rows("ellipsoids")))

    vertices, triangles = read.rows("mesh_vertices"), read.integers("mesh_triangles")
    for (first, count, closed), (identity, material) in zip(
        read.integers("mesh_ranges"), read.integers("mesh_ids"), strict=True
    ):
        rows = triangles[first : first + count]
        made = mesh.triangles(vertices, rows, closed, materials[material], identity, number, job.triangle)
        items += [(mesh.SEARCHES[job.triangle], triangle) for triangle in made]

    spheres, boxes, ellipsoids = (read.rows("csg_" + name) for name in ("spheres", "boxes", "ellipsoids"))
    meshes, code = read.integers("csg_meshes"), read.integers("csg_code")
    for (first, count), (identity, material) in zip(read.integers("csg_ranges"), read.integers("csg_ids"), strict=True):
        common = materials[material], identity, number

        def word(operation, row, common=common):
            match operation:
                case 0:
                    return ball(spheres[row][0:3], spheres[row][3], *common)
                case 1:
                    return box.Box(*point_and_three(boxes[row]), *common)
                case 2:
                    return ellipsoid.Ellipsoid(*point_and_three(ellipsoids[row]), *common)
                case 3:
                    start, number_of = meshes[row]
                    made = list(mesh.triangles(vertices, triangles[start : start + number_of], True, *common))
                    return csg.Mesh(made, bvh.pays(accel, [mesh.nearest] * len(made)), number)
            return {4: csg.OR, 5: csg.AND, 6: csg.NOT}[operation]

        words = [word(*row) for row in code[first : first + count]]
        if job.csg == "stepping":
            solid = csg.Stepping(words, *common, leave)
        else:
            solid = csg.Solid(words, *common, job.merge, job.sliver and number.real(job.sliver))
        items.append((csg.nearest, solid))
    return items


def point_and_three(row):
    """A point and three vectors, from twelve numbers."""
    return row[0:3], (row[3:6], row[6:9], row[9:12])


def first_hit(scene, origin, direction, limit):
    """Distance, point, normal and shape of the first hit, or None (HIT-3, HIT-4)."""
    found = scene.nearest(origin, direction, limit)
    if found is None:
        return None
    t, shape, face = found
    point, normal = shape.surface(origin, direction, t, face)
    return t, point, normal, shape
