"""Runs one job from the command line: a picture of a scene, or the hits of a list of rays."""

import io
import math
from dataclasses import replace

import numpy as np
from pydantic import ValidationError

from harness.errors import Failure, UserError
from harness.experiment.image import SIDE, Image
from harness.judge import bound, judge, rays, reference, truth
from harness.judge.cache import Kept
from harness.picture import picture
from harness.process import repetition
from harness.race import row
from harness.race.turns import kernels
from harness.renderer import registry
from harness.renderer.builder import cache_folder
from harness.renderer.job import fingerprint
from harness.renderer.parameters import Parameters
from harness.scene import doubts, load, warnings
from harness.scene.flatten import flatten
from harness.scene.needs import FAR_FLOAT32, MOST_FLOAT32, farthest, shapes
from harness.scene.needs import needs as needs_of
from harness.single import export
from harness.statistics import steady

NOT_MEASURED = "not measured; `rayrace run` measures it, with an experiment that has this scene and these options"
FASTEST = ("cpp-threads", "numba-parallel", "numpy", "python")


def pick(name: str, entries: dict, parameters: Parameters, needs: tuple[str, ...]) -> registry.Entry:
    """The variant `name`, or without a name the first of FASTEST that can do the job here. UserError if none can."""
    if name:
        return registry.find(name, entries)
    reasons = []
    for entry in (entries[n] for n in FASTEST if n in entries):
        reason = entry.unavailable or repetition.unsupported(entry, parameters, needs)
        if reason is None:
            return entry
        reasons.append(f"{entry.name}: {reason}")
    raise UserError("no renderer can do this job: " + "; ".join(reasons))


def general(entry: registry.Entry, parameters: Parameters) -> Parameters:
    """These parameters with the program that does any job, where the variant has it: it is built only once."""
    has = "general" in entry.methods.get("kernel", ())
    return replace(parameters, kernel="general") if has else parameters


def image(region: str, **values) -> Image:
    """The options of the command line as an Image. UserError, with the option, for a value out of range."""
    try:
        return Image(**values, region=_region(region, values["width"], values["height"]))
    except ValidationError as error:
        fault = error.errors()[0]
        why = fault["msg"].removeprefix("Value error, ")
        if fault["loc"]:  # else it concerns several options, and names them
            why = f"--{str(fault['loc'][0]).replace('_', '-')} {fault['input']}: {why}"
        raise UserError(why) from None


def size(scene, width: int | None, height: int | None, longest: int = 512) -> dict[str, int]:
    """Returns the size of a picture of a Scene: what is given; else the shape of its screen, |u| : |v|, whose longer
    side has `longest` pixels.
    """
    shape = math.dist((0, 0, 0), scene.camera.u) / math.dist((0, 0, 0), scene.camera.v)
    if width is None and height is None:
        width, height = (longest, None) if shape >= 1 else (None, longest)
    across, down = width or round(height * shape), height or round(width / shape)
    return {"width": min(max(across, 1), SIDE), "height": min(max(down, 1), SIDE)}


def render(scene, variant, out, image, frames, timeout, folders) -> dict:
    """Renders a Scene to the picture `out`. Returns its facts, for JSON. timeout: s. Failure if the renderer fails.

    If a renderer exports to files with the suffix of `out`, writes the scene in that format instead; the facts are then
    `scene` and `exporter`.
    """
    exporter = None if out.suffix in picture.SUFFIXES else export.find(out.suffix, registry.entries(folders))
    if exporter:
        if variant:
            raise UserError(f"-r {variant}: {out.name} is a scene, so nothing is rendered; leave -r out")
        if frames:
            raise UserError(f"--frames: {out.name} is a scene, so nothing is rendered; leave --frames out")
        parameters = image.parameters(1, 0)
        export.write(out, exporter, flatten(scene, image.arithmetic), parameters, needs_of(scene, parameters), timeout)
        return {"scene": str(out), "exporter": exporter.manifest.name, "warnings": warned(scene, parameters)}
    picture.check_suffix(out)
    parameters = image.parameters(1, frames)
    needs = needs_of(scene, parameters)
    entries = registry.entries(folders)
    entry = pick(variant, entries, parameters, needs)
    parameters = replace(parameters, threads=entry.threads() if image.threads == "default" else image.threads)
    arrays = flatten(scene, parameters.arithmetic)
    result = repetition.run(entry, arrays, parameters, needs, timeout, cache=kernels(entry))
    facts = save(entry, arrays, parameters, result, out)
    facts["warnings"] = [*warned(scene, parameters), *one_colour(scene, parameters, result.array)]
    facts["agreement"] = _agreement(entry, entries, arrays, parameters, result)
    facts["error"] = _error(entries, arrays, parameters, result)
    return facts


def warned(scene, parameters: Parameters, free=()) -> list[str]:
    """The warnings of a Scene and of the job of its picture. free: of doubts.warnings."""
    return [*warnings(scene, [parameters], free), *doubts.stretched(scene, parameters.width, parameters.height)]


def one_colour(scene, parameters: Parameters, array: np.ndarray) -> list[str]:
    """The warning that a picture has one colour; none for a region of one."""
    return doubts.of_picture(scene, array) if parameters.region is None else []


def _agreement(entry, entries, arrays, parameters: Parameters, result: repetition.Result) -> dict:
    """The agreement with a reference that a run has made: judge.Verdict and "reference"; or {unavailable: reason}."""
    kept = Kept(cache_folder("references"))
    stored_reference = reference.find(kept, entry, entries, fingerprint(arrays), parameters)
    if stored_reference is None:
        return {"unavailable": NOT_MEASURED}
    limit = 0.0 if result.dropped is None else bound.bound(arrays, parameters.depth, result.dropped)
    external = entry.renderer.manifest.external
    verdict = judge.judge(result.array, stored_reference, parameters.precision, external, limit)
    return {"reference": stored_reference.maker, **verdict.record()}


def _error(entries, arrays, parameters: Parameters, result: repetition.Result) -> dict:
    """The error against a truth of the scene that a run has made: `error` of a record; or {unavailable: reason}."""
    stored_truth = truth.find(Kept(cache_folder("references")), entries, fingerprint(arrays), parameters)
    if stored_truth is None:
        return {"unavailable": NOT_MEASURED}
    if broken := judge.broken(result):
        return {"unavailable": broken}
    errors = judge.errors(result.array, stored_truth.picture, stored_truth.standard_error, None, stored_truth.doubt)
    return {"truth": stored_truth.maker, "against": "scene", **stored_truth.facts(), **errors}


def save(entry, arrays, parameters, result: repetition.Result, out) -> dict:
    """Saves the picture of a Result at `out`. Returns facts for JSON. Failure if it has none."""
    _stop_unless_ok(entry, result)
    if out.suffix == ".png" and not np.isfinite(result.array).all():
        raise Failure(f"{entry.name} made pixels that are not finite; save it as .npy to look into it")
    picture.save(out, result.array, parameters.arithmetic)
    return {
        "picture": str(out),
        "renderer": entry.name,
        "width": result.array.shape[1],
        "height": result.array.shape[0],
        "frames_s": result.said.frames_s,
        "rough_seconds": steady.rough(result.said.frames_s),
        "wall_s": result.outcome.wall_s,
        "rays": result.said.rays,
        "bound": cut_off(arrays, parameters, result),
        "device": result.said.device,
        "unranked": row.unranked(entry, result.said),
    }


def cut_off(arrays, parameters: Parameters, result: repetition.Result) -> dict | None:
    """The largest and the mean bound of the error by a cut-off (linear RGB); None without a cut-off."""
    if result.dropped is None:
        return None
    bounds = bound.bound(arrays, parameters.depth, result.dropped)
    return {"max": float(bounds.max()), "mean": float(bounds.mean())}


def trace(scene, ray_file, variant, methods, timeout, folders) -> str:
    """Returns the hits of the rays of a CSV file, as CSV.

    methods: of the job; timeout: s. Failure if the renderer fails.
    """
    read = load(scene)
    listed = rays.read(ray_file)
    parameters = Parameters(kind="rays", depth=0, **methods)
    needs = tuple(sorted(shapes(read)))
    if parameters.precision == "float32" and max(farthest(read), np.abs(listed[:, :3]).max(initial=0)) > MOST_FLOAT32:
        raise UserError(f"there are {FAR_FLOAT32}, whose squares it cannot hold", remedy="use --precision float64")
    entry = pick(variant, registry.entries(folders), parameters, needs)
    arrays = {**flatten(read), "rays": listed}
    result = repetition.run(entry, arrays, parameters, needs, timeout, cache=kernels(entry))
    _stop_unless_ok(entry, result)
    text = io.StringIO(newline="")
    rays.write(text, result.array)
    return text.getvalue()


def _region(text: str, width: int, height: int):
    if not text:
        return "all"
    try:
        x0, y0, x1, y1 = map(int, text.split(","))
    except ValueError:
        raise UserError(f"--region {text}: expected four whole numbers x0,y0,x1,y1") from None
    if not (0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height):
        raise UserError(f"--region {text}: expected 0 <= x0 < x1 <= {width} and 0 <= y0 < y1 <= {height}")
    return x0, y0, x1, y1


def _stop_unless_ok(entry: registry.Entry, result: repetition.Result) -> None:
    if result.status in ("unavailable", "unsupported"):
        raise UserError(f"{entry.name} is {result.status}: {result.reason}")
    if result.status != "ok":
        raise Failure(f"{entry.name}: {result.status}: {result.reason}", result.stderr)
