"""Reads TOML files into models, and reports every mistake with its line and the probable correction."""

import re
import tomllib
from collections.abc import Callable, Iterable, Iterator
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError, create_model

from harness import textfile
from harness.errors import UserError

LARGEST = 1 << 22  # bytes
DOTS = 10**7  # sum of the squares of dots in each line, at most; a list of 3000 numbers in one line has that many
FAULTS = 100  # faults that are reported for a file, at most
ROUNDS = 20  # rounds of validation, each without the faulty values of earlier ones

# A place in a file, step by step: keys, and numbers of tables or values.
Place = tuple[str | int, ...]
_HEADING = re.compile(r"\s*\[(\[?)([^\[\]]+)\]\]?\s*(#.*)?$")
_KEY = re.compile(r"""\s*((?:[\w-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[\w-]+|"[^"]*"|'[^']*'))*)\s*=""")
_PART = re.compile(r"""[\w-]+|"[^"]*"|'[^']*'""")


class Strict(BaseModel):
    """A table: no unknown keys, no conversions."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def read_toml(path: Path) -> dict:
    """The tables of a TOML file. UserError, with file, line and column, if it is not valid."""
    try:
        text = textfile.read(path, LARGEST)
        # For a key of n parts tomllib takes time and memory proportional to n * n.
        if sum(line.count(".") ** 2 for line in text.splitlines()) > DOTS:
            raise UserError(f"{path}: a line with too many dots", remedy="write tables under headings, lists in lines")
        return tomllib.loads(text)
    except ValueError as error:  # also for a number with too many digits
        raise UserError(f"{path}: {error}") from None
    except RecursionError:
        raise _too_deep(path) from None


def _too_deep(path: Path) -> UserError:
    return UserError(f"{path}: lists or tables are nested too deep", remedy="no key takes more than a few levels")


def validated(
    model: type[BaseModel],
    tables: dict,
    path: Path,
    given: tuple[str, ...] = (),
    check: Callable[[dict], Iterator[tuple[Place, str]]] = lambda _: iter(()),
) -> BaseModel:
    """`tables` as a `model`. UserError with a line for each mistake: file, line, key, probable correction.

    Faulty values are set aside, so that mistakes of other kinds are found too. given: dotted keys from the command line
    instead of the file. check: yields more mistakes, (place, message), in the tables without the faulty values.
    """
    try:
        tables = _frozen(tables)
        found, faults, rest, kind = None, {}, tables, model
        for _ in range(ROUNDS):
            try:
                found = kind.model_validate(rest)
                break
            except ValidationError as error:
                if lacking := [name for name in _lacking(error) if (name,) in faults]:
                    kind = _with_blanks(kind, lacking)
                    continue
                new = _faults(error, rest, model, faults)
                aside = {place if is_value else place[:-1] for place, (_, is_value) in new.items()} - {()}
                if faults and () in new:  # ignore faults that follow from values set aside
                    texts = [text for line in new.pop(())[0] for text in line.split("\n")]
                    kept = [text for text in texts if not _follows(text, faults)]
                    new |= {(): (["\n".join(kept)], False)} if kept else {}
                faults = {place: texts for place, (texts, _) in new.items()} | faults
                if not aside or error.error_count() > FAULTS:
                    break
                for place in sorted(aside, key=lambda one: (len(one), str(one)), reverse=True):
                    rest = _without(rest, place)
        for place, text in check(rest):
            faults.setdefault(place, []).append(text)
    except RecursionError:
        raise _too_deep(path) from None
    if not faults:
        return found
    lines = _Lines(path)
    told = []
    for place, texts in faults.items():
        key = ".".join(map(str, place))
        for text in " or: ".join(texts).split("\n"):
            named = key or text.partition(":")[0]
            if any(named == one or named.startswith(f"{one}.") for one in given):
                told.append((0, f"--set {key}: {text}" if key else f"--set {text}"))
                continue
            line = lines.of(place or named)
            where = f"{path}:{line}" if line else f"{path}"
            told.append((line or 0, f"{where}: {key}: {text}" if key else f"{where}: {text}"))
    raise UserError("\n".join(text for _, text in sorted(told, key=lambda one: one[0])))


def _follows(text: str, faults: Iterable[Place]) -> bool:
    """Whether a message about the whole file may follow from a value that was set aside: it begins with its key."""
    places = [tuple(step for step in place if isinstance(step, str)) for place in faults]
    key = text.partition(":")[0].partition('"')[0].strip()
    if "." not in key:
        return bool({place[0] for place in places if place} & set(re.findall(r"\w+", key)))
    steps = _parts(key)
    return any(all(a == b for a, b in zip(place, steps, strict=False)) for place in places if place)


def _lacking(error: ValidationError) -> list[str]:
    """Names of required top-level fields that are missing."""
    return [fault["loc"][0] for fault in error.errors() if fault["type"] == "missing" and len(fault["loc"]) == 1]


def _with_blanks(model: type[BaseModel], names: list[str]) -> type[BaseModel]:
    """The model with blank defaults, "" or (), for required fields that were set aside, to check the others."""

    def blank(kind):
        return get_args(kind)[0] if get_origin(kind) is Literal else (get_origin(kind) or kind)()

    blanks = {name: (Any, blank(model.model_fields[name].annotation)) for name in names}
    return create_model(model.__name__, __base__=model, **blanks)


def _faults(
    error: ValidationError, tables: dict, model: type[BaseModel], before: Iterable[Place]
) -> dict[Place, tuple[list[str], bool]]:
    """The messages for each place, and whether it is a value, which can be set aside, or a missing key.

    before: places of known faults. Leaves out faults that follow from one further down, such as a list that is too
    short without its faulty values, or a value that has no other type of a union either.
    """
    found: dict[Place, tuple[list[str], bool]] = {}
    errors = error.errors(include_url=False)[:FAULTS]
    places = [_place(fault, tables) for fault in errors]
    above = {place[:n] for place in (*before, *places) for n in range(1, len(place))}
    for fault, place in zip(errors, places, strict=True):
        if place in above and fault["type"] != "value_error":
            continue
        texts, _ = found.setdefault(place, ([], bool(place) and fault["type"] != "missing"))
        texts.append(_message(fault, model, place))  # a value of a union type has a fault for each type
    return found


def _frozen(value):
    """`value` with tuples instead of lists, as strict models require."""
    if isinstance(value, dict):
        return {key: _frozen(item) for key, item in value.items()}
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


def _without(value, place: Place):
    """`value` without the value at `place`."""
    step, *more = place
    if isinstance(value, dict):
        if not more:
            return {key: item for key, item in value.items() if key != step}
        return {key: _without(item, tuple(more)) if key == step else item for key, item in value.items()}
    if not more:
        return value[:step] + value[step + 1 :]
    return tuple(_without(item, tuple(more)) if number == step else item for number, item in enumerate(value))


def _place(error: dict, tables: dict) -> Place:
    """The place of a fault, without the names of types that pydantic inserts."""
    steps, value = [], tables
    for step in error["loc"]:
        if (isinstance(value, dict) and step in value) or (isinstance(value, tuple) and step in range(len(value))):
            value = value[step]
            steps.append(step)
    if error["type"] == "missing":
        steps.append(error["loc"][-1])
    return tuple(steps)


def _message(error: dict, model: type[BaseModel], place: Place) -> str:
    if error["type"] != "extra_forbidden":
        text = error["msg"].removeprefix("Value error, ")
        return text.replace("tuple", "list").replace("Tuple", "List").replace("dictionary", "table")  # as TOML has it
    key = str(error["loc"][-1])
    known = list(_keys_at(model, error["loc"][:-1]))
    near = get_close_matches(key, known, n=1)
    below = [f"{name}.{inner}" for name, inner in _below(model) if inner == key and name not in map(str, place[:-1])]
    meant = " or ".join(f'"{name}"' for name in (below or near))
    return "unknown key; " + (f"did you mean {meant}?" if meant else f"known keys: {', '.join(known)}")


def _below(model: type[BaseModel]) -> Iterator[tuple[str, str]]:
    """Yields (table, key) for all keys of all tables of a model."""
    for name in model.model_fields:
        for inner in _keys_at(model, (name,)) if name not in ("case", "override") else ():
            yield name, inner


def _keys_at(model, place):
    """The fields of the model at `place` below `model`."""
    for step in place:
        if isinstance(step, str) and step in getattr(model, "model_fields", {}):
            model = model.model_fields[step].annotation
        inner = [a for a in getattr(model, "__args__", ()) if isinstance(a, type) and issubclass(a, BaseModel)]
        model = inner[0] if inner else model
    return getattr(model, "model_fields", {})


class _Lines:
    """Finds the line of a place in a TOML file. Keys in inline tables have the line of the table."""

    def __init__(self, path: Path):
        self.known: dict[Place, int] = {}
        try:
            lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
        except OSError:
            return
        table: Place = ()
        counts: dict[Place, int] = {}
        for number, line in enumerate(lines, 1):
            if heading := _HEADING.match(line):
                table = ()
                for step in _parts(heading[2]):  # a table lies in the last one of each array of tables above it
                    table = (*table, counts[table], step) if table in counts else (*table, step)
                if heading[1]:
                    counts[table] = counts.get(table, -1) + 1
                    table = (*table, counts[table])
                self.known.setdefault(table, number)
            elif key := _KEY.match(line):
                self.known.setdefault((*table, *_parts(key[1])), number)

    @cached_property
    def _all(self) -> dict[tuple[str, ...], int]:
        """`known`, and each place without its numbers of tables: the first table of that name. Numbers as text."""
        first: dict[Place, int] = {}
        for place, line in self.known.items():
            first.setdefault(tuple(step for step in place if isinstance(step, str)), line)
        return {tuple(map(str, place)): line for place, line in (first | self.known).items()}

    def of(self, place: Place | str) -> int | None:
        """The line of a place or dotted key, or of the closest table around it; None if there is none."""
        steps = tuple(map(str, _parts(place) if isinstance(place, str) else place))
        return next((self._all[steps[:n]] for n in range(len(steps), 0, -1) if steps[:n] in self._all), None)


def _parts(key: str) -> Place:
    return tuple(part.strip("\"'") for part in _PART.findall(key))
