"""Reads TOML files into models, and reports every mistake with its line and the probable correction."""

import re
import tomllib
from collections.abc import Callable, Iterator
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from harness import textfile
from harness.errors import UserError

LARGEST = 1 << 22  # bytes
DOTS = 10**7  # sum of the squares of dots in each line, at most; a list of 3000 numbers in one line has that many
FAULTS = 100  # faults that are reported for a file, at most

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

    What concerns several values is looked at where each of them is right. given: dotted keys from the command line
    instead of the file. check: yields more mistakes, (place, message), of tables that are right so far.
    """
    try:
        tables, faults = _frozen(tables), {}
        try:
            instance = model.model_validate(tables)
        except ValidationError as error:
            faults = _faults(error, tables, model)
        else:
            for place, text in check(tables):
                faults.setdefault(place, []).append(text)
    except RecursionError:
        raise _too_deep(path) from None
    if not faults:
        return instance
    lines = _Lines(path)
    messages = []
    for place, texts in faults.items():
        key = ".".join(map(str, place))
        for text in " or: ".join(texts).split("\n"):
            named = key or text.partition(":")[0]
            if any(named == setting or named.startswith(f"{setting}.") for setting in given):
                messages.append((0, f"--set {key}: {text}" if key else f"--set {text}"))
                continue
            line = lines.of(place or named)
            where = f"{path}:{line}" if line else f"{path}"
            messages.append((line or 0, f"{where}: {key}: {text}" if key else f"{where}: {text}"))
    raise UserError("\n".join(text for _, text in sorted(messages, key=lambda message: message[0])))


def _faults(error: ValidationError, tables: dict, model: type[BaseModel]) -> dict[Place, list[str]]:
    """The messages for each place.

    Leaves out faults that follow from one further down, such as a value that has no other type of a union either.
    """
    messages: dict[Place, list[str]] = {}
    errors = error.errors(include_url=False)[:FAULTS]
    places = [_place(fault, tables) for fault in errors]
    above = {place[:n] for place in places for n in range(1, len(place))}
    for fault, place in zip(errors, places, strict=True):
        if place not in above or fault["type"] == "value_error":
            messages.setdefault(place, []).append(_message(fault, model, place))  # one for each type of a union
    return messages


def _frozen(value):
    """`value` with tuples instead of lists, as strict models require."""
    if isinstance(value, dict):
        return {key: _frozen(item) for key, item in value.items()}
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


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
    keys = list(_keys_at(model, error["loc"][:-1]))
    near = get_close_matches(key, keys, n=1)
    below = [f"{name}.{inner}" for name, inner in _below(model) if inner == key and name not in map(str, place[:-1])]
    meant = " or ".join(f'"{name}"' for name in (below or near))
    return "unknown key; " + (f"did you mean {meant}?" if meant else f"known keys: {', '.join(keys)}")


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
        self.numbers: dict[Place, int] = {}
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
                self.numbers.setdefault(table, number)
            elif key := _KEY.match(line):
                self.numbers.setdefault((*table, *_parts(key[1])), number)

    @cached_property
    def _all(self) -> dict[tuple[str, ...], int]:
        """`numbers`, and each place without its numbers of tables: the first table of that name. Numbers as text."""
        first: dict[Place, int] = {}
        for place, line in self.numbers.items():
            first.setdefault(tuple(step for step in place if isinstance(step, str)), line)
        return {tuple(map(str, place)): line for place, line in (first | self.numbers).items()}

    def of(self, place: Place | str) -> int | None:
        """The line of a place or dotted key, or of the closest table around it; None if there is none."""
        steps = tuple(map(str, _parts(place) if isinstance(place, str) else place))
        return next((self._all[steps[:n]] for n in range(len(steps), 0, -1) if steps[:n] in self._all), None)


def _parts(key: str) -> Place:
    return tuple(part.strip("\"'") for part in _PART.findall(key))
