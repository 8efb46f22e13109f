"""The manifest of a renderer, `renderer.toml`, as a model (renderers/README.md)."""

import tomllib
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from harness.errors import UserError

CONTRACT = 1
DOTS = 10**7  # of a TOML file: sum of their squares by line, as of a list of 3000 numbers in one line
FAULTS = 100  # of a TOML file that are looked into


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Requires(Strict):
    modules: tuple[str, ...] = ()
    programs: tuple[str, ...] = ()


class Build(Strict):
    """options: words for values of methods, by method and value."""

    compiler: Literal["c++", "c"]
    command: tuple[str, ...] = Field(min_length=1)
    options: dict[str, dict[str, tuple[str, ...]]] = {}


class Export(Strict):
    """A command that writes the scene of a job in a format of its own, `out/scene{suffix}`."""

    suffix: str = Field(pattern=r"^\.[a-z0-9]+$")
    command: tuple[str, ...] = Field(min_length=1)


class Inspect(Strict):
    """A command that compiles the kernels of a job for GPUs that need not be there, and tells what they take."""

    command: tuple[str, ...] = Field(min_length=1)


class Spots(Strict):
    """A command that works out single pixels of a job, in any precision."""

    command: tuple[str, ...] = Field(min_length=1)


class Variant(Strict):
    """requires: beside the renderer's own. methods: in place of the renderer's, if given.

    exhibit: why it is there, though made to be wrong: to be looked at. It is run and judged like any other, and ranked
    with none.
    """

    name: str = Field(pattern=r"^[a-z][a-z0-9-]*$")
    command: tuple[str, ...] = Field(min_length=1)
    changes: str = ""
    threads: Literal[1, "all"] = 1
    device: Literal["cpu", "cuda"] = "cpu"
    requires: Requires = Requires()
    methods: dict[str, tuple[str, ...]] | None = None
    exhibit: str | None = Field(None, min_length=1)


class Manifest(Strict):
    """One `renderer.toml`. The first value of a method is its default.

    external: it starts a program that is not ours, so its picture is judged to EXTERNAL_TOLERANCE and its rays are not.
    shares: files outside its folder that are part of it, from there.
    """

    contract: Literal[1]
    name: str = Field(pattern=r"^[a-z][a-z0-9-]*$")
    technology: str
    description: str
    features: tuple[str, ...]
    methods: dict[str, tuple[str, ...]] = {}
    external: bool = False
    shares: tuple[str, ...] = ()
    requires: Requires = Requires()
    build: Build | None = None
    export: Export | None = None
    inspect: Inspect | None = None
    spots: Spots | None = None
    variant: tuple[Variant, ...] = Field(min_length=1)


def read_toml(path: Path) -> dict:
    """The tables of a TOML file; UserError with file, line and column if it is not one."""
    try:
        text = path.read_text(encoding="utf-8-sig")
        # A key of n parts takes tomllib time and memory of n * n.
        if sum(line.count(".") ** 2 for line in text.splitlines()) > DOTS:
            raise UserError(f"{path}: a line with too many dots", remedy="write tables under headings, lists in lines")
        return tomllib.loads(text)
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise UserError(f"{path}: not a text file (UTF-8)") from None
    except ValueError as error:  # also of a number of too many digits
        raise UserError(f"{path}: {error}") from None
    except RecursionError:
        raise _too_deep(path) from None


def _too_deep(path: Path) -> UserError:
    return UserError(f"{path}: lists or tables are nested too deep", remedy="no key takes more than a few levels")


def validated(model: type[BaseModel], tables: dict, path: Path) -> BaseModel:
    """`tables` as a `model`; UserError naming every faulty key of the file."""
    try:
        tables = _frozen(tables)
        return model.model_validate(tables)
    except RecursionError:
        raise _too_deep(path) from None
    except ValidationError as error:
        found = {}  # a value that may be of several types has one error for each
        for fault in error.errors(include_url=False)[:FAULTS]:
            found.setdefault(_place(fault, tables), []).append(_message(fault, model))
        lines = [f"{path}: {place + ': ' if place else ''}{' or: '.join(texts)}" for place, texts in found.items()]
        raise UserError("\n".join(lines)) from None


def _frozen(value):
    """`value` with tuples for its lists, which is what strict models take."""
    if isinstance(value, dict):
        return {key: _frozen(item) for key, item in value.items()}
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


def _place(error: dict, tables: dict) -> str:
    """The dotted key of a fault, without the names of types that pydantic puts between."""
    keys, value = [], tables
    for step in error["loc"]:
        if (isinstance(value, dict) and step in value) or (isinstance(value, tuple) and step in range(len(value))):
            value = value[step]
            keys.append(str(step))
    if error["type"] == "missing":
        keys.append(str(error["loc"][-1]))
    return ".".join(keys)


def _message(error: dict, model: type[BaseModel]) -> str:
    if error["type"] != "extra_forbidden":
        text = error["msg"].removeprefix("Value error, ")
        return text.replace("tuple", "list").replace("Tuple", "List")  # as TOML has it
    import difflib

    known = list(_keys_at(model, error["loc"][:-1]))
    near = difflib.get_close_matches(str(error["loc"][-1]), known, n=1)
    hint = f'did you mean "{near[0]}"?' if near else "known keys: " + ", ".join(known)
    return f"unknown key; {hint}"


def _keys_at(model, place):
    """Names of the fields of the model found by following `place` down from `model`."""
    for step in place:
        if isinstance(step, str) and step in model.model_fields:
            model = model.model_fields[step].annotation
        inner = [a for a in getattr(model, "__args__", ()) if isinstance(a, type) and issubclass(a, BaseModel)]
        model = inner[0] if inner else model
    return getattr(model, "model_fields", {})


def load(folder: Path) -> Manifest:
    """The manifest of the renderer in `folder`."""
    path = Path(folder) / "renderer.toml"
    if not path.is_file():
        raise UserError(f"{path}: no such file; a renderer is a folder with a renderer.toml (renderers/README.md)")
    found = validated(Manifest, read_toml(path), path)
    for shared in found.shares:
        if not path.parent.joinpath(shared).is_file():
            raise UserError(f"{path}: shares: no such file: {shared}")
    return found
