"""Renders a picture within an error: picks the quickest measured method, then compares the picture with the truth."""

import json
import math
import sys
from dataclasses import replace

from harness.errors import UserError
from harness.experiment import image
from harness.judge import judge, reference, truth
from harness.machine import environment
from harness.picture import picture
from harness.process import repetition
from harness.process.session import Sessions
from harness.renderer import registry
from harness.renderer.job import fingerprint
from harness.renderer.parameters import Parameters
from harness.scene import load, warnings
from harness.scene.flatten import flatten
from harness.scene.needs import needs as needs_of
from harness.single import single

TIMES = 8  # as many samples as the picture has the truth that it is then compared with
ANY = {"feelers", "glossy_rays"}  # given, these say that there are some; how many is open


def render(scene, variant, out, asked, most, given, frames, timeout, folders, as_json) -> None:
    """Render `scene` to `out` with the quickest measured method of an RMSE of `most` at the most; print the error that
    was to be expected, and the one that it has.

    asked: the Image of the options; given: names of those that the user gave. SystemExit(1) if the renderer fails, or
    the picture misses the error that was asked for; UserError if nothing like it has been measured here.
    """
    from rayrace.run import results_folder
    from reports.accuracy import advice
    from reports.run import method

    limit = _limit(most)
    picture.check_suffix(out)
    read, known = load(scene), registry.entries(folders)
    arrays = flatten(read, asked.arithmetic)
    parameters = asked.parameters(1, frames)

    def job(told: dict) -> Parameters:
        return replace(parameters, **{key: value for key, value in told.items() if key in Parameters.__annotations__})

    def able(name: str, told: dict) -> str | None:
        if name not in known:
            return "it is not here"
        chosen = job(told)
        return known[name].unavailable or repetition.unsupported(known[name], chosen, needs_of(read, chosen))

    here = environment.capture()
    fixed = given & {*method.DIALS, *method.CHOICES} - ANY
    wanted = advice.Wanted(
        scene=fingerprint(arrays),
        needs=frozenset(needs_of(read, _best(read, parameters))),
        centres=parameters.sampler == "one",
        given={name: value for name, value in parameters.values().items() if name in fixed},
        variant=variant,
        here={name: here[name] for name in ("host", "cpu")},
    )
    found = advice.choose(results_folder(), wanted, limit, able)
    chosen, entry = job(found.parameters), known[found.variant]
    needs = needs_of(read, chosen)
    result, facts = single.make(entry, arrays, chosen, needs, out, timeout)
    facts["warnings"] = single.warn(warnings(read))
    got = error(result.array, read, arrays, entry, known, chosen, found.depth)
    expected = {"rmse": found.error, "like": found.like, "run": str(found.run)}
    if as_json:
        print(json.dumps({**facts, "method": found.name, "expected": expected, "error": got}))
    else:
        print(f"{found.name}: RMSE {found.error:.2g} to be expected, as with {found.like} in {found.run}")
        single.tell(facts, chosen)
        print(_told(got))
    if got.get("rmse", 0.0) > limit:
        print(f"error: its RMSE of {got['rmse']:.3g} is more than the {limit:.3g} asked for", file=sys.stderr)
        raise SystemExit(1)


def error(array, read, arrays, entry, known, parameters: Parameters, depth: int | None) -> dict:
    """How far a picture is from its truth, which another renderer makes: keys of judge.errors, "truth", "pictures" and
    "standard_error"; or {"unavailable": reason}. The noise of the truth is taken off the RMSE.
    """
    told = truth.jobs([parameters], depth, TIMES, lambda shown: needs_of(read, shown))[truth.view(parameters, depth)]
    maker = reference.choose(entry, known, told.parameters, told.needs)
    if maker is None:
        return {"unavailable": "no other renderer here can make the truth"}
    try:
        with Sessions() as sessions:
            made = truth.make(told, maker, arrays, None, sessions.run)
    except LookupError as failure:
        return {"unavailable": str(failure)}
    off, noise = judge.errors(array, made.picture, None), made.uncertainty or 0.0
    known_errors = {name: off[name] for name in ("max", "bad_pixels", "relative_mse")}
    rmse = math.sqrt(max(0.0, off["rmse"] ** 2 - noise**2))
    return {"rmse": rmse, **known_errors, "truth": maker.name, "pictures": made.pictures, "standard_error": noise}


def _limit(most: str) -> float:
    try:
        limit = image.number(most)
    except ValueError as fault:
        raise UserError(f"--max-error {most}: {fault}") from None
    if not 0 < limit < math.inf:
        raise UserError(f"--max-error {most}: expected more than 0")
    return limit


def _best(read, parameters: Parameters) -> Parameters:
    """These parameters with feelers, if a light of the scene has a radius."""
    soft = any(light.radius > 0 for light in read.lights)
    return replace(parameters, feelers=max(parameters.feelers, int(soft)))


def _told(got: dict) -> str:
    if "unavailable" in got:
        return f"error: not measured; {got['unavailable']}"
    noise = f", whose own error is {got['standard_error']:.2g}" if got["standard_error"] else ""
    return (
        f"RMSE {got['rmse']:.2g} against the truth by {got['truth']}{noise}; largest error {got['max']:.2g},"
        f" {100 * got['bad_pixels']:.2g} % of pixels off by more than 1/255"
    )
