"""Does CI catch anything? Changes rayrace in one random place after another, and runs the tests of CI on each change.

A program with one change is a mutant. It is caught if a test fails or takes too long; otherwise it survives: either it
behaves as before (it is equivalent), or no test looks there. cosmic-ray changes Python, universalmutator C++. All this
happens to a clone of the last commit, in the folder of temporary files; the checkout stays as it is. A draw depends on
the seed and the mutated files alone. Verdicts go to build/mutants/COMMIT-SEED.jsonl, a line each, and a table beside
it; a further call with the same commit and seed goes on there.
"""

import argparse
import ast
import contextlib
import importlib.util
import io
import json
import os
import random
import re
import resource
import secrets
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "build" / "mutants"
COPY = Path(tempfile.gettempdir()) / "rayrace-mutants"

PACKED = "reports/page/plotly.min.js"  # made by the installation (build.py)

MARKS = "not nightly and not alone"  # the tests of CI that may run beside other processes
ALONE = "not nightly and not (alone and slow)"  # these, and the tests of CI that measure
STAGE_S = 3600  # limit of the tests of a stage
MEMORY = 8 << 30  # bytes of one process: a mutant may ask for memory without end

ARITHMETIC, IDENTITY = {"Add", "Sub", "Mul", "Div", "FloorDiv", "Mod", "Pow"}, {"Is", "IsNot"}

# What a failing test says where the compiler of C++ or Numba refuses the mutant, which then is none.
NOT_COMPILED = re.compile(
    r"its build failed|numba\.core\.errors\.(Typing|Lowering|Unsupported)Error|nopython mode pipeline"
)
REFUSED = "does not compile"
RULES = ["universal.rules", "c_like.rules", "cpp.rules"]  # of universalmutator

FAILED = re.compile(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", re.M)
TIMED_OUT = re.compile(r"^Timeout \(", re.M)


@dataclass(frozen=True)
class Part:
    """A part of rayrace.

    share: how many of all mutants it gets, relatively. stages: arguments of pytest, in order. limit: of one test, s.
    """

    name: str
    files: tuple[str, ...]
    share: int
    stages: tuple[str, ...]
    marks: str = MARKS
    limit: int = 150


def of_harness() -> Iterator[Part]:
    race = "tests/harness/race/test_mock.py tests/harness/race/test_stopping.py tests/harness/race/test_judging.py"
    yield Part(
        "judge",
        ("harness/judge/*.py",),
        11,
        (
            "tests/harness/judge",
            f"{race} tests/hostile/test_faults_cache.py tests/hostile/test_rays.py",
            "-k 'not numba' tests/conformance/test_masks.py tests/conformance/test_precision.py tests/harness/stress",
            "-k 'not numba' tests/harness/contract tests/harness/single tests/rayrace",
        ),
    )
    reports = " ".join(
        f"tests/reports/{name}"
        for name in ("exporters", "paper", "compare", "run", "scaling", "page/test_report.py", "page/test_trust.py")
    )
    yield Part(
        "statistics",
        ("harness/statistics/statistics.py", "harness/statistics/fit.py"),
        11,
        ("tests/harness/statistics", reports, "tests/reports --ignore=tests/reports/page/test_page_browser.py"),
    )
    yield Part(
        "steady",
        ("harness/statistics/steady.py",),
        11,
        ("tests/harness/statistics", f"tests/harness/race/test_mock.py {reports}"),
    )
    yield Part(
        "store",
        ("harness/store/*.py",),
        11,
        (
            "tests/harness/store",
            f"tests/hostile/test_runs.py tests/rayrace/test_old_run.py {race} tests/harness/plan/test_resume.py",
            f"tests/harness/cluster/test_campaign.py tests/hostile/test_faults_disk.py {reports}",
            "-k 'not numba' tests/rayrace tests/harness/race",
        ),
        marks=ALONE,
    )
    yield Part(
        "measurer",
        ("harness/process/measurer.py",),
        11,
        (
            "tests/harness/process/test_measurer.py",
            "tests/harness/process/test_process.py tests/harness/process/test_family.py",
            "tests/harness/process/test_bad_renderers.py tests/hostile/test_faults_gpu.py",
            "tests/hostile/test_faults_clock.py tests/hostile/test_faults_signals.py tests/harness/process",
        ),
        marks=ALONE,
    )


TELLING = {
    "sphere": (
        "hits",
        "sphere_methods",
        "csg",
        "meshes",
        "renderers/python_robust",
        "stability/spheres",
        "stability/ellipsoids",
    ),
    "mesh": ("meshes", "csg", "stability/cracks", "stability/slivers"),
    "csg": ("csg", "stability/coincident"),
    "shade": ("closed_forms", "media", "samples", "stability/highlight", "stability/refraction"),
}


def _file(name: str) -> str:
    folder, slash, last = name.rpartition("/")
    return f"{folder}{slash}test_{last}.py"


def _source(renderer: str, file: str) -> str:
    """The file of this name of a renderer: in its folder, or in that of shapes or of tracing."""
    places = (f"renderers/{renderer}/{folder}{file}" for folder in ("", "shapes/", "trace/"))
    return next(place for place in places if (ROOT / place).is_file())


def of_renderers() -> Iterator[Part]:
    for renderer in ("python", "numpy", "numba", "cpp"):
        end = "hpp" if renderer == "cpp" else "py"
        only = f"-k '{renderer} and not parallel and not threads and not cuda'"
        for name, telling in TELLING.items():
            names = (name, "ellipsoid") if name == "sphere" else (name,)
            # For C++, tests of methods come last: each method is a program to build.
            files = [file for file in telling if renderer != "cpp" or "/" not in file]
            first = [f"tests/{'' if '/' in file else 'conformance/'}{_file(file)}" for file in files]
            done = ["tests/conformance/test_covering.py", "tests/conformance/test_wild_scenes.py", *first]
            ignored = " ".join(f"--ignore={file}" for file in done)
            simulated = ()
            if renderer == "numba":  # the simulator compiles nothing, so it is quick; `make cudasim` runs all of this
                simulated = ("SIMULATED -k numba-cuda tests/conformance/test_covering.py",)
                if name == "sphere":
                    simulated = ("SIMULATED -k numba-cuda tests/conformance/test_hits.py", *simulated)
            yield Part(
                f"{renderer} {name}",
                tuple(_source(renderer, f"{name}.{end}") for name in names),
                5,
                (
                    *simulated,
                    f"{only} {' '.join(first)}",
                    f"{only} tests/conformance/test_covering.py",
                    "tests/conformance/test_wild_scenes.py",
                    f"{only} tests/conformance tests/stability tests/renderers {ignored}",
                ),
                limit=600 if renderer == "numba" else 150,  # it compiles for up to 100 s
            )


PARTS = (*of_harness(), *of_renderers())


@dataclass(frozen=True)
class Mutant:
    """A change of a file: the lines `before` from number `line` on become the lines `after`."""

    part: str
    file: str
    line: int
    before: tuple[str, ...]
    after: tuple[str, ...]

    @classmethod
    def of(cls, part: str, file: str, source: str, changed: str) -> "Mutant":
        old, new = source.splitlines(keepends=True), changed.splitlines(keepends=True)
        start = next((n for n, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), min(len(old), len(new)))
        while len(old) > start and len(new) > start and old[-1] == new[-1]:
            old.pop(), new.pop()
        start -= len(old) == start  # a line that is new is shown, and found again, by the one before it
        return cls(part, file, start + 1, tuple(old[start:]), tuple(new[start:]))

    @classmethod
    def stored(cls, record: dict) -> "Mutant":
        return cls(record["part"], record["file"], record["line"], tuple(record["before"]), tuple(record["after"]))

    def applied(self, source: str) -> str | None:
        """The text of the file with the change; None if the lines are not there."""
        lines, count = source.splitlines(keepends=True), len(self.before)
        places = [n for n in range(len(lines) - count + 1) if tuple(lines[n : n + count]) == self.before]
        if not places:
            return None
        place = min(places, key=lambda n: abs(n + 1 - self.line))
        return "".join([*lines[:place], *self.after, *lines[place + count :]])

    def __str__(self) -> str:
        told = (" / ".join(line.strip() for line in lines if line.strip()) for lines in (self.before, self.after))
        return f"{self.file}:{self.line}: {' -> '.join(text or 'nothing' for text in told)}"


def essence(source: str) -> str:
    """What of a module can matter: its syntax tree without annotations and without the text of messages."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        for name, nothing in (("annotation", None), ("returns", None)):
            if hasattr(node, name):
                setattr(node, name, nothing)
        if isinstance(node, ast.JoinedStr):
            node.values = []
    return ast.dump(tree)


def in_python(part: str, file: str, source: str, rng: random.Random) -> Iterator[Mutant]:
    """Mutants of a module, in random order, one for each place."""
    from cosmic_ray import plugins
    from cosmic_ray.ast import ast_nodes, get_ast
    from cosmic_ray.mutating import mutate_code

    places, nodes = {}, list(ast_nodes(get_ast(source)))
    for name in sorted(plugins.operator_names()):
        if not _sensible(name):
            continue
        operator = plugins.get_operator(name)()
        found = (place for node in nodes for place in operator.mutation_positions(node))
        for occurrence, place in enumerate(found):
            places.setdefault(place, []).append((operator, occurrence))
    for place in rng.sample(sorted(places), len(places)):
        changed = mutate_code(source, *rng.choice(places[place]))
        with contextlib.suppress(SyntaxError):
            if changed and essence(changed) != essence(source):
                yield Mutant.of(part, file, source, changed)


def _sensible(operator: str) -> bool:
    """Is this operator of cosmic-ray one whose mutants are worth a test?

    `1.5 << 2` is not: any test that runs the line would catch it. Nor is `x is 1`, nor other names for variables.
    """
    kind, *values = operator.rpartition("/")[2].split("_")
    if kind.startswith(("ReplaceBinary", "ReplaceComparison")):
        return all(len({value in group for value in values}) == 1 for group in (ARITHMETIC, IDENTITY))
    return not kind.startswith("Variable") and not {"UAdd", "Invert"} & set(values)


def in_cpp(part: str, file: str, source: str, rng: random.Random) -> Iterator[Mutant]:
    """Mutants of a header, from all its lines alike; most do not compile."""
    from universalmutator import mutator

    lines, by_line = source.splitlines(keepends=True), {}
    with contextlib.redirect_stdout(io.StringIO()):
        found = mutator.mutants_regexp(lines, RULES, ignorePatterns=[r"^\s*(#|//)"], ignoreStringOnly=True)
    for number, line, *_ in found:
        if _code(line) != _code(lines[number - 1]):
            by_line.setdefault(number, []).append(line)
    for _ in range(10):
        for number in rng.sample(sorted(by_line), len(by_line)):
            line = rng.choice(by_line[number])
            yield Mutant.of(part, file, source, "".join([*lines[: number - 1], line, *lines[number:]]))


def _code(line: str) -> str:
    """A line of C++ without comments and spaces."""
    return re.sub(r"/\*.*?\*/|//.*|\s", "", line)


def compiles(header: Path) -> bool:
    words = ["c++", "-std=c++20", "-fsyntax-only", '-DFLAGS=""', header.parent / "main.cpp"]
    return subprocess.run(words, capture_output=True).returncode == 0


def draw(part: Part, seed: str) -> Iterator[Mutant]:
    """The mutants of a part in random order, from all its files alike by their number of places."""
    rng = random.Random(f"{seed} {part.name}")
    files = sorted(str(path.relative_to(COPY)) for pattern in part.files for path in COPY.glob(pattern))
    sources = {file: (COPY / file).read_text("utf-8") for file in files}
    turns = [file for file in files for _ in sources[file].splitlines()]
    found = {
        file: (in_python if file.endswith(".py") else in_cpp)(part.name, file, sources[file], rng) for file in files
    }
    drawn = set()
    for file in rng.sample(turns, len(turns)):
        mutant = next(found[file], None)
        if mutant and mutant not in drawn:
            drawn.add(mutant)
            yield mutant


@dataclass
class Verdict:
    """What became of a mutant. verdict: "caught", "survived", or "none" if a compiler refuses it.

    stages: how many stages of tests it has passed.
    """

    verdict: str
    test: str = ""
    how: str = ""
    seconds: float = 0.0
    stages: int = 0


def write(path: Path, text: str) -> None:
    """Write a source of the copy; what Python compiled of it goes, as a text of the same second may be as long."""
    path.write_text(text, "utf-8")
    if path.suffix == ".py":
        Path(importlib.util.cache_from_source(path)).unlink(missing_ok=True)


def run_tests(stage: str, marks: str, limit: int, seed: str) -> tuple[int, str]:
    """pytest's exit status and output for a stage of tests, in the copy."""
    words = shlex.split(stage)
    environment = {**os.environ, "PYTHONPATH": str(COPY), "RAYRACE_SEED": seed}
    if words[0] == "SIMULATED":
        environment["RAYRACE_CUDASIM"] = "1"
        words.pop(0)
    limits = ["-o", f"faulthandler_timeout={limit}", "-o", "faulthandler_exit_on_timeout=true"]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-rfE", "--tb=short", "-m", marks, *limits, *words]
    with tempfile.TemporaryFile("w+", errors="replace") as output:
        process = subprocess.Popen(
            command,
            cwd=COPY,
            env=environment,
            stdout=output,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
            preexec_fn=_begin,
        )
        try:
            status = process.wait(STAGE_S)
        except subprocess.TimeoutExpired:
            status = -signal.SIGKILL
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        output.seek(0)
        return status, output.read()


def _begin() -> None:
    """What the tests' process is given: a limit of memory, and Ctrl-C, to which a process in the background is deaf."""
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, resource.getrlimit(resource.RLIMIT_DATA)[1]))
    signal.signal(signal.SIGINT, signal.default_int_handler)


def judge(mutant: Mutant, part: Part, seed: str, passed: int, most: int) -> Verdict:
    """Apply a mutant to the copy, run the tests of its part until one fails, and take it back.

    passed: how many stages it passed before. most: the number of stages, from the first on, that are run at most.
    """
    path = COPY / mutant.file
    source, begun = path.read_text("utf-8"), time.monotonic()
    changed = mutant.applied(source)
    if changed is None:
        return Verdict("none", how="its lines are not there any more")
    try:
        write(path, changed)
        if path.suffix == ".hpp" and not compiles(path):
            return Verdict("none", how=REFUSED)
        for number, stage in enumerate(part.stages[:most]):
            if number < passed:
                continue
            status, output = run_tests(stage, part.marks, part.limit, seed)
            if status in (0, 5):  # 5: the stage has no test of this renderer
                continue
            if NOT_COMPILED.search(output):
                return Verdict("none", how=REFUSED)
            test = next(iter(FAILED.findall(output)), f"no test starts (pytest ends with {status})")
            how = "too long" if TIMED_OUT.search(output) or status < 0 else "failed"
            return Verdict("caught", test, how, time.monotonic() - begun, number)
        return Verdict("survived", seconds=time.monotonic() - begun, stages=min(most, len(part.stages)))
    finally:
        write(path, source)


def clone() -> str:
    """Brings the copy to the last commit of the checkout; returns the commit."""
    commit = _git(ROOT, "rev-parse", "--short=12", "HEAD")
    if _git(ROOT, "status", "--porcelain", "--untracked-files=no"):
        print("changes that are not committed take no part")
    if not COPY.exists():
        _git(ROOT, "clone", "-q", "--no-checkout", str(ROOT), str(COPY))
    _git(COPY, "fetch", "-q", str(ROOT), "HEAD")
    _git(COPY, "checkout", "-q", "--force", "--detach", commit)
    if (ROOT / PACKED).exists():
        shutil.copy(ROOT / PACKED, COPY / PACKED)
    return commit


def _git(folder: Path, *words: str) -> str:
    return subprocess.run(["git", *words], cwd=folder, check=True, capture_output=True, text=True).stdout.strip()


def wanted(part: Part, count: int) -> int:
    """How many of `count` mutants a part gets."""
    return round(count * part.share / sum(other.share for other in PARTS))


def read(path: Path) -> list[dict]:
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()] if path.exists() else []


def run(parts: list[Part], seed: str, count: int, commit: str, most: int, again: Path | None) -> list[dict]:
    """Judges the mutants of `parts`, or the survivors of an earlier file `again`; the records, those of before too."""
    path = RESULTS / f"{commit}-{seed}.jsonl"
    path.parent.mkdir(parents=True, exist_ok=True)
    records = {Mutant.stored(record): record for record in read(path)}  # the last of a mutant counts
    for part in parts:
        if again:
            earlier = [r for r in read(again) if r["part"] == part.name and r["verdict"] == "survived"]
            mutants, left = map(Mutant.stored, earlier), len(earlier)
        else:
            mutants, left = draw(part, seed), wanted(part, count)
        for mutant in mutants:
            if left <= 0:
                break
            record = records.get(mutant, {"verdict": "survived", "stages": 0})
            if record["verdict"] == "survived" and record["stages"] < min(most, len(part.stages)):
                verdict = judge(mutant, part, seed, record["stages"], most)
                record = {**asdict(mutant), **asdict(verdict), "commit": commit, "seed": seed}
                record = records[mutant] = json.loads(json.dumps(record))
                with open(path, "a", encoding="utf-8") as file:
                    file.write(json.dumps(record) + "\n")
                if verdict.verdict != "none":
                    print(f"{verdict.seconds:5.0f} s {verdict.verdict:8} {mutant} {verdict.test}", flush=True)
            left -= record["verdict"] != "none"
    return list(records.values())


def control(records: list[dict], seed: str) -> str | None:
    """None, or how the tests that caught a mutant fail without one."""
    for simulated in (False, True):
        tests = {r["test"] for r in records if r["verdict"] == "caught" and ("numba-cuda" in r["test"]) == simulated}
        with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
            file.write("".join(f"{test}\n" for test in sorted(tests) if "::" in test))
            file.flush()
            if file.tell():
                status, output = run_tests(f"{'SIMULATED' * simulated} @{file.name}", ALONE, STAGE_S, seed)
                print(output.splitlines()[-1])
                if status:
                    return output[-3000:]
    return None


def table(records: list[dict]) -> str:
    """Markdown: how many of each part were caught, and all mutants."""
    lines = ["| part | mutants | caught | by |", "| --- | ---: | ---: | --- |"]
    for part in PARTS:
        mine = [r for r in records if r["part"] == part.name and r["verdict"] != "none"]
        caught = [r for r in mine if r["verdict"] == "caught"]
        by = Counter(r["test"].partition("::")[0].rpartition("/")[2] for r in caught)
        told = ", ".join(f"{name} {number}" for name, number in by.most_common())
        lines.append(f"| {part.name} | {len(mine)} | {len(caught)} | {told} |")
    lines += ["", "| part | change | result |", "| --- | --- | --- |"]
    for r in records:
        if r["verdict"] != "none":
            result = f"{r['how']}: {r['test']}" if r["verdict"] == "caught" else "survived"
            change = str(Mutant.stored(r)).replace("|", "\\|")
            lines.append(f"| {r['part']} | `{change}` | {result} |")
    return "\n".join(lines) + "\n"


def broken(parts: list[Part], seed: str) -> bool:
    """Breaks each file of the parts as a whole, and tells which stages of tests notice: each should."""
    missed = []
    for part in parts:
        for file in (str(path.relative_to(COPY)) for pattern in part.files for path in COPY.glob(pattern)):
            path = COPY / file
            source = path.read_text("utf-8")
            if not source.strip() or path.name == "__init__.py":
                continue
            wrong = "\nraise RuntimeError('broken')\n"
            if path.suffix == ".hpp":
                wrong = "\n#include <cstdlib>\nstatic const int broken = (std::abort(), 0);\n"
            try:
                write(path, source + wrong)
                for stage in part.stages:
                    noticed = run_tests(stage, part.marks, part.limit, seed)[0] not in (0, 5)
                    print(f"{'noticed' if noticed else 'MISSED':8} {file}: {stage}", flush=True)
                    missed += [] if noticed else [(file, stage)]
            finally:
                write(path, source)
    return not missed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=135, help="how many mutants, of all parts together")
    parser.add_argument("--seed", default=secrets.token_hex(4), help="by which they are drawn; also RAYRACE_SEED")
    parser.add_argument("--part", default="", help="only parts whose name matches this regular expression")
    parser.add_argument("--stages", type=int, default=9, help="only the first stages of tests; survivors go on later")
    parser.add_argument("--again", type=Path, help="FILE.jsonl of an earlier commit: only its survivors")
    parser.add_argument("--broken", action="store_true", help="break each file as a whole, and see all tests notice")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that what it began ends with it
    parts = [part for part in PARTS if re.search(options.part, part.name)]
    commit = clone()
    print(f"commit {commit}, seed {options.seed}, in {COPY}", flush=True)
    if options.broken:
        return not broken(parts, options.seed)
    records = run(parts, options.seed, options.count, commit, options.stages, options.again)
    path = RESULTS / f"{commit}-{options.seed}.md"
    path.write_text(table(records), "utf-8")
    wrong = control(records, options.seed)
    print(f"the tests that caught mutants fail without one:\n{wrong}" if wrong else f"table: {path}")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
