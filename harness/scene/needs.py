"""Determines the features that a picture of a scene uses; a renderer gets the job if its manifest names them."""

import numpy as np

from harness.scene.bounds import bounds
from harness.scene.contact import contact
from harness.scene.media import lens_cut, media, solid
from harness.scene.model import Box, Csg, Ellipsoid, Mesh, Polygon, Sphere

SHAPES = {
    Sphere: "sphere",
    Box: "box",
    Polygon: "polygon",
    Ellipsoid: "ellipsoid",
    Mesh: "mesh",
    Csg: "csg",
}

BLACK = OPAQUE = (0.0, 0.0, 0.0)
CLEAR = (1.0, 1.0, 1.0)

MOST_FLOAT32 = 1e9  # its fourth power is finite in float32 (NUM-6)
# Needs that no renderer meets.
FAR_FLOAT32 = f"lengths above {MOST_FLOAT32:g} in float32"
LENS_CUT = "a lens partly inside a clear solid (LEN-2)"


def needs(scene, parameters):
    """Sorted names of the features of a job of kind `image` with these `job.Parameters`.

    sphere, box, polygon, ellipsoid, mesh, csg   there is one; parts of a CSG solid are csg, and mesh if one is a mesh
    ambient         the ambient light is not black
    diffuse         there is a light, and some diffuse colour is not black
    phong           there is a light, and some k_s > 0
    shadows         parameter shadows, and there are a light and an object
    soft            shadows, with feelers to a light that has a radius
    reflection      depth > 0, and some k_s > 0
    transmission    depth > 0, and some k_s > 0 with an attenuation that is not (0, 0, 0)
    glossy          depth > 0 and glossy rays, and some k_s > 0 with a roughness > 0
    attenuation     not (1, 1, 1) in AIR, or in a clear solid that a ray can be in: one of `transmission`, one that
                    contains the eye, or any if there is a lens
    media           some clear solids have a rank (MED-2), or contact
    contact         faces of a ranked solid and another object, or two that are seen, may be in one place (MED-6)
    supersampling   sampler uniform, jittered or sobol
    sobol           sampler sobol
    adaptive        sampler adaptive
    lens            lens_radius > 0
    cutoff          cutoff > 0, and reflection
    FAR_FLOAT32     precision float32, and a coordinate or length above MOST_FLOAT32
    LENS_CUT        a lens that a clear solid holds a part of, but not all
    """
    depth, lens = parameters.depth, parameters.lens_radius > 0
    materials = {thing.material for thing in scene.objects}
    specular = {m for m in materials if m.k_s > 0}
    ranked, touching = media(scene), contact(scene)
    inside = {scene.objects[i].material for i, eye in ranked if eye}
    for thing in scene.objects:
        m = thing.material
        if m.attenuation != OPAQUE and (lens or (depth > 0 and m.k_s > 0)) and solid(thing):
            inside.add(m)
    shadows = parameters.shadows and scene.lights and scene.objects
    tests = {
        "ambient": scene.ambient != BLACK,
        "diffuse": scene.lights and any(m.diffuse != BLACK for m in materials),
        "phong": scene.lights and specular,
        "shadows": shadows,
        "soft": shadows and parameters.feelers > 0 and any(light.radius > 0 for light in scene.lights),
        "reflection": depth > 0 and specular,
        "transmission": depth > 0 and any(m.attenuation != OPAQUE for m in specular),
        "glossy": depth > 0 and parameters.glossy_rays > 0 and any(m.roughness > 0 for m in specular),
        "attenuation": scene.air.attenuation != CLEAR or any(m.attenuation != CLEAR for m in inside),
        "media": ranked or touching,
        "contact": touching,
        "supersampling": parameters.sampler in ("uniform", "jittered", "sobol"),
        "sobol": parameters.sampler == "sobol",
        "adaptive": parameters.sampler == "adaptive",
        "lens": lens,
        "cutoff": depth > 0 and specular and parameters.cutoff > 0,
        LENS_CUT: lens and lens_cut(scene, parameters.lens_radius),
        FAR_FLOAT32: parameters.precision == "float32" and farthest(scene) > MOST_FLOAT32,
    }
    return tuple(sorted(shapes(scene) | {name for name, needed in tests.items() if needed}))


def farthest(scene) -> float:
    """The largest size of a coordinate of a scene: of its camera, lights and objects, parts of CSG solids included."""
    things = [part for thing in scene.objects for part in (thing.parts() if isinstance(thing, Csg) else [thing])]
    camera = scene.camera
    points = [camera.centre, camera.u, camera.v, camera.e, *(light.position for light in scene.lights)]
    return float(max(np.abs(points).max(), np.abs(bounds(things)).max(initial=0)))


def shapes(scene):
    """The set of names of the shapes in a scene: the needs of a list of rays."""
    parts = (part for thing in scene.objects if isinstance(thing, Csg) for part in thing.parts())
    meshes = {"mesh"} if any(isinstance(part, Mesh) for part in parts) else set()
    return meshes | {SHAPES[type(thing)] for thing in scene.objects}
