"""Lists what a picture of a scene can do without: each leave-out changes the scene, or the job, into a smaller model.

A leave-out is listed only where it applies: a scene without a soft light has none that makes it hard. Changes go by the
place of an object or a light in the full scene, where one that is left out leaves a None, so that any of them can be
made together, in any order: `apply` makes a scene of the rest.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from harness.reduction.proof import Proof
from harness.renderer.parameters import Parameters
from harness.scene import surface
from harness.scene.media import media, solid
from harness.scene.model import Air, Csg, Light, Material, Mesh, Object, Operator, Scene
from harness.scene.needs import BLACK, CLEAR, OPAQUE, SHAPES, needs

DEPTHS = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
CUTOFFS = (-10, -8, -6)  # powers of 2: weights of rays (CUT-1)
COARSER = (2, 4, 8)  # times fewer triangles
LEAST = 4  # triangles of a closed mesh
MOST = 1 - 1e-9  # of a constant Fresnel share: at 1 the permeability would be infinite
ANGLES = 4096  # of incidence, over which a Fresnel share is averaged

# Kinds that are also left out of all that has them, at once.
TOGETHER = {
    "specular shares": "specular share of all materials",
    "transmission": "transmission of all materials",
    "attenuation": "all attenuation",
    "fresnel": "constant Fresnel share of all materials",
    "media": "medium of the air in place of all materials",
    "roughness": "roughness of all materials",
}

Change = Callable[[Scene, Parameters], tuple[Scene, Parameters]]

# Kinds of leave-outs, as [leave_out] of an experiment names them. Names of leave-outs begin likewise, and add which.
KINDS = (
    *("shadows", "soft shadows", "feelers", "glossy reflection", "glossy rays", "lens", "supersampling", "samples"),
    *("depth", "cut-off", "float64", "single rays", "ambient light", "attenuation", "lights", "radii of lights"),
    *("specular shares", "roughness", "transmission", "fresnel", "media", "objects", "parts", "triangles"),
)


@dataclass(frozen=True)
class LeaveOut:
    """What is left out, one of KINDS and in words, and the change that leaves it out.

    proof: why no picture can change by it, from the rules of SPEC.md; "" where that must be measured. unavailable: ""
    or why it cannot be made here.
    """

    kind: str
    name: str
    change: Change
    proof: str = ""
    unavailable: str = ""


def leave_outs(scene: Scene, job: Parameters, kinds: Iterable[str] = KINDS) -> list[LeaveOut]:
    """Everything of these kinds that can be left out of a scene and its job alone: of the job, then lights, materials
    and objects."""
    proof, wanted = Proof(scene, job), set(kinds)
    listed = [*_of_job(scene, job, proof), *_of_lights(scene, job, proof), *_of_materials(scene, job)]
    listed += _together(listed)
    listed += _of_objects(scene, proof, "triangles" in wanted)
    return [leave_out for leave_out in listed if leave_out.kind in wanted]


def apply(listed: Iterable[LeaveOut], scene: Scene, job: Parameters) -> tuple[Scene, Parameters]:
    """The scene and the job without all that is listed."""
    for leave_out in listed:
        scene, job = leave_out.change(scene, job)
    objects = tuple(thing for thing in scene.objects if thing is not None)
    return replace(scene, objects=objects, lights=tuple(light for light in scene.lights if light is not None)), job


def _together(listed: list[LeaveOut]) -> Iterator[LeaveOut]:
    """One leave-out of each kind of TOGETHER of which there are several."""
    for kind, name in TOGETHER.items():
        changes = [leave_out.change for leave_out in listed if leave_out.kind == kind]
        if len(changes) > 1:
            yield LeaveOut(kind, name, _all(changes))


def _all(changes: list[Change]) -> Change:
    def change(scene: Scene, job: Parameters):
        for part in changes:
            scene, job = part(scene, job)
        return scene, job

    return change


def _job(**values) -> Change:
    return lambda scene, job: (scene, replace(job, **values))


def _fewer(**values) -> Change:
    """Lowers numbers of the job, none of which it raises."""

    def change(scene: Scene, job: Parameters):
        return scene, replace(job, **{name: min(value, getattr(job, name)) for name, value in values.items()})

    return change


def _of_job(scene: Scene, job: Parameters, proof: Proof) -> list[LeaveOut]:
    used, listed = needs(scene, job), []
    if "shadows" in used:
        listed.append(LeaveOut("shadows", "shadows", _job(shadows=False)))
    if job.shadows and job.feelers > 0:
        hard = "" if "soft" in used else "no feeler goes to a light without a radius (SOF-1)"
        listed.append(LeaveOut("soft shadows", "soft shadows", _fewer(feelers=0), hard))
        if job.feelers > 1 and not hard:
            listed.append(LeaveOut("feelers", f"feelers {job.feelers} to 1", _fewer(feelers=1)))
    if job.glossy_rays > 0:
        sharp = "" if "glossy" in used else "no ray is reflected by a material with a roughness (GLO-1)"
        listed.append(LeaveOut("glossy reflection", "glossy reflection", _fewer(glossy_rays=0), sharp))
        if job.glossy_rays > 1 and not sharp:
            listed.append(LeaveOut("glossy rays", f"glossy rays {job.glossy_rays} to 1", _fewer(glossy_rays=1)))
    if "lens" in used:
        listed.append(LeaveOut("lens", "lens", _job(lens_radius=0.0)))
    listed += _of_samples(job)
    for depth in DEPTHS:
        if depth < job.depth:
            enough = proof.depth(depth)
            listed.append(LeaveOut("depth", f"depth {job.depth} to {depth}", _fewer(depth=depth), enough))
            if enough:  # so is every greater one
                break
    # Adaptive samples know no cut-off (CUT-4).
    if "reflection" in used and job.sampler != "adaptive":
        names = {f"rays of a weight up to 2^{power}": 2.0**power for power in CUTOFFS}
        listed += [LeaveOut("cut-off", name, _cut(cutoff)) for name, cutoff in names.items() if cutoff > job.cutoff]
    if job.precision == "float64":
        listed.append(LeaveOut("float64", "float64 to float32", _job(precision="float32")))
    if job.vector == "off":
        listed.append(LeaveOut("single rays", "one ray at a time, to lanes", _job(vector="on")))
    if scene.ambient != BLACK:
        listed.append(
            LeaveOut("ambient light", "ambient light", lambda scene, job: (replace(scene, ambient=BLACK), job))
        )
    if scene.air.attenuation != CLEAR:
        listed.append(LeaveOut("attenuation", "attenuation of the air", _clear_air))
    return listed


def _of_samples(job: Parameters) -> list[LeaveOut]:
    if job.sampler == "one":
        return []
    listed = [LeaveOut("supersampling", "supersampling", _job(sampler="one", samples=1, spp=1))]
    if job.sampler == "adaptive" and job.adaptive_depth > 1:
        name = f"halvings of a pixel {job.adaptive_depth} to 1"
        listed.append(LeaveOut("samples", name, _fewer(adaptive_depth=1)))
    elif job.sampler == "sobol" and job.spp > 4:
        fewer = job.spp // 4
        listed.append(LeaveOut("samples", f"samples {job.spp} to {fewer}", _fewer(spp=fewer)))
    elif job.sampler not in ("adaptive", "sobol") and job.samples > 2:
        half = job.samples // 2
        name = f"samples {job.samples} x {job.samples} to {half} x {half}"
        listed.append(LeaveOut("samples", name, _fewer(samples=half)))
    return listed


def _cut(cutoff: float) -> Change:
    """Raises the cut-off, which means nothing at depth 0."""
    return lambda scene, job: (scene, replace(job, cutoff=max(cutoff, job.cutoff)))


def _clear_air(scene: Scene, job: Parameters) -> tuple[Scene, Parameters]:
    return replace(scene, air=replace(scene.air, attenuation=CLEAR)), job


def _of_lights(scene: Scene, job: Parameters, proof: Proof) -> list[LeaveOut]:
    listed, soft = [], "soft" in needs(scene, job)
    for place, light in enumerate(scene.lights):
        listed.append(LeaveOut("lights", f"light {place + 1}", _light(place, lambda light: None), proof.light(place)))
        if light.radius > 0 and soft and len(scene.lights) > 1:
            listed.append(LeaveOut("radii of lights", f"radius of light {place + 1}", _light(place, _hard)))
    return listed


def _hard(light: Light) -> Light:
    return replace(light, radius=0.0)


def _light(place: int, new: Callable[[Light], Light | None]) -> Change:
    def change(scene: Scene, job: Parameters):
        return replace(scene, lights=_replaced(scene.lights, [place], new)), job

    return change


def _objects(places: list[int], new: Callable[[Object], Object | None]) -> Change:
    def change(scene: Scene, job: Parameters):
        return replace(scene, objects=_replaced(scene.objects, places, new)), job

    return change


def _replaced(things: tuple, places: list[int], new: Callable) -> tuple:
    """The things with those at the places made new, but for what has been left out already."""
    chosen = set(places)
    return tuple(new(thing) if at in chosen and thing is not None else thing for at, thing in enumerate(things))


def _of_materials(scene: Scene, job: Parameters) -> list[LeaveOut]:
    users: dict[Material, list[int]] = {}
    for place, thing in enumerate(scene.objects):
        users.setdefault(thing.material, []).append(place)
    used, ranked, listed = needs(scene, job), media(scene), []
    for material, places in users.items():
        first = _called(scene, scene.objects[places[0]])
        whose = f"of the material of {first}" + f" and {len(places) - 1} more" * (len(places) > 1)
        if material.k_s > 0 and {"phong", "reflection"} & set(used):
            listed.append(
                LeaveOut("specular shares", f"specular share {whose}", _material(places, lambda m: replace(m, k_s=0.0)))
            )
        if material.k_s == 0 or "reflection" not in used:
            continue
        if material.roughness > 0 and "glossy" in used:
            listed.append(LeaveOut("roughness", f"roughness {whose}", _material(places, _smooth)))
        clear = material.attenuation != OPAQUE
        solids = any(solid(scene.objects[place]) for place in places)
        if clear:
            listed.append(LeaveOut("transmission", f"transmission {whose}", _material(places, _opaque)))
        if clear and material.attenuation != CLEAR and solids:
            listed.append(LeaveOut("attenuation", f"attenuation {whose}", _material(places, _clear)))
        air = scene.air
        same = (material.eps_r, material.mu_r) == (air.eps_r, air.mu_r)
        lone = same and not ranked
        why = "its eps_r and mu_r are those of the air, the one medium it borders, so R = 0 (REF-2)" if lone else ""
        what = "constant Fresnel share, no refraction," if clear and solids else "constant Fresnel share"
        if not same or lone:
            listed.append(LeaveOut("fresnel", f"{what} {whose}", _material(places, _constant(air)), why))
        if clear and not same:
            listed.append(LeaveOut("media", f"medium of the air in place {whose}", _material(places, _like(air))))
    return listed


def _smooth(material: Material) -> Material:
    return replace(material, roughness=0.0)


def _opaque(material: Material) -> Material:
    return replace(material, attenuation=OPAQUE)


def _clear(material: Material) -> Material:
    """No attenuation, unless it has been made opaque."""
    return material if material.attenuation == OPAQUE else replace(material, attenuation=CLEAR)


def _like(air: Air) -> Callable[[Material], Material]:
    return lambda material: replace(material, eps_r=air.eps_r, mu_r=air.mu_r)


def _constant(air: Air) -> Callable[[Material], Material]:
    """Makes R of a material in the air the same at all angles: where N = 1, R = ((1 - M)/(1 + M))^2 (REF-2), and
    nothing is bent.

    It is the mean over a sphere as a distant eye sees it, where c^2 is uniform; so it is, on average over all ways to
    turn it, of any convex solid (Cauchy).
    """

    def new(material: Material) -> Material:
        if (material.eps_r, material.mu_r) == (air.eps_r, air.mu_r):
            return material
        root = np.sqrt(min(share(material, air), MOST))
        mu_r = air.mu_r * (1 + root) / (1 - root)
        return replace(material, eps_r=air.eps_r * air.mu_r / mu_r, mu_r=mu_r)

    return new


def share(material: Material, air: Air) -> float:
    """The mean of R (REF-2), seen from the air, over angles whose squared cosine is uniform."""
    c = np.sqrt((np.arange(ANGLES) + 0.5) / ANGLES)
    n = np.sqrt(air.eps_r * air.mu_r / (material.eps_r * material.mu_r))
    m = air.mu_r / material.mu_r
    x = 1 - n**2 * (1 - c**2)
    s = np.sqrt(np.maximum(x, 0))
    r = (((n * c - m * s) / (n * c + m * s)) ** 2 + ((m * c - n * s) / (m * c + n * s)) ** 2) / 2
    return float(np.mean(np.where(x > 0, r, 1.0)))


def _material(places: list[int], new: Callable[[Material], Material]) -> Change:
    return _objects(places, lambda thing: replace(thing, material=new(thing.material)))


def _of_objects(scene: Scene, proof: Proof, coarser: bool) -> list[LeaveOut]:
    """coarser: meshes too, which takes time."""
    listed = []
    for place, thing in enumerate(scene.objects):
        name = _called(scene, thing)
        listed.append(LeaveOut("objects", name, _objects([place], lambda thing: None), proof.thing(place)))
        if coarser and isinstance(thing, Mesh):
            listed += _of_mesh(place, thing, name)
        if isinstance(thing, Csg):
            for number, part in enumerate(thing.parts(), 1):
                if _without_part(thing, part) is not None:
                    less = _objects([place], lambda solid, part=part: _without_part(solid, part) or solid)
                    listed.append(LeaveOut("parts", f"part {number} ({SHAPES[type(part)]}) of {name}", less))
    return listed


def _of_mesh(place: int, mesh: Mesh, name: str) -> Iterator[LeaveOut]:
    """Coarser ones of it, as fast-simplification makes them, an optional package."""
    full = least = len(mesh.triangles)
    for wanted in (full // times for times in COARSER):
        if wanted < LEAST:
            return
        coarse, why = _decimated(mesh, wanted)
        if coarse is None:
            yield LeaveOut("triangles", f"triangles {full:,} to {wanted:,} of {name}", _job(), unavailable=why)
        elif len(coarse.triangles) < least:
            least = len(coarse.triangles)
            yield LeaveOut(
                "triangles", f"triangles {full:,} to {least:,} of {name}", _objects([place], _coarser(coarse))
            )


def _coarser(coarse: Mesh) -> Callable[[Mesh], Mesh]:
    """Puts a coarser mesh in the place of one, unless it is coarser still; materials stay."""

    def new(mesh: Mesh) -> Mesh:
        return mesh if len(mesh.triangles) < len(coarse.triangles) else replace(coarse, material=mesh.material)

    return new


def _decimated(mesh: Mesh, wanted: int) -> tuple[Mesh | None, str]:
    """The mesh with about so many triangles, or None and why there is none."""
    try:
        from fast_simplification import simplify
    except ImportError:
        return None, "unsupported: no fast-simplification here; pip install 'rayrace[simplify]'"
    points, corners = simplify(mesh.vertices, mesh.triangles, target_count=wanted)
    vertices, triangles = surface.with_area(np.asarray(points, np.float64), np.asarray(corners, np.int32))
    if not 0 < len(triangles) < len(mesh.triangles):
        return None, "unsupported: fast-simplification takes no triangle off it"
    outward = surface.outward(vertices, triangles) if mesh.closed else triangles
    if outward is None:
        return None, "unsupported: the coarser mesh is not closed, so it would bound no medium"
    triangles = np.asarray(outward, np.int32)
    return Mesh(mesh.material, vertices, triangles, mesh.closed, line=mesh.line), ""


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
