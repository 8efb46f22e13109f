"""Translates the arrays of a job to POV-Ray's scene description language. Raises Unmappable where POV-Ray differs."""

import math

import numpy as np

from .csg import Solid
from .material import Air, Material
from .shapes import Box, Ellipsoid, Mesh, Polygon, Sphere, number, vector

LARGEST_DEPTH = 254  # max_trace_level is 256 at most
SIZE = 1e4  # distance of eye and screen in the export, if that leaves everything within FAR
FAR = 2e6  # POV-Ray takes hits nearer than 1e-4, 1e-3 for feelers, for errors, and looks no further than 1e7
MESH_FAR = 3e2  # corners of meshes are float32: errors of 1.5e-5 at most, well below that 1e-4


class Unmappable(Exception):
    """POV-Ray would make a different picture; str() says why."""


class Thing:
    """A shape, the object that it is, and its material."""

    def __init__(self, shape, ids, materials):
        self.shape, self.object, self.material = shape, int(ids[0]), materials[ids[1]]


class Scene:
    def __init__(self, job):
        def array(name):
            return np.load(job.array(name))

        self.job = job
        centre, self.u, self.v, self.e = array("camera")
        self.eye = centre + self.e
        self.ambient, self.background, self.lights = array("ambient"), array("background"), array("lights")
        self.air = Air(array("air"))
        self.materials = [Material(f"Material_{i}", row, job.depth) for i, row in enumerate(array("materials"))]
        self.scale = self._scale(list(self._things(array, 1.0)))
        self.things = list(self._things(array, self.scale))
        self.shadows = job.shadows and len(self.lights) > 0
        self._check(array("media"))

    def _things(self, array, scale):
        def made(kind, shapes):
            for shape, ids in zip(shapes, array(f"{kind}_ids"), strict=True):
                yield Thing(shape, ids, self.materials)

        yield from made("sphere", [Sphere(row, scale) for row in array("spheres")])
        yield from made("box", [Box(row, scale) for row in array("boxes")])
        corners = array("polygon_vertices")
        yield from made("polygon", [Polygon(corners[a : a + n], scale) for a, n in array("polygon_ranges")])
        yield from made("ellipsoid", [Ellipsoid(row, scale) for row in array("ellipsoids")])
        places, faces, ranges = array("mesh_vertices"), array("mesh_triangles"), array("mesh_ranges")
        meshes = [Mesh(places, faces[a : a + n], scale, bool(closed)) for a, n, closed in ranges]
        yield from made("mesh", meshes)
        parts = [
            [Sphere(row, scale) for row in array("csg_spheres")],
            [Box(row, scale) for row in array("csg_boxes")],
            [Ellipsoid(row, scale) for row in array("csg_ellipsoids")],
            [Mesh(places, faces[a : a + n], scale) for a, n in array("csg_meshes")],
        ]
        self._meshes = [*meshes, *parts[3]]
        code, ids = array("csg_code"), array("csg_ids")
        clear = [self.materials[material].glass for _, material in ids]
        ranges = zip(array("csg_ranges"), clear, strict=True)
        yield from made("csg", [Solid(code[a : a + n], parts, glass) for (a, n), glass in ranges])

    def _scale(self, things):
        """A power of ten that makes |e| about SIZE, or less if something would be too far off."""
        things, meshes = _reach(thing.shape for thing in things), _reach(self._meshes)
        furthest = max(things, np.abs(self.eye).max(), np.abs(self.lights[:, :3]).max(initial=0))
        limits = [(SIZE, np.linalg.norm(self.e)), (FAR, furthest), (MESH_FAR, meshes)]
        return 10.0 ** math.floor(math.log10(min(limit / size for limit, size in limits if size > 0)))

    def _check(self, media):
        """Raises Unmappable for anything that POV-Ray would draw differently."""
        job, glass = self.job, [thing for thing in self.things if thing.material.glass]
        if job.depth > LARGEST_DEPTH:
            raise Unmappable(f"depth {job.depth}: POV-Ray traces {LARGEST_DEPTH} orders at most")
        if job.sampler not in ("one", "uniform"):
            raise Unmappable(f"sampler {job.sampler}: POV-Ray has random numbers of its own")
        if any(t.material.mirrors and t.material.permeability != self.air.permeability for t in self.things):
            raise Unmappable("a mu_r that is not AIR's, with k_s > 0: POV-Ray's Fresnel term has no permeability")
        if any(not thing.shape.solid for thing in glass):
            raise Unmappable("a clear polygon or open mesh: POV-Ray bends rays there (MED-4)")
        if self.air.absorbs and self.background.any():
            raise Unmappable("AIR that attenuates and a background: POV-Ray attenuates that too (REF-6)")
        if self.air.absorbs and not all(self.air.attenuation):
            raise Unmappable("AIR that lets nothing of a colour through: POV-Ray cannot take that away within glass")
        self._check_inner_light(glass)
        ranked = {int(row[0]) for row in media}
        ranked = [thing.shape for thing in glass if thing.object in ranked]
        if any(_meet(one, other) for i, one in enumerate(ranked) for other in ranked[:i]):
            raise Unmappable("clear things that may overlap: POV-Ray reflects nothing where a ray leaves the inner one")

    def _check_inner_light(self, glass):
        """POV-Ray turns a normal against the ray, so seen from within a surface is lit from within (HIT-3, LOC-2)."""
        eye = self.eye * self.scale
        if any(t.shape.solid and not t.material.glass and t.shape.contains(eye) for t in self.things):
            raise Unmappable("the eye is in an opaque thing: POV-Ray lights that from within")
        if not glass or not len(self.lights):
            return
        if not self.shadows:
            raise Unmappable("lights and clear things without shadows: POV-Ray lights those from within")
        if any(thing.shape.contains(light[:3] * self.scale) for thing in glass for light in self.lights):
            raise Unmappable("a light in a clear thing: POV-Ray lights that from within")

    def text(self):
        job = self.job
        parts = [
            self._head(),
            "#version 3.7;",
            f"global_settings {{ assumed_gamma 1 max_trace_level {job.depth + 1} adc_bailout 0\n"
            f"  ambient_light rgb {vector(self.ambient)} }}",
            "#default { finish { ambient 0 diffuse 0 } }",
            f"background {{ rgb {vector(self.background)} }}",
            self.air.text(self.scale),
            self._camera(),
        ]
        for light in self.lights:
            parts.append(f"light_source {{ {vector(light[:3] * self.scale)}, rgb {vector(light[3:6])} }}")
        used = {id(thing.material) for thing in self.things}
        parts += [material.texture() for material in self.materials if id(material) in used]
        parts += [self._thing(thing) for thing in self.things]
        return "\n".join(part for part in parts if part) + "\n"

    def _head(self):
        n = samples(self.job)
        lines = [
            "A scene of rayrace for POV-Ray 3.7. The picture that the renderers of rayrace make, in linear light:",
            "  povray "
            + " ".join(["+ITHIS_FILE.pov", *flags(self.job), "+FE"])
            + "    (+FN instead of +FE: the same in sRGB)",
        ]
        if n > 1:
            lines.append(f"and then the mean of each {n} x {n} pixels.")
        if self.scale != 1:
            lines.append(f"All lengths are {number(self.scale)} times those of the scene, for POV-Ray's tolerances.")
        return "\n".join(f"// {line}" for line in lines)

    def _camera(self):
        """CAM-2 and CAM-3. A sample that is not in the middle of its pixel moves the screen."""
        job = self.job
        (sx, sy), scale = job.sample, self.scale
        middle = -self.e + (2 * sx - 1) / job.width * self.u - (2 * sy - 1) / job.height * self.v
        return (
            f"camera {{ perspective location {vector(self.eye * scale)}\n  direction {vector(middle * scale)}\n"
            f"  right {vector(2 * self.u * scale)}\n  up {vector(2 * self.v * scale)} }}"
        )

    def _thing(self, thing):
        material = thing.material
        look = f"\n  texture {{ {material.name} }}{material.interior(self.air, self.scale)}"
        if not (material.glass and self.shadows):
            return thing.shape.text(look if self.shadows else look + " no_shadow")
        # POV-Ray lets light through glass. An opaque twin that no ray sees casts its shadow (ATT-1).
        name = f"Shape_{thing.object}"
        return (
            f"#declare {name} = {thing.shape.text()}\n"
            f"object {{ {name}{look} no_shadow double_illuminate }}\n"
            f"object {{ {name} texture {{ pigment {{ rgb 0 }} }} no_image no_reflection }}"
        )


def samples(job):
    """n of n x n samples a pixel: the pixels of a picture n times as wide and high lie where SAM-1 has them."""
    return job.samples if job.sampler == "uniform" else 1


def flags(job):
    """The command line's words on size, region and samples."""
    n = samples(job)
    x0, y0, x1, y1 = (edge * n for edge in job.region)
    words = [f"+W{job.width * n}", f"+H{job.height * n}", "-A"]
    if job.region != (0, 0, job.width, job.height):
        words += [f"+SC{x0 + 1}", f"+SR{y0 + 1}", f"+EC{x1}", f"+ER{y1}"]
    return words


def _reach(shapes):
    """The largest coordinate of the bounded shapes."""
    edges = [edge for shape in shapes for edge in shape.bounds() if np.isfinite(edge).all()]
    return np.abs(edges).max(initial=0)


def _meet(one, other):
    """Returns whether the two solids may share a point, by their boxes; exact for two spheres."""
    if isinstance(one, Sphere) and isinstance(other, Sphere):
        return np.linalg.norm(np.subtract(one.centre, other.centre)) < one.radius + other.radius
    (low, high), (bottom, top) = one.bounds(), other.bounds()
    return bool((low < top).all() and (bottom < high).all())
