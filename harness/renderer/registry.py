"""Finds renderers: in the package, in $RAYRACE_RENDERERS and in folders given by --renderer."""

import difflib
import hashlib
import importlib.resources
import importlib.util
import os
import re
import shutil
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from harness.errors import UserError
from harness.renderer import builder, manifest
from harness.renderer.parameters import Parameters
from harness.system import cuda, opencl, trouble

SEARCH_PATH = "RAYRACE_RENDERERS"
NOT_SOURCES = {"__pycache__", "NOTES.md", "README.md"}
MADE = re.compile(r"\..*|#.*#|.*(~|\.pyc|\.o)")  # hidden, an editor's copy, or compiled
EXTRAS = {  # of rayrace, that bring the modules which bundled renderers require
    "numba_cuda": "cuda", "embreex": "peers", "jax": "peers", "taichi": "peers", "Cython": "peers", "mypy": "peers",
    "setuptools": "peers", "pyopencl": "opencl", "cuda.bindings": "cuda",
}  # fmt: skip
RUN, REPORT = ("run.json", "repetitions.jsonl"), ".rayrace-report"  # what a run and a report of one hold
CACHE = "CACHEDIR.TAG"  # in a folder that can be made again, as cargo's target/ (bford.info/cachedir)


@dataclass(frozen=True)
class Renderer:
    """A renderer's folder and manifest."""

    folder: Path
    manifest: manifest.Manifest

    def sources(self) -> list[str]:
        """The files that make up the renderer now, from its folder, sorted; at the end those that it shares.

        What editors, compilers and rayrace leave there is not part of it, unless the manifest names it.
        """
        files = []
        for place, folders, names in os.walk(self.folder):
            folders[:] = [name for name in folders if _may_hold_sources(Path(place, name))]
            files += [
                os.path.relpath(os.path.join(place, name), self.folder)
                for name in names
                if not (MADE.fullmatch(name) or name in NOT_SOURCES) and os.path.isfile(os.path.join(place, name))
            ]
        return [*sorted({*files, *self._named()}), *self.manifest.shares]

    def _named(self) -> Iterator[str]:
        """Files in its folder that a command of the manifest starts or passes on."""
        own_manifest = self.manifest
        parts = (
            *own_manifest.variant,
            own_manifest.build,
            own_manifest.export,
            own_manifest.inspect,
            own_manifest.spots,
        )
        for word in (word for part in parts if part for word in part.command):
            before, given, name = word.partition("{folder}/")
            if given and not before and (self.folder / name).is_file():
                yield os.path.normpath(name)

    @cached_property
    def version(self) -> str:
        """Hash of its content: two renderers of the same version are the same."""
        content = "".join(f"{name}\0{digest}\n" for name, (_, digest) in self._known.items())
        return hashlib.sha256(content.encode()).hexdigest()[:16]

    @cached_property
    def lines(self) -> int:
        """Lines of the sources in its own folder that are not blank, without its manifest."""
        own = [name for name in self._known if name not in self.manifest.shares and name != "renderer.toml"]
        texts = (self.folder.joinpath(name).read_text(encoding="utf-8", errors="replace") for name in own)
        return sum(bool(line.strip()) for text in texts for line in text.splitlines())

    def changed(self) -> list[str]:
        """Sources that are not, or no longer, what `version` was made of: edited, added or taken away."""
        return sorted(self._known.keys() ^ set(self.sources()) | set(filter(self._edited, self._known)))

    def _edited(self, name: str) -> bool:
        mark, digest = self._known[name]
        try:
            return _mark(self.folder / name) != mark and _digest(self.folder / name) != digest
        except OSError:  # it is gone
            return True

    @cached_property
    def _known(self) -> dict[str, tuple]:
        """The mark and the digest of each source, when first asked for."""
        return {name: (_mark(self.folder / name), _digest(self.folder / name)) for name in self.sources()}

    @cached_property
    def home(self) -> Path | None:
        """The folder from which Python imports the renderer's package; None if its folder is no package."""
        places = (self.folder, *self.folder.parents)
        folder = next(place for place in places if not (place / "__init__.py").is_file())
        return None if folder == self.folder else folder

    @cached_property
    def unavailable(self) -> str | None:
        """None, or why it cannot run here and what to do about it."""
        missing = _missing(self.manifest.requires)
        if missing:
            return missing
        if self.manifest.build and builder.find_compiler(self.manifest.build.compiler) is None:
            return builder.missing(self.manifest.build.compiler)
        return None

    def given(self, parameters: Parameters, needs: tuple[str, ...]) -> tuple[str, ...]:
        """The needs as its program gets them: the job's, and what its kernel carries without need."""
        return tuple(dict.fromkeys((*needs, *parameters.carried(self.manifest.features))))

    def build(self, parameters: Parameters | None = None, needs: tuple[str, ...] = ()) -> builder.Built | None:
        """Its build for a job, made or taken from the cache; None if it needs none. BuildError if it fails.

        Without a job, the build that holds everything.
        """
        if self.manifest.build is None:
            return None
        defines, options = (), ()
        if parameters and builder.DEFINES in self.manifest.build.command:
            given = self.given(parameters, needs)
            defines = parameters.defines(tuple(name for name in given if name in self.manifest.features))
        if parameters:
            options = tuple(
                word
                for method, values in self.manifest.build.options.items()
                for word in values.get(getattr(parameters, method), ())
            )
        chosen = defines, options
        if chosen not in self._builds:
            try:
                self._builds[chosen] = builder.build(self, {builder.DEFINES: defines, builder.OPTIONS: options})
            except builder.BuildError as error:  # is not tried again for each repetition
                self._builds[chosen] = error
        if isinstance(self._builds[chosen], builder.BuildError):
            raise self._builds[chosen]
        return self._builds[chosen]

    @cached_property
    def _builds(self) -> dict:
        """Build or BuildError by its defines and options."""
        return {}


@dataclass(frozen=True)
class Entry:
    """A variant of a renderer: what an experiment names and a cell runs.

    label: of another version than the one known by the variant's name alone (earlier.py).
    """

    renderer: Renderer
    variant: manifest.Variant
    label: str = ""

    @property
    def name(self) -> str:
        return f"{self.variant.name}@{self.label}" if self.label else self.variant.name

    def is_of(self, other: "Entry") -> bool:
        """Whether both are variants of one renderer, in any version."""
        renderer, its = self.renderer, other.renderer
        return renderer.folder == its.folder or (
            self.label != other.label and renderer.manifest.name == its.manifest.name
        )

    @property
    def unavailable(self) -> str | None:
        """None, or why it cannot run here and what to do about it."""
        if self.variant.device == "cuda" and not self.missing and not (self.simulated or cuda.devices()):
            return cuda.MISSING if self.variant.simulator else cuda.NO_DEVICE
        if self.variant.device == "opencl" and not self.missing and not opencl.drivers():
            return opencl.MISSING
        return self.missing

    @property
    def missing(self) -> str | None:
        """None, or what it needs here beside a device, with the remedy."""
        return self.renderer.unavailable or _missing(self.variant.requires)

    @property
    def simulated(self) -> bool:
        """Does it run in a simulator of its device, so that its times say nothing?"""
        return self.variant.device == "cuda" and self.variant.simulator and cuda.simulated()

    @property
    def methods(self) -> dict[str, tuple[str, ...]]:
        """Parameters with a choice, the default first."""
        own = self.variant.methods
        return self.renderer.manifest.methods if own is None else own

    @property
    def contract(self) -> int:
        """The version of the contract that it keeps."""
        return self.variant.contract or self.renderer.manifest.contract

    def threads(self) -> int:
        """How many threads it runs by default on this machine."""
        return 1 if self.variant.threads == 1 else usable_cores()


def _may_hold_sources(folder: Path) -> bool:
    """Is it neither hidden nor a cache, nor a folder of results: a run, or a report of one?"""
    if folder.name.startswith(".") or folder.name in NOT_SOURCES:
        return False
    if any((folder / name).is_file() for name in (REPORT, CACHE)):
        return False
    return not all((folder / name).is_file() for name in RUN)


def _mark(path: Path) -> tuple[int, ...]:
    """Returns a mark of a file that changes whenever it is written."""
    status = path.stat()
    return status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _missing(requires: manifest.Requires) -> str | None:
    """None, or the first of `requires` that is not here, with the remedy."""
    for module in requires.modules:
        if not _is_installed(module):
            wanted = f"'rayrace[{EXTRAS[module]}]'" if module in EXTRAS else module
            return f"no Python module {module} (pip install {wanted})"
    for program in requires.programs:
        if shutil.which(program) is None:
            return f"no program {program} on the PATH (apt install {program})"
    return None


def _is_installed(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except (ImportError, ValueError):  # of a package that is not there; of a name that cannot be
        return False


def usable_cores() -> int:
    return len(trouble.usable())


def folders(extra: tuple[Path, ...] = ()) -> list[Path]:
    """Folders of all known renderers, in the order of the three places."""
    home = Path(str(importlib.resources.files("renderers")))
    own = sorted(p.parent for p in home.resolve().glob("*/renderer.toml"))
    searched = [Path(p) for p in os.environ.get(SEARCH_PATH, "").split(os.pathsep) if p]
    return [*own, *named((*searched, *extra))]


def named(places: tuple[Path, ...]) -> list[Path]:
    """The folders of the renderers in these places: each a renderer's folder, or one that holds such folders."""
    renderer_folders = []
    for place in places:
        below = sorted(p.parent for p in place.glob("*/renderer.toml"))
        renderer_folders += [place] if (place / "renderer.toml").is_file() or not below else below
    return [p.resolve() for p in renderer_folders]


def entries(extra: tuple[Path, ...] = ()) -> dict[str, Entry]:
    """All variants by name. UserError if a manifest is faulty or two renderers claim one name."""
    variants: dict[str, Entry] = {}
    for folder in dict.fromkeys(folders(extra)):
        renderer = Renderer(folder, manifest.load(folder))
        for variant in renderer.manifest.variant:
            if variant.name in variants:
                other = variants[variant.name].renderer.folder
                raise UserError(f'{folder}/renderer.toml: variant "{variant.name}" is also in {other}; rename one')
            variants[variant.name] = Entry(renderer, variant)
    return variants


def find(name: str, variants: dict[str, Entry], file: Path | None = None) -> Entry:
    """The variant called `name`; UserError with the nearest names, and `file` as its place, if there is none."""
    if name in variants:
        return variants[name]
    raise UserError(unknown(name, variants), file=file)


def unknown(name: str, names: Collection[str]) -> str:
    """The message for a name that no renderer has, with the nearest one."""
    near = difflib.get_close_matches(name, names, n=1)
    return f'no renderer "{name}"; ' + (f'did you mean "{near[0]}"?' if near else f"known: {', '.join(names)}")
