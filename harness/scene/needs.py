"""The features that a picture of a scene uses: what a renderer's manifest must name to be given the job."""

from harness.scene.model import Box, Ellipsoid, Polygon, Sphere

SHAPES = {Sphere: "sphere", Box: "box", Polygon: "polygon", Ellipsoid: "ellipsoid"}

BLACK = OPAQUE = (0.0, 0.0, 0.0)
CLEAR = (1.0, 1.0, 1.0)


def needs(scene, depth, shadows):
    """Sorted names of the features of a job of kind `image` at this depth, with shadows on or off.

    sphere, box, polygon, ellipsoid   there is one
    ambient        the ambient light is not black
    diffuse        there is a light, and some diffuse colour is not black
    phong          there is a light, and some k_s > 0
    shadows        asked for, and there are a light and an object
    reflection     depth > 0, and some k_s > 0
    transmission   depth > 0, and some k_s > 0 with an attenuation that is not (0, 0, 0)
    attenuation    AIR's attenuation is not (1, 1, 1), or that of a material counted in `transmission` is not
    """
    materials = {thing.material for thing in scene.objects}
    glossy = {m for m in materials if m.k_s > 0}
    clear = {m for m in glossy if m.attenuation != OPAQUE} if depth > 0 else set()
    tests = {
        "ambient": scene.ambient != BLACK,
        "diffuse": scene.lights and any(m.diffuse != BLACK for m in materials),
        "phong": scene.lights and glossy,
        "shadows": shadows and scene.lights and scene.objects,
        "reflection": depth > 0 and glossy,
        "transmission": clear,
        "attenuation": scene.air.attenuation != CLEAR or any(m.attenuation != CLEAR for m in clear),
    }
    return tuple(sorted(shapes(scene) | {name for name, needed in tests.items() if needed}))


def shapes(scene):
    """The set of names of the shapes in a scene: all that a list of rays needs."""
    return {SHAPES[type(thing)] for thing in scene.objects}
