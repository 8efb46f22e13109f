"""Compiles a program on first use, into a cache keyed by its sources, flags, compiler and processor."""

import contextlib
import hashlib
import json
import os
import platform
import shlex
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from harness.errors import UserError, of_system
from harness.system import git, lock, ownership

CANDIDATES = {"c++": ("CXX", ("c++", "g++", "clang++")), "c": ("CC", ("cc", "gcc", "clang"))}
MISSING = {"c++": "no C++ compiler (apt install g++)", "c": "no C compiler (apt install gcc)"}
ASK = ("--version", "version", "-version", "-V")  # how compilers are asked for their version: gcc and rustc, go, ..
COMPILER = "{compiler}"
DEFINES, OPTIONS = "{defines}", "{options}"  # words of a build command: what the job needs, and its methods
TIMEOUT = 600  # s


class BuildError(Exception):
    """The build failed; str() says how."""


@dataclass(frozen=True)
class Built:
    """A finished build. `seconds` is what it took when it was made, `cached` whether that was earlier."""

    folder: Path
    seconds: float
    compiler: str
    command: tuple[str, ...]
    cached: bool


def cache_folder(name: str) -> Path:
    """Folder `name` of the user's cache, or of $RAYRACE_CACHE."""
    import platformdirs

    try:
        return Path(os.environ.get("RAYRACE_CACHE") or platformdirs.user_cache_dir("rayrace")) / name
    except RuntimeError:
        why = "no folder for the cache: HOME is not set, and the system does not know this user"
        raise UserError(why, remedy="set RAYRACE_CACHE to a folder") from None


def noexec(folder: Path) -> str:
    """Says that no program may run from a folder, by the mount option noexec, and what to do; "" if one may."""
    if not os.statvfs(folder).f_flag & getattr(os, "ST_NOEXEC", 0):
        return ""
    variable = "RAYRACE_CACHE" if folder.is_relative_to(cache_folder("")) else "TMPDIR"
    return f"{folder} is on a file system that runs no programs (noexec): set {variable} to a folder of another"


def state_folder() -> Path:
    """The user's folder for what rayrace must keep, and no cache of a job is beside."""
    import platformdirs

    return Path(platformdirs.user_state_dir("rayrace"))


def find_compiler(kind: str) -> str | None:
    """The path of a compiler of C++ or C, or of any other program by its name; None if there is none."""
    return next(iter(compiler(kind)), None)


def compiler(kind: str) -> tuple[str, ...]:
    """The words that begin the command of a compiler of C++ or C, or of any other program by its name: its path, and of
    CXX and CC the words that follow, as in CXX="ccache g++". () if there is none."""
    variable, names = CANDIDATES.get(kind, ("", (kind,)))
    chosen = os.environ.get(variable, "")
    try:
        own = shlex.split(chosen)
    except ValueError:  # a quote that does not end
        own = [chosen]
    for first, *more in [[chosen], own] if own else ([name] for name in names):  # a path may have blanks in it
        if path := shutil.which(first):
            return path, *more
    return ()


def missing(kind: str) -> str:
    """The message where a compiler is not installed."""
    variable, _ = CANDIDATES.get(kind, ("", ()))
    if chosen := os.environ.get(variable):
        return f"{variable} is {chosen!r}, and there is no such program (correct {variable}, or unset it)"
    return MISSING.get(kind) or f"no program {kind} on the PATH (install it, or put its folder on the PATH)"


@cache
def compiler_version(*command: str) -> str:
    """The first line that a compiler prints when it is asked for its version, in the first way that it takes."""
    for word in ASK:
        try:
            answer = subprocess.run(
                [*command, word], capture_output=True, text=True, errors="replace", timeout=30, stdin=subprocess.DEVNULL
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            return f"unavailable: {error}"
        line = (answer.stdout or answer.stderr).strip().partition("\n")[0].strip()
        if answer.returncode == 0 and line:
            return line
    return "unavailable: it does not tell"


def _identity(path: str) -> str:
    """A compiler as a file: another one, wherever its version is not told, has another size or time."""
    state = os.stat(os.path.realpath(path))
    return f"{os.path.realpath(path)} {state.st_size} {state.st_mtime_ns}"


@cache
def processor() -> str:
    """Identifies the processor for -march=native: its model and instruction sets."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    wanted = ("model name", "flags", "Features", "CPU part")
    return "\n".join(sorted({line for line in lines if line.startswith(wanted)})) or platform.machine()


def build(renderer, chosen: dict[str, tuple[str, ...]] | None = None) -> Built:
    """Build `renderer` (a registry.Renderer), or find its build. BuildError if there is no compiler or it fails.

    chosen: the words that stand for {defines} and {options} in its command; none if left out.
    """
    recipe = renderer.manifest.build
    substitutions = {DEFINES: (), OPTIONS: (), **(chosen or {})}
    words = tuple(word for part in recipe.command for word in substitutions.get(part, (part,)))
    return make(renderer.manifest.name, renderer.version, renderer.folder, recipe.compiler, words)


def make(name: str, content: str, folder: Path, kind: str, words: tuple[str, ...]) -> Built:
    """Run the command `words` in the cache, or find what it made. BuildError if there is no compiler or it fails.

    {folder}, {compiler} and {build} in it stand for `folder`, a compiler of a `kind` of CANDIDATES, and where the
    result goes. content: a hash of the sources.
    """
    compiling = compiler(kind)
    if not compiling:
        raise BuildError(missing(kind))
    version = compiler_version(*compiling)
    made_by = version if not version.startswith("unavailable") else _identity(compiling[0])
    parts = (content, str(folder), *words, *compiling, made_by, processor())
    key = hashlib.sha256("\0".join(parts).encode()).hexdigest()[:24]
    home = cache_folder("builds")
    final = home / f"{name}-{key}"
    if there := _whole(final):  # also in a cache that nobody may write to
        return there
    try:
        home.mkdir(parents=True, exist_ok=True)
        with lock.of_file(Path(f"{final}.lock"), wait=True):
            return _whole(final) or _fresh(folder, words, compiling, version, final)
    except OSError as error:
        raise BuildError(f"{of_system(error, home)}; RAYRACE_CACHE names another folder") from None


def _whole(final: Path) -> Built | None:
    """A build as it was made; None if it is not there, or damaged."""
    try:
        record = json.loads((final / "build.json").read_text())
        if record["files"] != {name: _state(final / name) for name in record["files"]}:
            return None
        return Built(final, record["seconds"], record["compiler"], tuple(record["command"]), True)
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _state(path: Path) -> str:
    """Describes a file: whether it is executable, and a hash of its content."""
    return f"{path.stat().st_mode & 0o111:o} {hashlib.sha256(path.read_bytes()).hexdigest()}"


def _fresh(folder: Path, words, compiling, version, final: Path) -> Built:
    if ownership.is_ours(final):  # damaged
        shutil.rmtree(final, ignore_errors=True)
    if os.path.lexists(final):
        raise BuildError(f"{final} is no build that rayrace can use or remove; remove it, or set RAYRACE_CACHE")
    for old in final.parent.glob(f"{final.name}-*"):  # of a process that was killed
        with contextlib.suppress(ownership.Doubt, ownership.Alive), ownership.proved(old, final.name):
            shutil.rmtree(old, ignore_errors=True)
    scratch = Path(tempfile.mkdtemp(prefix=f"{final.name}-", dir=final.parent))
    try:
        with ownership.marked(scratch, final.name):
            return _built(folder, words, compiling, version, final, scratch)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _built(folder: Path, words, compiling, version, final: Path, scratch: Path) -> Built:
    """Build in the folder `scratch`, and rename it to `final`. BuildError if the build fails."""
    places = {"compiler": shlex.join(compiling), "folder": str(folder), "build": str(scratch)}
    command = [word for part in words for word in (compiling if part == COMPILER else [fill(part, places)])]
    start = time.monotonic()
    try:
        done = subprocess.run(
            command, cwd=scratch, capture_output=True, text=True, errors="replace", timeout=TIMEOUT,
            stdin=subprocess.DEVNULL, env=git.environment(),
        )  # fmt: skip
    except OSError as error:
        raise BuildError(f"{command[0]}: {error.strerror}") from None
    except subprocess.TimeoutExpired:
        raise BuildError(f"the build did not end within {TIMEOUT} s") from None
    seconds = time.monotonic() - start
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        first = next((line for line in lines if "error" in line), lines[-1] if lines else "no message")
        raise BuildError(f"{' '.join(command)}: exit {done.returncode}: {first}")
    made = [path for path in sorted(scratch.rglob("*")) if path.is_file() and path.name != ownership.MARKER]
    files = {str(path.relative_to(scratch)): _state(path) for path in made}
    record = {"seconds": seconds, "compiler": version, "command": words, "files": files}
    (scratch / "build.json").write_text(json.dumps(record))
    os.replace(scratch, final)
    return Built(final, seconds, version, words, False)


def fill(word: str, places: dict[str, str]) -> str:
    """`word` with its {placeholders} filled in; other braces stay."""
    for name, value in places.items():
        word = word.replace("{" + name + "}", value)
    return word
