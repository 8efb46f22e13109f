"""The commands that make the picture of a cell again, and that measure it again, where its run was begun."""

import json
import math
import shlex
from functools import lru_cache
from pathlib import Path

import typer

from harness import cli
from reports.cell import Cell, Missing
from reports.results import Results

# Parameters without an option: what follows from others, or is of measuring.
NO_OPTION = ("kind", "frames", "least_frame")
COUNTS = {"objects": "spheres", "lights": "lights", "size": "size"}  # of [generate], by the option of the command
SUFFIXES = {"comparison": ".txt", "balls": ".nff", "tetra": ".nff"}  # of scenes that the command writes


def of(results: Results, cell: Cell) -> str | Missing:
    """`rayrace render`, which makes the picture of a cell again, with all that is not as the command has it.

    Of a generated scene it is two commands, the first of which writes the scene.
    """
    found = _scene(results, cell)
    if isinstance(found, Missing):
        return found
    options, (scene, first) = _options("render"), found
    words = ["rayrace", "render", scene, *_renderers(results), "-r", cell.variant]
    for name, value in _values(results, cell).items():
        if name not in options:
            return Missing(f"rayrace render has no option for {name} = {value}")
        option = options[name]
        if value == option.default:
            continue
        if isinstance(option.default, bool):
            words.append((option.opts if value else option.secondary_opts)[0])
        else:
            words += [option.opts[0], str(value)]
    made = shlex.join([*words, "-o", "picture.npy"])
    return f"{shlex.join(first)} && {made}" if first else made


def again(results: Results, cell: Cell) -> str | Missing:
    """`rayrace run`, which measures this cell alone again."""
    asked = _asked(results)
    if not asked.get("experiment"):
        return Missing("the run does not say that `rayrace run` made it")
    words = ["rayrace", "run", str(asked["experiment"]), *_renderers(results), "--only", cell.variant]
    kept = [setting for setting in asked["settings"] or () if setting.partition("=")[0].strip() != "where"]
    if len({other.place for other in results.cells}) > 1:
        kept.append(f"where={json.dumps([_expression(cell)])}")
    return shlex.join([*words, *(word for setting in kept for word in ("--set", setting))])


def power(value: float) -> int | None:
    """The exponent of a power of two; None if it is none."""
    fraction, exponent = math.frexp(value)
    return exponent - 1 if fraction == 0.5 else None


def default(name: str):
    """The value of an option of `rayrace render` that is not given; None if it has none of that name."""
    option = _options("render").get(name)
    return None if option is None else option.default


def _expression(cell: Cell) -> str:
    """What is true of the cells at the place of this one, in the words of `where`."""
    spelt = {"cutoff", "threads"}  # which an experiment may spell in another way than as their value
    values = {key: cell.parameters[key] if key in spelt else value for key, value in cell.swept.items()}
    values = {"scene": Path(cell.scene).stem} | values
    plain = {key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}
    return " and ".join(f"{key} == {value!r}" for key, value in plain.items())


def _values(results: Results, cell: Cell) -> dict:
    """The parameters of a cell by the option of the command, spelt as there."""
    values = {key: value for key, value in cell.parameters.items() if key not in NO_OPTION}
    whole = f"0,0,{values['width']},{values['height']}"
    more = {
        "region": "" if values["region"] == whole else values["region"],
        "shadows": bool(values["shadows"]),
        "threads": _threads(results, cell),
    }
    values["epsilon"] = "" if _asked_for(results, cell, "epsilon") is None else f"{values['epsilon']:.17g}"
    if "cutoff" in values:
        exponent = power(values["cutoff"])
        values["cutoff"] = f"{values['cutoff']:.17g}" if exponent is None else f"2^{exponent}"
    if not values.get("lens_radius"):
        values.pop("focal_distance", None)
    if values.get("sampler") == "one" and values.get("samples") == default("samples"):
        values.pop("sampler")  # which is then left to the command
    return values | more


def _threads(results: Results, cell: Cell) -> int:
    """The number that the experiment asks for; the command's default, if it leaves it to the variant."""
    told = _asked_for(results, cell, "threads")
    return default("threads") if told in (None, "default") else told


def _asked_for(results: Results, cell: Cell, key: str):
    """What the experiment has for a key of [image] in this cell; None if it says nothing."""
    experiment = results.facts["experiment"]
    case = next((told for told in experiment.get("case", ()) if told["name"] == cell.swept.get("case")), {})
    return cell.swept.get(key) or case.get(key) or experiment.get("image", {}).get(key)


def _scene(results: Results, cell: Cell) -> tuple[str, list[str]] | Missing:
    """The scene file, and the command that writes it, if it is a generated one."""
    made = _generated(results, cell)
    if made is None:
        experiment = _asked(results).get("experiment")
        return str(experiment.parent / cell.scene if experiment else cell.scene), []
    if made["scene"] not in SUFFIXES:
        return Missing(f"{made['scene']} is made in memory, and rayrace generate writes its mesh alone")
    known = {key: cell.swept.get(key, made.get(key)) for key in COUNTS}
    counts = {key: value for key, value in known.items() if value is not None}
    file = "-".join([made["scene"], *(f"{key}-{value}" for key, value in counts.items())]) + SUFFIXES[made["scene"]]
    options = _options("generate")
    words = [word for key, value in counts.items() for word in (options[COUNTS[key]].opts[0], str(value))]
    return file, ["rayrace", "generate", made["scene"], *words, "-o", file]


def _generated(results: Results, cell: Cell) -> dict | None:
    """What the experiment says of the generated scene of a cell: one of [[generate]] tables; None of a file."""
    told = results.facts["experiment"].get("generate")
    tables = told if isinstance(told, list) else [told] if told else []
    if len(tables) < 2:
        return next(iter(tables), None)
    return next(made for made in tables if _named(made, cell) == Path(cell.scene).stem)


def _named(made: dict, cell: Cell) -> str:
    """What cells of a generated scene are called (harness/source.py)."""
    counts = {key: made[key] for key in COUNTS if made.get(key) is not None and key not in cell.swept}
    return "-".join([made["scene"], *(f"{key}-{value}" for key, value in counts.items())])


def _renderers(results: Results) -> list[str]:
    return [word for folder in _asked(results).get("renderer") or () for word in ("--renderer", str(folder))]


@lru_cache(maxsize=1)
def _asked(results: Results) -> dict:
    """What `rayrace run` was given; {} if the run does not say that it was that command."""
    words = results.facts["command"][1:]
    if words[:1] != ["run"]:
        return {}
    lenient = {"resilient_parsing": True, "ignore_unknown_options": True, "allow_extra_args": True}
    return _commands()["run"].make_context("run", list(words[1:]), **lenient).params


@lru_cache
def _options(command: str) -> dict:
    """The options of a command of rayrace by name, with their words and defaults."""
    return {option.name: option for option in _commands()[command].params if option.param_type_name == "option"}


@lru_cache
def _commands() -> dict:
    return typer.main.get_command(cli.app).commands
