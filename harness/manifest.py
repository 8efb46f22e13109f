"""What a renderer says of itself: `renderer.toml` (the contract's manifest) as a model."""

import tomllib
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from harness.errors import UserError

CONTRACT = 1


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Requires(Strict):
    modules: tuple[str, ...] = ()
    programs: tuple[str, ...] = ()


class Build(Strict):
    compiler: Literal["c++", "c"]
    command: tuple[str, ...] = Field(min_length=1)


class Variant(Strict):
    name: str = Field(pattern=r"^[a-z][a-z0-9-]*$")
    command: tuple[str, ...] = Field(min_length=1)
    changes: str = ""
    threads: Literal[1, "all"] = 1
    device: str = "cpu"


class Manifest(Strict):
    """One `renderer.toml`. The first value of a method is its default."""

    contract: Literal[1]
    name: str = Field(pattern=r"^[a-z][a-z0-9-]*$")
    technology: str
    description: str
    features: tuple[str, ...]
    methods: dict[str, tuple[str, ...]] = {}
    requires: Requires = Requires()
    build: Build | None = None
    variant: tuple[Variant, ...] = Field(min_length=1)


def read_toml(path: Path) -> dict:
    """The tables of a TOML file; UserError with file, line and column if it is not one."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise UserError(f"{path}: not a text file (UTF-8)") from None
    except tomllib.TOMLDecodeError as error:
        raise UserError(f"{path}: {error}") from None


def validated(model: type[BaseModel], tables: dict, path: Path) -> BaseModel:
    """`tables` as a `model`; UserError naming every faulty key of the file."""
    try:
        return model.model_validate(tables)
    except ValidationError as error:
        lines = [f"{path}: {'.'.join(map(str, e['loc']))}: {_message(e, model)}" for e in error.errors()]
        raise UserError("\n".join(lines)) from None


def _message(error: dict, model: type[BaseModel]) -> str:
    if error["type"] != "extra_forbidden":
        return error["msg"]
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
    return validated(Manifest, read_toml(path), path)
