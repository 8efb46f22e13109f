"""The option --max-error of `render`: a picture within an error, by the quickest method (harness/choice)."""

import json
import math
import time

from harness.choice import trial
from harness.choice.choice import Choice
from harness.errors import Failure, UserError
from harness.experiment import image
from harness.machine import environment
from harness.picture import picture
from harness.process.scratch import scratch
from harness.process.session import Sessions
from harness.race import turns
from harness.race.audit import Audit
from harness.race.host import ThisHost
from harness.renderer import registry
from harness.renderer.job import fingerprint
from harness.renderer.parameters import NAMES
from harness.scene.flatten import flatten
from harness.scene.needs import needs as needs_of
from harness.single import single
from harness.store import record
from rayrace import facts, terminal
from reports.paper import quantity

SEEN = ("width", "height", "region", "shadows", "lens_radius", "focal_distance", "arithmetic")  # what is in a picture


def render(scene, variant, out, options, most, against, seconds, given, frames, timeout, folders, as_json) -> None:
    """Render a Scene to `out` with the quickest method whose RMSE is `most` or less, and print what it promised and
    what the picture keeps.

    options: the Image of the command line; given: names of those that the user gave. against: "scene" or "centres".
    seconds: in which all is to be done; 0: as many as a job may take (timeout). Failure if no picture is within the
    limit, or nobody can tell; the best is kept.
    """
    from rayrace.run import results_folder
    from reports.accuracy import advice

    limit = error_limit("--max-error", most)
    if against not in ("scene", "centres"):
        raise UserError(f"--against {against}: expected scene or centres")
    picture.check_suffix(out)
    entries = registry.entries(folders)
    if variant:
        registry.find(variant, entries)
    arrays, parameters = flatten(scene, options.arithmetic), options.parameters(1, 0)
    fixed = frozenset(given & {*NAMES} - {*SEEN, "seed", "frames", "threads"})
    if against == "centres":
        if "sampler" in fixed and parameters.sampler != "one":
            raise UserError(f"--sampler {parameters.sampler}: not with --against centres, which have one sample")
        fixed |= {"feelers", "glossy_rays", "glossy_weight"}
    here, values = environment.capture(), parameters.values()
    wanted = advice.Wanted(
        scene=fingerprint(arrays),
        picture={name: values[name] for name in SEEN},
        against=against,
        given={name: values[name] for name in fixed if name in values},
        variant=variant,
        here={name: here[name] for name in ("host", "cpu")},
    )
    host = ThisHost(terminal.say)
    with host.exclusive(), Sessions() as sessions, scratch() as folder:
        began = time.monotonic()  # it may have waited for another measurement to end
        test = trial.Trial(
            arrays, lambda job: needs_of(scene, job), parameters, entries, limit, against, sessions.run,
            began + (seconds or timeout), None if options.threads == "default" else options.threads,
        )  # fmt: skip
        known_methods = advice.find(results_folder(), wanted)
        made = Choice(test, variant, fixed, out, frames, known_methods, Audit(host), folder)
        wrong = made.work()
        made.time()
        took = time.monotonic() - began
    doubts = single.warned(scene, parameters, {"feelers", "glossy_rays"} - fixed)
    if made.best:
        doubts += single.one_colour(scene, parameters, made.best.result.array)
    if as_json:
        print(json.dumps({**made.facts(wrong), "seconds": took, "warnings": facts.warn(doubts)}))
    else:
        _show(made, doubts)
    if wrong:
        raise Failure(wrong)


def _show(made: Choice, warned: list[str]) -> None:
    """Prints what was done."""
    for line in made.said:
        print(line)
    for each in made.made:
        method = each.method
        print(f"{method.name}: RMSE {_expected(method)} expected, about {method.seconds:.2g} s a frame")
        took = f"; {_time(each.times)}" if each is not made.best else ""
        print(f"{each.facts['picture']}: {record.error_of(each.error)}{_truth(each.error)}{took}")
    if made.best:
        facts.show(made.best.facts, made.best.method.parameters.precision, _time(made.best.times))
    terminal.show_reasons([row for each in made.made for row in each.times.records])
    facts.warn(warned)


def _expected(method: trial.Method) -> str:
    error = method.record()
    return record.rmse_of(error) if record.below(error) else f"{method.rmse:.2g} ± {method.standard_error:.1g}"


def _time(times: turns.Times) -> str:
    """The time of a frame for people, with its interval, or why there is none."""
    broken = times.broken
    return f"time of a frame unavailable: {broken}" if broken else f"{quantity.seconds(times.seconds)} a frame"


def _truth(error: dict) -> str:
    if "unavailable" in error:
        return ""
    uncertainty = f", known to {error['uncertainty']:.2g}" if error["uncertainty"] else ""
    return f"; its truth is by {error['truth']}, {error['samples']} samples a pixel{uncertainty}"


def error_limit(option: str, most: str) -> float:
    """An error from 1/255, 0.001, .. as an option has it. UserError, with the option."""
    try:
        limit = image.number(most)
    except ValueError as fault:
        raise UserError(f"{option} {most}: {fault}") from None
    if not 0 < limit < math.inf:
        raise UserError(f"{option} {most}: expected more than 0")
    return limit
