"""The contract test: does a renderer keep to renderers/README.md and SPEC.md? For any author to run."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path

import numpy as np

from harness.contract.check_scenes import FURTHER, full_parameters, full_scene_text, scene_text
from harness.errors import UserError
from harness.judge import bound, judge, reference
from harness.process import repetition
from harness.process.scratch import scratch
from harness.process.session import Sessions
from harness.race import contradiction, frames, row
from harness.renderer import methods, places, registry
from harness.renderer.builder import BuildError
from harness.renderer.manifest import load
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry, Renderer
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import SHAPES
from harness.scene.needs import needs as needs_of
from harness.store.record import UNCHECKED, percentage
from harness.system import trouble

SIZE = 16
LARGE = 64
TIMEOUT = 120.0  # s
SIMULATED_TIMEOUT = 1800.0
LEAST_FRAME = 0.02  # s
METHODS = tuple(name for name in methods.changing(methods.ROUNDING) if name != "vector")  # which has checks of its own
CUTOFF = 0.5  # above what a second reflection of the check's scene weighs, 0.36 at most
ROUNDING = 1e-12
HIT_TOLERANCE = {"float64": 1e-11, "float32": 1e-3}  # of t, point and normal in general position, relative


@dataclass(frozen=True)
class Check:
    what: str
    passed: bool
    detail: str = ""


def examine(path: Path) -> Iterator[Check]:
    """Check the renderer in the folder `path`, all variants; yields each check as it ends."""
    try:
        renderer = Renderer(Path(path).resolve(), load(Path(path)))
    except UserError as error:
        yield Check("renderer.toml", False, str(error))
        return
    yield Check("renderer.toml", True)
    if renderer.unavailable:
        yield Check("available here", False, renderer.unavailable)
        return
    if renderer.manifest.build:
        try:
            built = renderer.build()
        except BuildError as error:
            yield Check("build", False, str(error))
            return
        yield Check("build", True, f"{built.seconds:.2f} s" + (" (from the cache)" if built.cached else ""))
    entries = [Entry(renderer, variant) for variant in renderer.manifest.variant]
    some_run = any(not (entry.variant.exhibit or entry.unavailable) for entry in entries)
    for entry in entries:
        if entry.variant.exhibit:
            yield Check(f"{entry.name}: an exhibit", True, f"not checked: {entry.variant.exhibit}")
            continue
        if entry.unavailable:
            yield Check(f"{entry.name}: available here", some_run, f"not checked: {entry.unavailable}")
            continue
        with scratch() as cache, Sessions() as sessions:
            for check in Examination(entry, cache, sessions).checks():
                yield replace(check, what=f"{entry.name}: {check.what}")


def _told(verdict: judge.Verdict) -> str:
    """How far off a right picture is, and how much of it is judged less strictly, if that is much."""
    off = "every pixel is in the mask" if verdict.max_outside is None else f"{verdict.max_outside:.1e}"
    if verdict.mask_fraction <= judge.LARGE_MASK:
        return off
    return f"{off}; {percentage(verdict.mask_fraction)} of the picture is ill-conditioned, and judged as a whole"


class Examination:
    """The checks of one variant. sessions: run its jobs, but those of which the process itself is looked at."""

    def __init__(self, entry: Entry, cache: Path, sessions: Sessions):
        self.entry, self.cache, self.sessions = entry, cache, sessions
        self.features = entry.renderer.manifest.features
        self.timeout = SIMULATED_TIMEOUT if entry.simulated else TIMEOUT
        depth = 3 if "reflection" in self.features else 0
        shadows = "shadows" in self.features
        scene = text.read(scene_text(self.features), "the check's scene")
        self.arrays = flatten(scene)
        precision = entry.methods.get("precision", ("float64",))[0]
        self.parameters = Parameters(
            width=SIZE, height=SIZE + 2, depth=depth, shadows=shadows, frames=2, precision=precision
        )
        self.needs = needs_of(scene, self.parameters)

    def run(self, parameters=None, needs=None, arrays=None, alone=False) -> repetition.Result:
        start = repetition.start if alone else self.sessions.start
        return start(
            self.entry, self.arrays if arrays is None else arrays, parameters or self.parameters,
            self.needs if needs is None else needs, timeout=self.timeout, cache=self.cache,
        )  # fmt: skip

    def checks(self) -> Iterator[Check]:
        first = self.run(alone=True)
        yield self._ended("a picture of all that it claims", first)
        if first.status != "ok":
            return
        second = self.run(alone=True)
        same = second.status == "ok" and np.array_equal(first.array, second.array)
        yield Check("the same job again gives the same bytes", same)
        if self.entry.renderer.manifest.jobs:
            yield self._list(first)
        yield from self._judged(first)
        if set(self.features) & FURTHER:
            yield from self._further()
        yield self._phases(second)
        yield self._frames("a later frame is the picture of its place", first, self.parameters)
        yield from self._batches(first)
        yield self._marks()
        if self.entry.variant.threads == "all":
            both = [self.run(replace(self.parameters, threads=n)) for n in (1, 2, 3)]
            same = all(r.status == "ok" and np.array_equal(r.array, first.array) for r in both)
            yield Check("1, 2 and 3 threads give the same bytes", same)
        if self.entry.variant.device != "cpu":
            yield self._blocks(first)
        if "region" in self.features:
            region = self.run(replace(self.parameters, region=(3, 5, 10, 13)))
            same = region.status == "ok" and np.array_equal(region.array, first.array[5:13, 3:10])
            yield Check("a region has the pixels of the whole", same, region.reason)
        for precision in self.entry.methods.get("precision", ("float64",))[1:]:
            other = replace(self.parameters, precision=precision, frames=0)
            yield from self._judged(self.run(other), other)
        yield from self._methods()
        if {"cutoff", "reflection"} <= set(self.features):
            yield self._cut_off(first)
        if "rays" in self.features:
            yield self._rays()
        yield self._refuses()
        broken = self.run(arrays={k: v for k, v in self.arrays.items() if k != "camera"})
        yield Check("a job without its camera fails, with a reason", broken.status == "failed", broken.reason)

    def _list(self, first: repetition.Result) -> Check:
        """Each job of a list, a refused one among them, has the result that it has alone."""
        what = "a list of jobs gives the same bytes"
        with Sessions() as sessions:
            session, results = None, []
            for needs in (self.needs, (*self.needs, "no-such-feature"), self.needs):
                job = self.entry, self.arrays, self.parameters, needs
                results.append(sessions.start(*job, timeout=self.timeout, cache=self.cache))
                if not sessions.kept:
                    return Check(what, False, f"its process ended after job {len(results)}; it must read the next one")
                session = session or next(iter(sessions.kept))
            if [*sessions.kept] != [session]:
                return Check(what, False, "it puts off a job that is like the first one")
        statuses = [result.status for result in results]
        if statuses != ["ok", "unsupported", "ok"]:
            return Check(what, False, f"ok, refused and ok ended as {', '.join(statuses)}: {results[-1].reason}")
        same = all(np.array_equal(result.array, first.array) for result in (results[0], results[2]))
        return Check(what, same)

    def _methods(self) -> Iterator[Check]:
        """Pictures of its other methods, several at a time: each picture may cost a compilation."""
        others = {name: self.entry.methods.get(name, ())[1:] for name in METHODS}
        for values in zip_longest(*others.values()):
            chosen = {name: value for name, value in zip(others, values, strict=True) if value}
            wanted = replace(self.parameters, **chosen, frames=0)
            what = ", ".join(f"{name} {value}" for name, value in chosen.items())
            yield from self._judged(self.run(wanted), wanted, what=f"{what} agrees with another renderer")

    def _further(self) -> Iterator[Check]:
        """One picture of everything else that it claims, and one with adaptive samples."""
        folder = self.cache / "meshes"
        folder.mkdir(exist_ok=True)
        scene = text.read(full_scene_text(self.features, folder), "the check's scene")
        parameters = full_parameters(self.features, self.parameters)
        jobs = [("agrees on all the optics, solids and samples it claims", parameters)]
        if "adaptive" in self.features:
            jobs.append(("agrees on adaptive samples", replace(parameters, sampler="adaptive", adaptive_depth=2)))
        for what, wanted in jobs:
            wanted = replace(wanted, frames=0)
            job = wanted, needs_of(scene, wanted), flatten(scene)
            yield from self._judged(self.run(*job), *job, what)

    def _ended(self, what: str, result: repetition.Result) -> Check:
        if result.status != "ok":
            return Check(what, False, f"{result.status}: {result.reason}")
        if not np.isfinite(result.array).all():
            return Check(what, False, "pixels that are not finite")
        return Check(what, True)

    def _judged(self, result, parameters=None, needs=None, arrays=None, what="") -> Iterator[Check]:
        """Judge the picture of a job, by default of the plain one."""
        parameters, needs, arrays = parameters or self.parameters, needs or self.needs, arrays or self.arrays
        external = self.entry.renderer.manifest.external
        what = what or f"agrees with another renderer in {parameters.precision}"
        if external and result.status == "unsupported":  # it refuses what its program does otherwise
            yield Check(what, True, f"not checked: it refuses the job: {result.reason}")
            return
        if result.status != "ok":
            yield Check(what, False, f"{result.status}: {result.reason}")
            return
        maker = self._other(parameters, needs)
        if maker is None:
            yield Check(what, True, "not checked: no other renderer here can make this picture")
            return
        standard = reference.make(maker, arrays, parameters, needs, self.cache / "reference", self.sessions.run)
        if isinstance(standard, reference.NoReference):
            yield Check(what, False, standard.reason)
            return
        verdict = judge.judge(result.array, standard, parameters.precision, external)
        yield Check(f"{what} ({standard.maker})", verdict.wrong is None, verdict.wrong or _told(verdict))
        if parameters.precision == "float64" and not external:
            wrong = judge.compare_rays(result.said.rays, standard.rays, parameters.precision)
            note = "" if result.said.rays else "unavailable: it does not count them"
            yield Check("counts the rays of SPEC.md", wrong is None, wrong or note)

    def _other(self, parameters: Parameters, needs: tuple[str, ...]) -> Entry | None:
        # The plainest first: for so small a picture it is also the quickest, having nothing to compile.
        return reference.choose(self.entry, registry.entries(), parameters, needs, reference.JUDGES[::-1])

    def _blocks(self, first: repetition.Result) -> Check:
        """Neither the threads of a GPU nor where it keeps the scene may change the picture."""
        memories = self.entry.methods.get("scene_memory", ("auto",))
        others = [{"scene_memory": name} for name in memories[1:]]
        others += [{"block_width": 8, "block_height": 4, "total_threads": 64}, {"block_width": 1, "max_registers": 64}]
        for other in others:
            result = self.run(replace(self.parameters, **other, frames=0))
            if result.status != "ok" or not np.array_equal(result.array, first.array):
                return Check("other blocks and memories give the same bytes", False, f"{other}: {result.reason}")
        return Check("other blocks and memories give the same bytes", True)

    def _cut_off(self, first: repetition.Result) -> Check:
        """No pixel may be further from the picture without a cut-off than what was dropped allows (CUT-3)."""
        what = "a cut-off keeps to its bound, and saves rays"
        result = self.run(replace(self.parameters, cutoff=CUTOFF, frames=0), (*self.needs, "cutoff"))
        if result.status != "ok":
            return Check(what, False, f"{result.status}: {result.reason}")
        off = np.abs(result.array.astype(np.float64) - first.array).max(axis=-1)
        limit = bound.bound(self.arrays, self.parameters.depth, result.dropped)
        beyond = int(np.count_nonzero(~(off <= limit + ROUNDING)))
        if beyond:
            return Check(what, False, f"{beyond} pixels beyond it, the worst off by {off.max():.2g}")
        if result.said.rays and result.said.rays["reflected"] >= first.said.rays["reflected"]:
            return Check(what, False, f"as many rays as without: {result.said.rays['reflected']} reflected")
        return Check(what, True, f"off by {off.max():.2g} at most, allowed {limit.max():.2g}")

    def _phases(self, result: repetition.Result) -> Check:
        if result.status != "ok":
            return Check("phases cover its life", False, result.reason)
        phases = row.cover(result.said, result.outcome.spawned, result.outcome.exited)
        missing = 1 - sum(end - start for _, start, end in phases) / result.outcome.wall_s
        detail = f"{percentage(missing)} of the wall time is in no phase"
        return Check("phases cover its life", abs(missing) <= row.PHASE_TOLERANCE, detail)

    def _frames(self, what: str, result: repetition.Result, parameters: Parameters) -> Check:
        """Name a later frame of a job that has ended, and have its picture made again (FRM-1, FRM-2)."""
        if reason := frames.unchecked(self.entry, parameters):
            return Check(what, True, reason)
        if result.status != "ok":
            return Check(what, False, result.reason)

        def fault(job: Parameters, alone: repetition.Result, picture: np.ndarray) -> str | None:
            maker, cache = self._other(job, self.needs), self.cache / "reference"
            how = self.entry, self.arrays, self.needs, maker, cache, self.sessions.run
            return frames.fault(job, alone, picture, *how)

        choice = frames.choose(result, parameters)
        wrong = frames.verdict(choice, result, parameters, lambda job: self.run(job, alone=True), fault)
        return Check(what, wrong is None or wrong.startswith(UNCHECKED), wrong or "")

    def _batches(self, first: repetition.Result) -> Iterator[Check]:
        """`least_frame` may be left alone. Else batches last so long, and what is told of one is of one render."""
        wanted = replace(self.parameters, least_frame=LEAST_FRAME)
        result = self.run(wanted, alone=True)
        yield self._batch(first, result)
        if result.status == "ok" and repetition.is_checked(self.entry, wanted) and result.said.frames[1]["renders"] > 1:
            yield self._frames("a render of a batch is the picture of its place", result, wanted)

    def _batch(self, first: repetition.Result, result: repetition.Result) -> Check:
        what = "a frame is one render, or a batch that lasts"
        if result.status != "ok":
            return Check(what, False, result.reason)
        _, *more = (frame["renders"] for frame in result.said.frames)
        longest = max(frame["end"] - frame["start"] for frame in result.said.frames)
        most = places.MOST_RENDERS if repetition.is_checked(self.entry, self.parameters) else math.inf
        if (
            more[0] > 1 and 2 * more[0] <= most and longest < LEAST_FRAME / 2
        ):  # half: a machine may get faster meanwhile
            wrong = f"{more[0]} renders last {longest:.2g} s, expected {LEAST_FRAME:g} s"
        elif not np.array_equal(result.array, first.array, equal_nan=True):
            wrong = "a batch makes another picture"
        elif result.said.rays != first.said.rays:
            wrong = f"counts {result.said.rays}, of one render {first.said.rays}"
        else:
            return Check(what, True, "single" if more[0] == 1 else f"{more[0]} renders in {longest:.2g} s")
        return Check(what, False, wrong)

    def _marks(self) -> Check:
        """Its frames must be where the time goes, of a picture that takes some."""
        what = "its marks agree with its phases and the processor"
        if self.entry.simulated:
            return Check(what, True, f"not checked: {row.SIMULATED}")
        wanted, series = replace(self.parameters, width=LARGE, height=LARGE), self.cache / "marks.csv"

        def run(parameters, **more):
            job = self.entry, self.arrays, parameters, self.needs
            return repetition.start(*job, timeout=self.timeout, cache=self.cache, **more)

        before = trouble.look()
        result = run(wanted, series=series)
        if result.status != "ok":
            return Check(what, False, result.reason)
        disturbed, blanks = trouble.between(before, trouble.look()), contradiction.Blanks()
        wrong = contradiction.reason(result, series, self.entry, wanted, blanks, run, disturbed=disturbed)
        return Check(what, wrong is None, wrong or "")

    def _rays(self) -> Check:
        what = "rays: first hits agree with another renderer"
        rng = np.random.default_rng(11)
        origins, targets = rng.normal(0, 4, (200, 3)), rng.normal(0, 0.7, (200, 3))
        arrays = {**self.arrays, "rays": np.hstack([origins, targets - origins])}
        parameters = Parameters(kind="rays", precision=self.parameters.precision)
        needs = tuple(n for n in self.needs if n in SHAPES.values())
        result = self.run(parameters, needs, arrays)
        maker = self._other(parameters, needs)
        if result.status != "ok" or maker is None:
            return Check(what, result.status == "ok", result.reason or "not checked: no other renderer here")
        expected = repetition.run(maker, arrays, reference.for_any_scene(maker, reference.job_of(parameters)), needs)
        if result.array.shape != expected.array.shape:
            return Check(what, False, f"shape {result.array.shape}, expected {expected.array.shape}")
        hit = np.isfinite(expected.array[:, 0])
        if not np.array_equal(hit, np.isfinite(result.array[:, 0])):
            return Check(what, False, "another set of rays hits")
        off = np.abs(result.array[hit] - expected.array[hit]) / np.maximum(1, np.abs(expected.array[hit]))
        limit = HIT_TOLERANCE[parameters.precision]
        return Check(what, bool(off.max(initial=0) <= limit), f"largest difference {off.max(initial=0):.1e}")

    def _refuses(self) -> Check:
        result = self.run(needs=(*self.needs, "no-such-feature"))
        return Check(
            "refuses a feature it does not know, with exit status 3", result.status == "unsupported", result.reason
        )
