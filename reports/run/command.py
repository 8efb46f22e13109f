"""Writes the commands that render the picture of a cell again and that measure the cell again."""

import json
import math
import shlex
from argparse import ArgumentParser, Namespace
from functools import lru_cache
from pathlib import Path

from harness.renderer import parameters
from reports.run import reduced
from reports.run.cell import Cell, Missing
from reports.run.results import Results

# Parameters without an option: they follow from others, or concern measuring.
NO_OPTION = ("kind", "frames", "least_frame")
COUNTS = {"objects": "spheres", "lights": "lights", "size": "size"}  # keys of [generate] and options
SUFFIXES = {"comparison": ".txt", "balls": ".nff", "tetra": ".nff"}  # of scenes that the command can write


def of(results: Results, cell: Cell) -> str | Missing:
    """Returns the `rayrace render` command that makes the picture of a cell again, with options that are not default.

    For a generated scene a first command writes the scene. Missing if no command can make the picture.
    """
    whole = reduced.wholes(results).get(cell)
    if whole and _version(results, whole) != _version(results, cell):
        return Missing(f"no file has the scene without {reduced.without(cell)}; rayrace needs --within writes some")
    source = _scene(results, cell)
    if isinstance(source, Missing):
        return source
    scene, first = source
    values = _values(results, cell)
    for name, value in values.items():
        if name not in parameters.OPTIONS:
            return Missing(f"rayrace render has no option for {name} = {value}")
    words = ["rayrace", "render", scene, *_renderers(results), "-r", cell.variant, *_options(values)]
    made = shlex.join([*words, "-o", "picture.npy"])
    return f"{shlex.join(first)} && {made}" if first else made


def of_job(scene: str, variant: str, job: parameters.Parameters, out: str) -> str:
    """Returns the `rayrace render` command that makes the picture of a job, on as many threads as the variant takes."""
    values = {name: value for name, value in job.values().items() if name not in NO_OPTION}
    values |= {"region": "" if job.region is None else values["region"], "shadows": job.shadows}
    values |= {"threads": default("threads"), "epsilon": "" if job.epsilon is None else f"{job.epsilon:.17g}"}
    return shlex.join(["rayrace", "render", scene, "-r", variant, *_options(_spelt(values)), "-o", out])


def _options(values: dict) -> list[str]:
    """Returns the options of `rayrace render` whose values are not the default."""
    words = []
    for name, value in values.items():
        if value == default(name):
            continue
        option = name.replace("_", "-")
        if isinstance(value, bool):
            words.append(f"--{option}" if value else f"--no-{option}")
        else:
            words += [f"--{option}", str(value)]
    return words


def again(results: Results, cell: Cell) -> str | Missing:
    """Returns the `rayrace run` command that measures this cell alone again; Missing if no command made the run."""
    arguments = _asked(results)
    if not arguments.experiment:
        return Missing("the run was not made by `rayrace run`")
    words = ["rayrace", "run", arguments.experiment, *_renderers(results), "--only", cell.variant]
    kept = [setting for setting in arguments.settings if setting.partition("=")[0].strip() != "where"]
    if len({other.place for other in results.cells}) > 1:
        kept.append(f"where={json.dumps([_expression(cell)])}")
    return shlex.join([*words, *(word for setting in kept for word in ("--set", setting))])


def power(value: float) -> int | None:
    """Returns the exponent of a power of two; None for other numbers."""
    fraction, exponent = math.frexp(value)
    return exponent - 1 if fraction == 0.5 else None


def default(name: str):
    """Returns the default of an option of `rayrace render`; None if it has no such option."""
    return parameters.OPTIONS.get(name)


def _expression(cell: Cell) -> str:
    """Returns the `where` expression that selects the cells at the place of this one."""
    spelt = {"cutoff", "threads"}  # an experiment may spell these otherwise than by their value
    values = {key: cell.parameters[key] if key in spelt else value for key, value in cell.swept.items()}
    values = {"scene": Path(cell.scene).stem} | values
    plain = {key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}
    return " and ".join(f"{key} == {value!r}" for key, value in plain.items())


def _values(results: Results, cell: Cell) -> dict:
    """Returns the parameters of a cell by the option of the command, spelt as there."""
    values = {key: value for key, value in cell.parameters.items() if key not in NO_OPTION}
    whole = f"0,0,{values['width']},{values['height']}"
    more = {
        "region": "" if values["region"] == whole else values["region"],
        "shadows": bool(values["shadows"]),
        "threads": _threads(results, cell),
    }
    values["epsilon"] = "" if _asked_for(results, cell, "epsilon") is None else f"{values['epsilon']:.17g}"
    return _spelt(values) | more


def _spelt(values: dict) -> dict:
    """Returns the values as the command spells them, without those that mean nothing beside the others."""
    if "cutoff" in values:
        exponent = power(values["cutoff"])
        values["cutoff"] = f"{values['cutoff']:.17g}" if exponent is None else f"2^{exponent}"
    if not values.get("lens_radius"):
        values.pop("focal_distance", None)
    if values.get("sampler") != "sobol":
        values.pop("spp", None)
    if values.get("sampler") == "one" and values.get("samples") == default("samples"):
        values.pop("sampler")  # the command then chooses it
    return values


def _threads(results: Results, cell: Cell) -> int:
    """Returns the number that the experiment asks for; the command's default if the variant chooses."""
    count = _asked_for(results, cell, "threads")
    return default("threads") if count in (None, "default") else count


def _asked_for(results: Results, cell: Cell, key: str):
    """Returns the experiment's value of a key of [image] in this cell; None if it has none."""
    experiment = results.facts["experiment"]
    case = next((case for case in experiment.get("case", ()) if case["name"] == cell.swept.get("case")), {})
    return cell.swept.get(key) or case.get(key) or experiment.get("image", {}).get(key)


def _version(results: Results, cell: Cell) -> str | None:
    return (results.record(cell) or {}).get("scene_version")


def _scene(results: Results, cell: Cell) -> tuple[str, list[str]] | Missing:
    """Returns the scene file and the words of the command that writes it, [] if the scene is not generated."""
    made = _generated(results, cell)
    if made is None:
        experiment = _asked(results).experiment
        return str(Path(experiment).parent / cell.scene if experiment else cell.scene), []
    if made["scene"] not in SUFFIXES:
        return Missing(f"{made['scene']} is made in memory, and rayrace generate writes its mesh alone")
    sizes = {key: cell.swept.get(key, made.get(key)) for key in COUNTS}
    counts = {key: value for key, value in sizes.items() if value is not None}
    file = "-".join([made["scene"], *(f"{key}-{value}" for key, value in counts.items())]) + SUFFIXES[made["scene"]]
    words = [word for key, value in counts.items() for word in (f"--{COUNTS[key]}", str(value))]
    return file, ["rayrace", "generate", made["scene"], *words, "-o", file]


def _generated(results: Results, cell: Cell) -> dict | None:
    """Returns the [[generate]] table of the scene of a cell; None if the scene is a file."""
    made = results.facts["experiment"].get("generate")
    tables = made if isinstance(made, list) else [made] if made else []
    if len(tables) < 2:
        return next(iter(tables), None)
    return next(table for table in tables if _named(table, cell) == Path(cell.scene).stem)


def _named(made: dict, cell: Cell) -> str:
    """Returns the name of a generated scene (harness/plan/sources.py)."""
    counts = {key: made[key] for key in COUNTS if made.get(key) is not None and key not in cell.swept}
    return "-".join([made["scene"], *(f"{key}-{value}" for key, value in counts.items())])


def _renderers(results: Results) -> list[str]:
    return [word for folder in _asked(results).renderers for word in ("--renderer", folder)]


@lru_cache(maxsize=1)
def _asked(results: Results) -> Namespace:
    """Returns the arguments of `rayrace run`: experiment (None if the run has no such command), settings, renderers."""
    name, *words = results.facts["command"][1:] or [""]
    return run_parser().parse_known_args(words if name == "run" else [])[0]


def run_parser() -> ArgumentParser:
    """Reads the words of `rayrace run`, of this version and of earlier ones."""
    parser = ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    parser.add_argument("experiment", nargs="?")
    parser.add_argument("--set", dest="settings", action="append", default=[])
    parser.add_argument("--renderer", dest="renderers", action="append", default=[])
    for option in ("--out", "--only", "--resume", "--max-minutes", "--executor"):
        parser.add_argument(option)
    for option in ("--dry-run", "--detach", "--report", "--json"):
        parser.add_argument(option, action="store_true")
    return parser
