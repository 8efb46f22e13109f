"""Renders a picture within an error: picks the quickest measured method, then compares the picture with the truth."""

import json
import math
import sys
from dataclasses import replace

from harness.errors import UserError
from harness.experiment import image
from harness.experiment.experiment import Reference
from harness.judge import judge, truth
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
from harness.store import record

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
        given={name: value for name, value in parameters.values().items() if name in fixed},
        variant=variant,
        here={name: here[name] for name in ("host", "cpu")},
    )
    found = advice.choose(results_folder(), wanted, limit, able)
    chosen, entry = job(found.parameters), known[found.variant]
    needs = needs_of(read, chosen)
    result, facts = single.make(entry, arrays, chosen, needs, out, timeout)
    facts["warnings"] = single.warn(warnings(read))
    got = error(result.array, read, arrays, known, chosen)
    expected = {"rmse": found.error, "like": found.like, "run": str(found.run)}
    if as_json:
        print(json.dumps({**facts, "method": found.name, "expected": expected, "error": got}))
    else:
        print(f"{found.name}: RMSE {found.error:.2g} to be expected, as with {found.like} in {found.run}")
        single.tell(facts, chosen)
        print(record.error_of(got))
    if got.get("rmse", 0.0) > limit:
        print(f"error: its RMSE of {got['rmse']:.3g} is more than the {limit:.3g} asked for", file=sys.stderr)
        raise SystemExit(1)


def error(array, read, arrays, known, parameters: Parameters) -> dict:
    """How far a picture is from the truth of the scene: `error` of a record; or {"unavailable": reason}."""
    wanted = Reference(times=TIMES, spots=0)
    told = truth.jobs([parameters], wanted, lambda shown: needs_of(read, shown))[truth.view(parameters, wanted)]
    maker = truth.choose(known, told)
    if maker is None:
        return {"unavailable": "no renderer here can make the truth"}
    try:
        with Sessions() as sessions:
            made = truth.make(told, maker, arrays, None, sessions.run)
    except LookupError as failure:
        return {"unavailable": str(failure)}
    off = judge.errors(array, made.picture, made.standard_error, None)
    return {"truth": maker.name, "against": told.against, **made.facts(), **off}


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
