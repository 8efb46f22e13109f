"""The manifest of a renderer, `renderer.toml`, as a model (renderers/README.md)."""

from pathlib import Path
from typing import Literal

from pydantic import Field

from harness.errors import UserError
from harness.toml import Strict, read_toml, validated


class Requires(Strict):
    modules: tuple[str, ...] = ()
    programs: tuple[str, ...] = ()


class Build(Strict):
    """compiler: c++, c, or any program, such as rustc. options: words for values of methods, by method and value."""

    compiler: str = Field(min_length=1)
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


class Count(Strict):
    """What counting in Valgrind needs, which does not know all instructions of a processor (harness/race/counting.py).

    options: words at the end of the build command. environment: variables that the renderer starts with.
    """

    options: tuple[str, ...] = ()
    environment: dict[str, str] = {}


class Operations(Strict):
    """A build whose numbers count the floating-point operations of a frame (harness/race/counting.py).

    options: words at the end of the build command.
    """

    options: tuple[str, ...] = Field(min_length=1)


class Variant(Strict):
    """requires: beside the renderer's own. methods, contract: in place of the renderer's, if given. simulator: of
    device cuda, if it has one.

    exhibit: why it is there, though made to be wrong or slow: to be looked at. It is run and judged like any other, and
    ranked with none. exhibit_of: a fault, whose picture is meant to be wrong, or a cost, whose picture must be right.
    """

    name: str = Field(pattern=r"^[a-z][a-z0-9-]*$")
    command: tuple[str, ...] = Field(min_length=1)
    changes: str = ""
    threads: Literal[1, "all"] = 1
    device: Literal["cpu", "cuda", "opencl"] = "cpu"
    simulator: bool = True
    requires: Requires = Requires()
    methods: dict[str, tuple[str, ...]] | None = None
    contract: Literal[1, 2] | None = None
    exhibit: str | None = Field(None, min_length=1)
    exhibit_of: Literal["fault", "cost"] = "fault"


class Manifest(Strict):
    """One `renderer.toml`. The first value of a method is its default.

    contract: with 2, its later frames are checked (harness/race/frames.py).
    external: it starts a program that is not ours, so its picture is judged to EXTERNAL_TOLERANCE and its rays are not.
    shares: files outside its folder that are part of it, from there. jobs: it takes a list of jobs (--jobs=FILE).
    count: by the machine's name for its processors (uname -m), such as x86_64.
    """

    contract: Literal[1, 2]
    name: str = Field(pattern=r"^[a-z][a-z0-9-]*$")
    technology: str
    description: str
    features: tuple[str, ...]
    methods: dict[str, tuple[str, ...]] = {}
    external: bool = False
    jobs: bool = False
    shares: tuple[str, ...] = ()
    requires: Requires = Requires()
    build: Build | None = None
    export: Export | None = None
    inspect: Inspect | None = None
    spots: Spots | None = None
    count: dict[str, Count] = {}
    operations: Operations | None = None
    variant: tuple[Variant, ...] = Field(min_length=1)


def load(folder: Path) -> Manifest:
    """The manifest of the renderer in `folder`."""
    path = Path(folder) / "renderer.toml"
    if not path.is_file():
        raise UserError(f"{path}: no such file; a renderer is a folder with a renderer.toml (renderers/README.md)")

    def check(tables: dict):
        for number, shared in enumerate(tables.get("shares", ())):
            if not path.parent.joinpath(shared).is_file():
                yield ("shares", number), f"no such file: {shared}"

    return validated(Manifest, read_toml(path), path, check=check)
