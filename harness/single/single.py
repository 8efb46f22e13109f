"""Runs one job from the command line: a picture of a scene, or the hits of a list of rays."""

import json
import sys
from dataclasses import replace

import numpy as np
from pydantic import ValidationError

from harness.errors import UserError
from harness.experiment.image import Image
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
from harness.scene import load, warnings
from harness.scene.flatten import flatten
from harness.scene.needs import needs as needs_of
from harness.scene.needs import shapes
from harness.single import export
from harness.statistics import steady
from harness.store import record

NOT_MEASURED = "not measured; `rayrace run` measures it, with an experiment that has this scene and these options"
FASTEST = ("cpp-threads", "numba-parallel", "numpy", "python")


def pick(name: str, known: dict, parameters: Parameters, needs: tuple[str, ...]) -> registry.Entry:
    """The variant `name`, or without a name the first of FASTEST that can do the job here. UserError if none can."""
    if name:
        return registry.find(name, known)
    reasons = []
    for entry in (known[n] for n in FASTEST if n in known):
        reason = entry.unavailable or repetition.unsupported(entry, parameters, needs)
        if reason is None:
            return entry
        reasons.append(f"{entry.name}: {reason}")
    raise UserError("no renderer can do this job: " + "; ".join(reasons))


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


def render(scene, variant, out, image, frames, timeout, folders, as_json) -> None:
    """Renders `scene` to the picture `out` and prints its facts. timeout: s. SystemExit(1) if the renderer fails.

    If a renderer exports to files with the suffix of `out`, writes the scene in that format instead.
    """
    exporter = None if out.suffix in picture.SUFFIXES else export.find(out.suffix, registry.entries(folders))
    if exporter:
        if variant:
            raise UserError(f"-r {variant}: {out.name} is a scene, so nothing is rendered; leave -r out")
        if frames:
            raise UserError(f"--frames: {out.name} is a scene, so nothing is rendered; leave --frames out")
        read = load(scene)
        _export(read, out, exporter, image, timeout, as_json)
        warn(warnings(read))
        return
    picture.check_suffix(out)
    read = load(scene)
    parameters = image.parameters(1, frames)
    needs = needs_of(read, parameters)
    entry = pick(variant, registry.entries(folders), parameters, needs)
    parameters = replace(parameters, threads=entry.threads() if image.threads == "default" else image.threads)
    arrays = flatten(read, parameters.arithmetic)
    result, facts = make(entry, arrays, parameters, needs, out, timeout)
    facts["warnings"] = warn(warnings(read))
    known = registry.entries(folders)
    facts["agreement"] = _agreement(entry, known, arrays, parameters, result)
    facts["error"] = _error(known, arrays, parameters, result)
    if as_json:
        print(json.dumps(facts))
    else:
        tell(facts, parameters)
        print(record.error_of(facts["error"]))
        print(record.agreement_of(facts["agreement"]))


def _agreement(entry, known, arrays, parameters: Parameters, result: repetition.Result) -> dict:
    """The agreement with a reference that a run has made: judge.Verdict and "reference"; or {unavailable: reason}."""
    kept = Kept(cache_folder("references"))
    found = reference.find(kept, entry, known, fingerprint(arrays), parameters)
    if found is None:
        return {"unavailable": NOT_MEASURED}
    limit = 0.0 if result.dropped is None else bound.bound(arrays, parameters.depth, result.dropped)
    external = entry.renderer.manifest.external
    verdict = judge.judge(result.array, found, parameters.precision, external, limit)
    return {"reference": found.maker, **verdict.record()}


def _error(known, arrays, parameters: Parameters, result: repetition.Result) -> dict:
    """The error against a truth of the scene that a run has made: `error` of a record; or {unavailable: reason}."""
    found = truth.find(Kept(cache_folder("references")), known, fingerprint(arrays), parameters)
    if found is None:
        return {"unavailable": NOT_MEASURED}
    if broken := judge.broken(result):
        return {"unavailable": broken}
    told = judge.errors(result.array, found.picture, found.standard_error, None)
    return {"truth": found.maker, "against": "scene", **found.facts(), **told}


def make(entry, arrays, parameters, needs, out, timeout) -> tuple[repetition.Result, dict]:
    """Renders a picture and saves it at `out`. Returns the Result, and facts for JSON. SystemExit(1) if it fails."""
    result = repetition.run(entry, arrays, parameters, needs, timeout, cache=kernels(entry))
    return result, save(entry, arrays, parameters, result, out)


def save(entry, arrays, parameters, result: repetition.Result, out) -> dict:
    """Saves the picture of a Result at `out`. Returns facts for JSON. SystemExit(1) if it has none."""
    _stop_unless_ok(entry, result)
    if out.suffix == ".png" and not np.isfinite(result.array).all():
        raise SystemExit(f"error: {entry.name} made pixels that are not finite; save it as .npy to look into it")
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


def warn(found: list[str]) -> list[str]:
    """Prints the warnings about a scene whose picture has been saved; returns them."""
    for text in found:
        print(f"warning: {text}", file=sys.stderr)
    return found


def cut_off(arrays, parameters: Parameters, result: repetition.Result) -> dict | None:
    """The largest and the mean bound of the error by a cut-off (linear RGB); None without a cut-off."""
    if result.dropped is None:
        return None
    bounds = bound.bound(arrays, parameters.depth, result.dropped)
    return {"max": float(bounds.max()), "mean": float(bounds.mean())}


def tell(facts: dict, parameters: Parameters, time: str = "") -> None:
    """Prints the facts of a picture for people. time: what was measured of a frame; "": a rough time is told."""
    took = f"{facts['wall_s']:.3g} s in all"
    took = f"{time}, {took}" if time else f"about {facts['rough_seconds']:.2g} s a frame, {took} (rough times)"
    print(
        f"{facts['picture']}: {facts['width']} x {facts['height']}, {facts['renderer']}, {parameters.precision}: "
        f"{took}, {traced(facts['rays'])}"
    )
    tell_doubts(facts)


def traced(counts: dict | None) -> str:
    """The number of rays, for people. counts: by kind, or None."""
    if not counts:
        return "rays unavailable: the renderer does not count them"
    total = sum(counts.get(kind, 0) for kind in ("primary", "reflected", "transmitted", "shadow"))
    return f"{total:,} rays"


def tell_doubts(facts: dict) -> None:
    """Prints the bound of a cut-off, and warnings."""
    if facts["bound"]:
        print(
            f"cut-off: every pixel is within {facts['bound']['max']:.3g} of the picture without it,"
            f" on average within {facts['bound']['mean']:.3g} (linear RGB, proven)"
        )
    if facts["unranked"]:
        print(f"note: {facts['unranked']}", file=sys.stderr)
    if (facts["rays"] or {}).get("non_finite"):
        print(f"warning: {facts['rays']['non_finite']} samples are not finite", file=sys.stderr)


def _export(scene, out, exporter, image, timeout, as_json) -> None:
    parameters = image.parameters(1, 0)
    export.write(out, exporter, flatten(scene, image.arithmetic), parameters, needs_of(scene, parameters), timeout)
    name = exporter.manifest.name
    print(json.dumps({"scene": str(out), "exporter": name}) if as_json else f"{out}: scene for {name}")


def trace(scene, ray_file, variant, out, methods, timeout, folders) -> None:
    """Traces the rays of a CSV file and writes their hits to `out`, or to standard output if it is None.

    methods: of the job; timeout: s. SystemExit(1) if the renderer fails.
    """
    if out is not None:
        picture.check_folder(out)
    read = load(scene)
    listed = rays.read(ray_file)
    parameters = Parameters(kind="rays", depth=0, **methods)
    needs = tuple(sorted(shapes(read)))
    entry = pick(variant, registry.entries(folders), parameters, needs)
    arrays = {**flatten(read), "rays": listed}
    result = repetition.run(entry, arrays, parameters, needs, timeout, cache=kernels(entry))
    _stop_unless_ok(entry, result)
    if out is None:
        rays.write(sys.stdout, result.array)
    else:
        with open(out, "w", encoding="utf-8", newline="") as file:
            rays.write(file, result.array)


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
        print(f"error: {entry.name}: {result.status}: {result.reason}", file=sys.stderr)
        if result.stderr:
            print(result.stderr, file=sys.stderr)
        raise SystemExit(1)
