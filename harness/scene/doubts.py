"""Finds what is valid in a scene and seldom meant: each doubt with its place and what to do."""

import numpy as np

from harness.errors import UserError
from harness.scene import check, surface
from harness.scene.bounds import bounds, padded
from harness.scene.media import OPAQUE, holds, solid
from harness.scene.model import Mesh
from harness.scene.needs import SHAPES

BLACK = (0.0, 0.0, 0.0)
ROUNDING = 2.0**-52  # of a coordinate in float64
COARSE = 1e-3  # of the eye's distance from the screen: rounding by more than this is seen
CLOSE = 1e-5  # of a mesh's extent: vertices nearer to each other than this were meant to be one
LOBE = "a material is glossy with a roughness above 0, the number after its mu_r (GLO-2)"


def warnings(scene, jobs=(), free=()) -> list[str]:
    """Returns what is seldom meant in a `Scene`: a slanting view, open clear meshes, objects too large, darkness; then
    which methods of `jobs` do nothing in it, and what of it they leave out. free: names of methods that are still to be
    chosen.
    """
    of_jobs = (_text(scene, 0, what, remedy) for what, remedy in of_methods(scene, jobs, free))
    return [*_slant(scene), *_open_meshes(scene), *_large(scene), *dark(scene), *of_jobs]


def dark(scene) -> list[str]:
    """Why a picture of the scene would be black or of one colour: the view, the eye, the lights."""
    if not scene.objects:
        return []
    boxes = padded(bounds(scene.objects))
    return [*_view(scene, boxes), *_eye(scene, boxes), *_lights(scene, boxes)]


def of_methods(scene, jobs, free=()) -> list[tuple[str, str]]:
    """Returns which methods of jobs do nothing in a scene, and what of the scene they leave out, each with its remedy.

    jobs: `job.Parameters` of pictures of the scene: a method of any of them may do nothing; what all of them leave out
    is left out. free: names of methods that are still to be chosen.
    """
    rough = any(thing.material.k_s > 0 and thing.material.roughness > 0 for thing in scene.objects)
    soft = any(light.radius > 0 for light in scene.lights)
    doubts = []
    if "glossy_rays" not in free:
        most = max((job.glossy_rays for job in jobs if job.depth > 0), default=None)
        if most and not rough:
            doubts.append(("glossy_rays does nothing here: every mirror is perfect", LOBE))
        if most == 0 and rough:
            doubts.append(("its glossy materials are rendered as perfect mirrors", "ask for glossy_rays, 1 or more"))
    if "feelers" not in free and scene.objects:
        most = max((job.feelers for job in jobs if job.shadows), default=None)
        if most and not soft:
            doubts.append(
                ("feelers does nothing here: every light is a point", "a light is soft with a radius above 0")
            )
        if most == 0 and soft:
            doubts.append(("its lights with a radius are rendered as points", "ask for feelers, 1 or more"))
    return doubts


def stretched(scene, width: int, height: int) -> list[str]:
    """The warning that a picture has another shape than its screen, |u| : |v|; [] if it has that, to a pixel."""
    camera = scene.camera
    shape = check.length(camera.u) / check.length(camera.v)
    down, across = round(width / shape), round(height * shape)
    if abs(height - width / shape) <= 1 or abs(width - height * shape) <= 1:
        return []
    what = f"a picture of {width} x {height} stretches its screen, which is {shape:.3g} times as wide as it is high"
    return [_text(scene, camera.line, what, f"take {width} x {max(down, 1)} or {max(across, 1)} x {height}")]


def of_picture(scene, picture: np.ndarray) -> list[str]:
    """The warning that a whole picture (height, width, 3) has one colour, and why; [] if it has several."""
    what = one_colour(picture)
    if what is None or dark(scene):  # which is told with the scene
        return []
    if not scene.objects:
        why, remedy = "the scene has no objects", "add one"
    elif not any(light.colour != BLACK for light in scene.lights) and scene.ambient == BLACK:
        why, remedy = "the scene has neither a LIGHT nor AMBIENT light", "add one"
    else:
        why = "one surface fills the picture, or no light reaches what the eye sees"
        remedy = "look at where the eye, the lights and the objects are"
    return [_text(scene, 0, f"{what}: {why}", remedy)]


def one_colour(picture: np.ndarray) -> str | None:
    """That every pixel of a picture (height, width, 3) has one colour; None if it has several, or one pixel."""
    first = picture[0, 0]
    if picture.shape[:2] == (1, 1) or not (picture == first).all():
        return None
    return f"every pixel of the picture is ({', '.join(f'{channel:.3g}' for channel in first.tolist())})"


def _text(scene, line: int, what: str, remedy: str) -> str:
    return str(UserError(what, file=scene.file, line=line or None, remedy=remedy))


def _slant(scene) -> list[str]:
    camera = scene.camera
    angle = check.slant(camera.u, camera.v, camera.e)
    if not angle:
        return []
    what = f"the eye is {angle:.3g} degrees off the normal of the screen, so the perspective is oblique"
    remedy = "to have it straight, write the distance of the eye in place of e"
    return [_text(scene, camera.line, what, remedy)]


def _open_meshes(scene) -> list[str]:
    """Meshes of files that are meant to be glass."""
    texts = {}
    for mesh in scene.objects:
        if not isinstance(mesh, Mesh) or mesh.closed or mesh.path in ("", *texts):
            continue
        if mesh.material.attenuation != OPAQUE and mesh.material.k_s > 0:
            why, remedy = _gaps(mesh)
            what = f'the clear mesh "{mesh.path}" does not close: {why}; it is flat, and nothing is inside it'
            texts[mesh.path] = _text(scene, mesh.line, what, f"{remedy}, or make it opaque: attenuation (0,0,0)")
    return list(texts.values())


def _large(scene) -> list[str]:
    """The object of the largest coordinate, if rounding moves it by what the eye sees."""
    if not scene.objects:
        return []
    boxes = bounds(scene.objects)
    sizes = np.where(np.isfinite(boxes), np.abs(boxes), 0).max(axis=(1, 2))
    thing, size, near = scene.objects[sizes.argmax()], sizes.max(), check.length(scene.camera.e)
    if size * ROUNDING <= COARSE * near:
        return []
    what = f"the {SHAPES[type(thing)]} has coordinates up to {size:.2g}, which float64 holds to {size * ROUNDING:.2g}"
    what += f"; the eye is {near:.2g} from the screen, so its surface may be drawn wrong"
    return [_text(scene, thing.line, what, "make it smaller, or bring it nearer")]


def _gaps(mesh: Mesh) -> tuple[str, str]:
    """Why a mesh does not close, and what to do."""
    once, often = surface.unpaired(mesh.triangles)
    extent = np.ptp(mesh.vertices, axis=0).max()
    from scipy.spatial import cKDTree  # here, because few scenes have such a mesh

    near = cKDTree(mesh.vertices).query(mesh.vertices, 2)[0][:, 1] if len(mesh.vertices) > 1 else np.array([np.inf])
    close = int((near < CLOSE * extent).sum())
    if once and close:
        why = f"{_count(once, 'edge')} {_have(once)} one triangle, and {close:,} vertices all but coincide with another"
        return why, "merge vertices by distance in a modelling program"
    if once:
        return f"{_count(once, 'edge')} {_have(once)} one triangle", "close its holes"
    if often:
        why = f"{_count(often, 'edge')} {_have(often)} more than two triangles, as where faces are doubled"
        return why, "remove doubled and inner faces"
    return "it has one side only, or two that coincide", "give it an inside"


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}{'s' * (number != 1)}"


def _have(number: int) -> str:
    return "has" if number == 1 else "have"


def _view(scene, boxes) -> list[str]:
    camera = scene.camera
    e, u, v = (np.array(each) for each in (camera.e, camera.u, camera.v))
    ahead = np.cross(u, v)
    ahead = -ahead if ahead @ e > 0 else ahead
    corners = [-e - u - v, -e + u - v, -e + u + v, -e - u + v]
    sides = [np.cross(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    sides = [side if side @ -e > 0 else -side for side in sides]
    lows, highs = (boxes[:, i] - (np.array(camera.centre) + e) for i in (0, 1))

    def beyond(normal):
        """Of each object, whether all of its box lies on the other side of a plane through the eye."""
        normal = normal / np.abs(normal).max()
        with np.errstate(invalid="ignore"):  # infinite boxes, times 0
            farthest = np.where(normal > 0, highs, lows) * normal
        return np.where(normal == 0, 0, farthest).sum(axis=1) < 0

    remedy = "the eye is at centre + e and looks against e; turn e round, or move the objects"
    if beyond(ahead).all():
        return [_text(scene, camera.line, "all objects are behind the eye, so no ray meets one", remedy)]
    if np.any([beyond(side) for side in (ahead, *sides)], axis=0).all():
        return [_text(scene, camera.line, "all objects are outside of the view, so no eye ray meets one", remedy)]
    return []


def _around(scene, boxes, point):
    """The first opaque solid that contains a point, or None."""
    for i in np.flatnonzero(((boxes[:, 0] <= point) & (point <= boxes[:, 1])).all(axis=1)):
        thing = scene.objects[i]
        if solid(thing) and thing.material.attenuation == OPAQUE and holds(thing, np.array(point)):
            return thing
    return None


def _name(thing) -> str:
    line = f" of line {thing.line}" if thing.line else ""
    return f"the opaque {SHAPES[type(thing)]}{line}"


def _eye(scene, boxes) -> list[str]:
    camera = scene.camera
    thing = _around(scene, boxes, np.add(camera.centre, camera.e))
    if thing is None:
        return []
    what = f"the eye is inside {_name(thing)}, which light reaches only from outside"
    remedy = "move the eye, or make the walls of a room of POLYGONs"
    return [_text(scene, camera.line, what, remedy)]


def _lights(scene, boxes) -> list[str]:
    texts = []
    for light in scene.lights:
        if (thing := _around(scene, boxes, light.position)) is not None:
            what = f"the light is inside {_name(thing)}, so with shadows it lights nothing outside"
            texts.append(_text(scene, light.line, what, "move it out"))
    if not scene.lights and BLACK == scene.ambient == scene.background:
        what = "the scene has no light: no LIGHT, AMBIENT and BACKGROUND are black"
        texts.append(_text(scene, 0, what, "add a LIGHT (x,y,z) (1,1,1) 0"))
    return texts
