"""Lists what a picture of a scene can do without: each leave-out changes the scene, or the job, into a smaller model.

A leave-out is listed only where it applies: a scene without a soft light has none that makes it hard.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from harness.renderer.parameters import Parameters
from harness.scene.media import solid
from harness.scene.model import Csg, Light, Material, Object, Operator, Scene
from harness.scene.needs import BLACK, CLEAR, OPAQUE, SHAPES, needs

DEPTHS = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32)

Change = Callable[[Scene, Parameters], tuple[Scene, Parameters]]


@dataclass(frozen=True)
class LeaveOut:
    """What is left out, in words, and the change that leaves it out.

    proof: why no picture can change by it, from the rules of SPEC.md; "" where that must be measured.
    """

    name: str
    change: Change
    proof: str = ""


def leave_outs(scene: Scene, job: Parameters) -> list[LeaveOut]:
    """Everything that can be left out of a scene and its job alone: of the job, then lights, materials and objects."""
    return [*_of_job(scene, job), *_of_lights(scene, job), *_of_materials(scene, job), *_of_objects(scene)]


def _job(**values) -> Change:
    return lambda scene, job: (scene, replace(job, **values))


def _of_job(scene: Scene, job: Parameters) -> list[LeaveOut]:
    used, found = needs(scene, job), []
    if "shadows" in used:
        found.append(LeaveOut("shadows", _job(shadows=False)))
    if job.shadows and job.feelers > 0:
        hard = "" if "soft" in used else "no feeler goes to a light without a radius (SOF-1)"
        found.append(LeaveOut("soft shadows", _job(feelers=0), hard))
        if job.feelers > 1 and not hard:
            found.append(LeaveOut(f"feelers {job.feelers} to 1", _job(feelers=1)))
    if job.glossy_rays > 0:
        sharp = "" if "glossy" in used else "no ray is reflected"
        found.append(LeaveOut("glossy reflection", _job(glossy_rays=0), sharp))
        if job.glossy_rays > 1 and not sharp:
            found.append(LeaveOut(f"glossy rays {job.glossy_rays} to 1", _job(glossy_rays=1)))
    if "lens" in used:
        found.append(LeaveOut("lens", _job(lens_radius=0.0)))
    if {"supersampling", "adaptive"} & set(used):
        found.append(LeaveOut("supersampling", _job(sampler="one", samples=1)))
    dark = "" if "reflection" in used else "no surface has k_s > 0, so no ray is reflected or transmitted"
    for depth in (0,) if dark else DEPTHS:
        if depth < job.depth:
            found.append(LeaveOut(f"depth {job.depth} to {depth}", _job(depth=depth), dark))
    if job.precision == "float64":
        found.append(LeaveOut("float64 to float32", _job(precision="float32")))
    if job.vector == "off":
        found.append(LeaveOut("one ray at a time, to lanes", _job(vector="on")))
    if scene.ambient != BLACK:
        found.append(LeaveOut("ambient light", lambda scene, job: (replace(scene, ambient=BLACK), job)))
    if scene.air.attenuation != CLEAR:
        found.append(LeaveOut("attenuation of the air", _clear_air))
    return found


def _clear_air(scene: Scene, job: Parameters) -> tuple[Scene, Parameters]:
    return replace(scene, air=replace(scene.air, attenuation=CLEAR)), job


def _of_lights(scene: Scene, job: Parameters) -> list[LeaveOut]:
    found = []
    for number, light in enumerate(scene.lights, 1):
        dark = "its colour is black" if light.colour == BLACK else ""
        found.append(LeaveOut(f"light {number}", _without_light(light), dark))
        if light.radius > 0 and "soft" in needs(scene, job) and len(scene.lights) > 1:
            found.append(LeaveOut(f"radius of light {number}", _hard(light)))
    return found


def _without_light(left: Light) -> Change:
    def change(scene: Scene, job: Parameters):
        return replace(scene, lights=tuple(light for light in scene.lights if light is not left)), job

    return change


def _hard(soft: Light) -> Change:
    def change(scene: Scene, job: Parameters):
        lights = (replace(light, radius=0.0) if light is soft else light for light in scene.lights)
        return replace(scene, lights=tuple(lights)), job

    return change


def _of_materials(scene: Scene, job: Parameters) -> list[LeaveOut]:
    users: dict[Material, list[Object]] = {}
    for thing in scene.objects:
        users.setdefault(thing.material, []).append(thing)
    used, found = needs(scene, job), []
    for material, things in users.items():
        whose = f"of the material of {_called(scene, things[0])}" + f" and {len(things) - 1} more" * (len(things) > 1)
        if material.k_s > 0 and {"phong", "reflection"} & set(used):
            found.append(LeaveOut(f"specular share {whose}", _material(material, k_s=0.0)))
        clear = material.attenuation != OPAQUE and material.k_s > 0
        if clear and "transmission" in used:
            found.append(LeaveOut(f"transmission {whose}", _material(material, attenuation=OPAQUE)))
            if material.attenuation != CLEAR and any(map(solid, things)):
                found.append(LeaveOut(f"attenuation {whose}", _material(material, attenuation=CLEAR)))
    return found


def _material(old: Material, **values) -> Change:
    new = replace(old, **values)

    def change(scene: Scene, job: Parameters):
        things = (replace(thing, material=new) if thing.material == old else thing for thing in scene.objects)
        return replace(scene, objects=tuple(things)), job

    return change


def _of_objects(scene: Scene) -> list[LeaveOut]:
    found = []
    for thing in scene.objects:
        name = _called(scene, thing)
        found.append(LeaveOut(name, _instead(thing, None)))
        if isinstance(thing, Csg):
            for number, part in enumerate(thing.parts(), 1):
                rest = _without_part(thing, part)
                if rest is not None:
                    found.append(LeaveOut(f"part {number} ({SHAPES[type(part)]}) of {name}", _instead(thing, rest)))
    return found


def _instead(old: Object, new: Object | None) -> Change:
    def change(scene: Scene, job: Parameters):
        things = (new if thing is old else thing for thing in scene.objects)
        return replace(scene, objects=tuple(thing for thing in things if thing is not None)), job

    return change


def _without_part(solid: Csg, left: Object) -> Csg | None:
    """A CSG solid without one of its parts: of an operator with one operand less, the other remains. None if the whole
    is gone, or if what remains is the outside of a part, which has no bounds."""

    def joined(operator: Operator):
        return lambda a, b: (*a, *b, operator) if a and b else a or b

    code = solid.fold(
        lambda part: () if part is left else (part,),
        joined(Operator.OR),
        joined(Operator.AND),
        lambda a: (*a, Operator.NOT) if a else a,
    )
    if not code:
        return None
    unbounded = Csg(None, code).fold(
        lambda part: False,
        lambda a, b: a or b,
        lambda a, b: a and b,
        lambda a: not a,
    )
    return None if unbounded else replace(solid, code=code)


def _called(scene: Scene, thing: Object) -> str:
    """What an object is called: its shape, and its line in the file or else its number in the scene."""
    place = f"of line {thing.line}" if thing.line else f"{scene.objects.index(thing) + 1}"
    return f"the {SHAPES[type(thing)]} {place}"
