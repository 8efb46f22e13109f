"""Finds the quickest method whose error is within a limit, by measuring methods on tiles of the very picture.

What a method leaves out is measured apart, with equal samples: of the depth and the cut-off, and of the precision and
the lanes; what its samples miss, against the truth of the tiles. The squares add up to a forecast for every combination
and number of samples. The quickest that should hold is then measured itself, and corrects the forecast of its family.
"""

import contextlib
import threading
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from harness.choice.trial import KNOWN, Method, TimeUp, Trial, tiles
from harness.errors import UserError
from harness.judge import truth
from harness.process import repetition
from harness.renderer.builder import BuildError
from harness.renderer.parameters import NAMES, Parameters, side
from harness.renderer.registry import Entry
from harness.single.single import FASTEST, general

# Samples of a side of a pixel.
SIDES = (*range(1, 11), *range(12, 25, 2), 28, 32, 36, 40, 48, 56, 64)
FIRST = 2, 4  # of them the first two to measure
ADAPTIVE = ((2, 0.1), (2, 0.03), (3, 0.1), (3, 0.03), (3, 0.01), (4, 0.01))  # depth, threshold
DEPTHS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
CUTOFFS = tuple(2.0**-power for power in (4, 6, 8, 10))
PRECISIONS = "float64", "float32"
RANDOM = "sobol", "jittered"  # samplers whose places are drawn
VECTORS = "auto", "off"  # the first that a renderer has: `auto` is the quicker of `on` and `off` (VEC-4)
SURE = 2  # standard errors that a method must be within the limit
MOST, ENOUGH = 10, 5  # methods of a forecast that are measured for one choice; if one of the first ones holds
PAYS = 0.9  # of the time of the best so far a method must take less, to be measured
MANY = 1000  # pixels
BRIEF = 0.1  # s of a frame that is timed twice
WORTH = 1.0  # s that a picture must take for a program of its own in lanes, which takes some ten times less
LONG = 5.0  # s that a picture must take for other variants to be measured
DEFAULT = Parameters()


@dataclass
class Family:
    """Methods that differ in the number of samples, the paths of light and the arithmetic alone.

    sides: each n that there may be of n x n samples a pixel. measured: by number, with the paths and arithmetic of
    the base. worse: what was measured of others, over what was forecast.
    """

    changes: dict
    sides: tuple[int, ...]
    given: bool = False  # is the number of samples the user's?
    measured: dict[int, Method] = field(default_factory=dict)
    worse: float = 1.0
    whole: bool = False  # of adaptive samples, whose paths are not the base's

    def of(self, n: int) -> dict:
        """Returns the changes of a job with n x n samples a pixel."""
        fixed = self.given or self.whole or self.changes["sampler"] == "one"
        return self.changes if fixed else {**self.changes, **side(self.changes["sampler"], n)}

    def forecast(self, n: int) -> tuple[float, float, float]:
        """RMSE, its standard error over it, and seconds for n x n samples a pixel."""
        sides = sorted(self.measured)
        previous, last = self.measured[sides[-2 if len(sides) > 1 else -1]], self.measured[sides[-1]]
        if n in self.measured:
            method = self.measured[n]
            error, seconds = method.rmse, method.seconds
        elif len(sides) == 1:
            error, seconds = last.rmse * sides[-1] / max(n, 1), last.seconds * (n / sides[-1]) ** 2
        elif n < sides[-1]:
            logs = [np.log(max(self.measured[number].rmse, 1e-300)) for number in sides]
            error = float(np.exp(np.interp(np.log(n), np.log(sides), logs)))
            seconds = float(np.interp(n**2, np.square(sides), [self.measured[number].seconds for number in sides]))
        else:
            slope = np.log(max(last.rmse, 1e-300) / max(previous.rmse, 1e-300)) / np.log(sides[-1] / sides[-2])
            error = last.rmse * (n / sides[-1]) ** float(np.clip(slope, -2.0, 0.0))
            seconds = last.seconds * (n / sides[-1]) ** 2
        return error, last.standard_error / last.rmse if last.rmse else 0.0, seconds


@dataclass(frozen=True)
class Part:
    """Changes of a job: by what RMS they change the picture, and their time over the base's."""

    changes: dict
    bias: float
    ratio: float


def _worth(family: Family) -> float:
    """How good its samples are, for their number. Of families with the same first number."""
    return -family.measured[max(family.measured)].rmse if family.changes["sampler"] != "one" else -np.inf


class Search:
    """The measured methods of a picture, and the forecast of the others.

    fixed: names of parameters that are the user's; variant: likewise, or "". whole: all pixels, no tiles.
    UserError if no variant can make the picture; CannotTell and TimeUp of trial.py.
    """

    def __init__(self, trial: Trial, variant: str, fixed: frozenset[str], whole: bool = False):
        self.trial, self.variant, self.fixed = trial, variant, fixed
        self.tried: dict[tuple[str, Parameters], Method] = {}
        self.pictures: dict[Parameters, tuple[np.ndarray, int | None]] = {}
        self.parameters = trial.parameters
        self.places = [self.parameters.bounds()] if whole else tiles(self.parameters.bounds(), self.parameters.seed)
        self.miss = 1.0  # how much larger errors are in the whole picture than in the tiles
        building = self._build_ahead()
        # The noise of this truth is taken off; what it leaves uncertain is in the margin of a method, and is little
        # where there are many pixels.
        many = np.prod(self.parameters.shape()[:2]) >= MANY
        self.truth, self.side = trial.truth(self.places, 4, 2**15 if whole else 1, 1.0 if many else KNOWN)
        if building:
            building.join()  # what is timed from here on has the cores to itself
        self.deep = {"depth": self.truth.depth, "cutoff": self.truth.cutoff}
        self.entry, self.base = self._base(variant)
        self.hard = self._hard()
        self.families: list[Family] = []
        self.paths = self.arithmetic = [Part({}, 0.0, 1.0)]
        self.ready, self.shallow = False, self.truth.depth

    def side_for(self, uncertainty: float) -> int:
        """Samples of a side of a pixel in each picture of a truth that is to be known so well, by that of the tiles."""
        of_tiles = self.truth.uncertainty or 0.0
        return int(np.ceil(self.side * max(1.0, of_tiles / uncertainty) ** (2 / 3)))

    def free(self, **changes) -> dict | None:
        """`changes` without those of parameters that are the user's; None if one of these is another there."""
        if any(changes[name] != getattr(self.parameters, name) for name in self.fixed & changes.keys()):
            return None
        return changes

    def job(self, seconds: float = 0.0, **changes) -> Parameters:
        """The job with changes of the base. seconds: that its picture should take. The program for any job is built
        once, one for this job alone would take longer than most pictures, but for those of one sample in lanes (VEC-1).
        """
        made = replace(self.parameters, **{**self.base, **changes})
        alone = "kernel" in self.fixed or (made.vector != "off" and made.sampler == "one" and seconds > WORTH)
        return made if alone else general(self.entry, made)

    def measure(self, parameters: Parameters, entry: Entry | None = None, seconds: float = 0.0) -> Method | None:
        """The method as measured on the tiles; None if it cannot make them. seconds: forecast for the whole picture."""
        entry = entry or self.entry
        key = entry.name, replace(parameters, kernel=DEFAULT.kernel)
        if key not in self.tried:
            self.tried[key] = None
            if shot := self.trial.shoot(entry, parameters, self.places, int(seconds < BRIEF)):
                array, seconds, rays = shot
                self.pictures[key[1]] = array, rays
                error = self.trial.error(array, self.truth, self.places, self.hard)
                self.tried[key] = Method(entry, parameters, error["rmse"], error["rmse_standard_error"], seconds)
        return self.tried[key]

    @property
    def measured(self) -> list[Method]:
        """Those that have all that is the user's."""
        names = self.fixed & set(NAMES)
        return [
            method
            for method in self.tried.values()
            if method and all(getattr(method.parameters, name) == getattr(self.parameters, name) for name in names)
        ]

    def _base(self, variant: str) -> tuple[Entry, dict]:
        """Choose the variant, and changes of the job for every method, which leave out as little as possible."""
        entries, reasons = self.trial.entries, []
        for name in [variant] if variant else [name for name in FASTEST if name in entries]:
            entry = entries[name]
            samplers = self._samplers() or [{"sampler": "sobol", **side("sobol", FIRST[1])}]  # to measure the rest with
            for vector, precision, sampler, optics, cutoff in product(
                VECTORS, PRECISIONS, samplers, self._optics(), (self.truth.cutoff, 0.0)
            ):
                arithmetic = {"precision": precision, "vector": vector}
                changes = {**self.own({**self.deep, "cutoff": cutoff, **arithmetic, **optics}), **sampler}
                made = general(entry, replace(self.parameters, **changes))
                why = entry.unavailable or repetition.unsupported(entry, made, self.trial.needs_of(made))
                if why is None:
                    return entry, changes
                reasons.append(f"{name}: {why}")
        raise UserError("no renderer can do this job: " + "; ".join(dict.fromkeys(reasons)))

    def _build_ahead(self) -> threading.Thread | None:
        """Begins to build the program of float32, on another core than the one that builds that of the truth."""
        names = [self.variant] if self.variant else [name for name in FASTEST if name in self.trial.entries]
        entry = next((self.trial.entries[name] for name in names if not self.trial.entries[name].unavailable), None)
        if entry is None or not entry.renderer.manifest.build or "precision" in self.fixed:
            return None
        vectors = [vector for vector in VECTORS if vector in entry.methods.get("vector", ("off",))]
        job = general(entry, replace(self.parameters, precision=PRECISIONS[1], **self.own({"vector": vectors[0]})))

        def build() -> None:
            with contextlib.suppress(BuildError, OSError):  # who needs it tries again, and tells
                entry.renderer.build(job, self.trial.needs_of(job))

        building = threading.Thread(target=build, daemon=True)
        building.start()
        return building

    def _hard(self) -> np.ndarray | None:
        """Where samples of the whole picture differ from each other, as trial.error takes it."""
        if len(self.places) == 1 or self.base["sampler"] not in RANDOM:
            return None
        job, seed = replace(self.job(), **side(self.base["sampler"], FIRST[0])), self.parameters.seed
        shots = [
            self.trial.shoot(self.entry, replace(job, seed=next_seed), [self.parameters.bounds()], 0)
            for next_seed in ((seed + 1) % 2**32, (seed + 2) % 2**32)
        ]
        return (shots[0][0] - shots[1][0]) ** 2 if all(shots) else None

    def own(self, changes: dict) -> dict:
        """`changes`, with the user's values where they are fixed."""
        return {
            name: getattr(self.parameters, name) if name in self.fixed else value for name, value in changes.items()
        }

    def _samplers(self) -> list[dict]:
        """Samplers that may be taken, with a first number of samples."""
        numbers = {"sobol": "spp", "jittered": "samples", "uniform": "samples"}
        if "sampler" not in self.fixed:  # a number that the user gives says of which it is
            numbers = {name: key for name, key in numbers.items() if key in self.fixed} or numbers
        wanted = [
            {"sampler": name, **({key: getattr(self.parameters, key)} if key in self.fixed else side(name, FIRST[1]))}
            for name, key in numbers.items()
        ]
        wanted.append({"sampler": "one", "samples": 1, "spp": 1})
        if self.trial.against == "centres":
            wanted = wanted[-1:]
        return [sampler for sampler in wanted if self.free(**sampler) is not None]

    def _optics(self) -> list[dict]:
        """Feelers and glossy rays that may be taken, those of the truth first."""
        if self.trial.against == "centres":
            return [{}]
        most = replace(self.parameters, feelers=1, glossy_rays=1, sampler="sobol", **self.deep)
        needs = self.trial.needs_of(most)
        feelers, glossy = ((1, 0) if need in needs else (0,) for need in ("soft", "glossy"))
        optics = [{"feelers": f, "glossy_rays": g} for g, f in product(glossy, feelers)]
        optics += [{"feelers": 4, "glossy_rays": glossy[0]}] * feelers[0]
        return list({repr(changes): changes for changes in map(self.own, optics)}.values())

    def _families(self) -> None:
        families = self.families
        samplers, first = self._samplers(), self._optics()[0]
        for optics, sampler in product(self._optics(), samplers):
            single = sampler["sampler"] == "one"
            if sampler["sampler"] == "jittered" and any(family.changes["sampler"] == "sobol" for family in families):
                continue  # those of a sequence are as good or better (docs/speed-and-accuracy.md)
            if optics != first and not single and sampler["sampler"] != max(families, key=_worth).changes["sampler"]:
                continue  # of several samplers the best one is enough
            given = not {"samples", "spp"}.isdisjoint(self.fixed)
            family = Family({**optics, **sampler}, (1,) if single or given else SIDES[1:], given)
            for n in family.sides[:1] if len(family.sides) == 1 else FIRST:
                if method := self.measure(self.job(**family.of(n))):
                    family.measured[n] = method
            families += [family] * bool(family.measured)

    def _part(self, **changes) -> Part | None:
        """What these changes of the base do to it."""
        given = self.base["sampler"] == "one" or not {"samples", "spp"}.isdisjoint(self.fixed)
        few = {} if given else side(self.base["sampler"], FIRST[0])
        few = {} if "precision" in changes else few
        plain = self.job(**few)
        if not (before := self.measure(plain)):
            return None
        made = self.job(before.seconds, **few, **changes)
        if not (after := self.measure(made)):
            return None
        (picture, rays), (other, fewer) = (self.pictures[replace(job, kernel=DEFAULT.kernel)] for job in (plain, made))
        # Times of tiles are noisy, and where the arithmetic is the same the rays take them.
        same = rays and fewer and "precision" not in changes
        ratio = fewer / rays if same else after.seconds / before.seconds
        return Part(changes, float(np.sqrt(np.mean((other.astype(np.float64) - picture) ** 2))), ratio)

    @staticmethod
    def _paying(parts: list[Part]) -> list[Part]:
        """Those that are quicker than all that leave out less."""
        paying = []
        for part in sorted(parts, key=lambda part: part.bias):
            if not paying or part.ratio < PAYS * min(other.ratio for other in paying):
                paying.append(part)
        return paying

    def _paths(self) -> list[Part]:
        """Depths and cut-offs that may be taken."""
        paths = [Part({}, 0.0, 1.0)]
        if not self.truth.depth:
            return paths
        for depth in (0, *DEPTHS):
            changes = {"depth": depth, "cutoff": self.base["cutoff"] if depth else 0.0}
            if depth >= self.truth.depth or self.free(**changes) is None:
                continue
            part = self._part(**changes)
            paths += [part] * bool(part)
            if part and part.bias < self.trial.limit / 16:
                break
        for cutoff in reversed(CUTOFFS):
            if self.free(cutoff=cutoff) is None or not (part := self._part(cutoff=cutoff)):
                continue
            paths.append(part)
            if part.bias > self.trial.limit:
                break
        good = [part for part in paths[1:] if part.bias <= self.trial.limit / 2]
        both = [[part for part in good if ("depth" in part.changes) == deep] for deep in (True, False)]
        if all(both):  # the quickest of each kind, together
            shallow, cut = (min(parts, key=lambda part: part.ratio) for parts in both)
            part = self._part(**{**shallow.changes, **cut.changes})
            paths += [part] * bool(part)
        # Adaptive samples know no cut-off: theirs is the first depth that leaves out little.
        little = (
            part.changes["depth"] for part in paths if "depth" in part.changes and part.bias < self.trial.limit / 4
        )
        self.shallow = min(little, default=self.truth.depth)
        paths = self._paying(paths)
        # All else is measured with the quickest that leaves out next to nothing.
        best = min((part for part in paths if part.bias <= self.trial.limit / 16), key=lambda part: part.ratio)
        self.base |= best.changes
        rest = [part for part in paths if part.ratio < best.ratio]
        return [Part({}, best.bias, 1.0), *(replace(part, ratio=part.ratio / best.ratio) for part in rest)]

    def _arithmetic(self) -> list[Part]:
        parts = [Part({}, 0.0, 1.0)]
        for precision in PRECISIONS:
            if precision != self.base["precision"] and self.free(precision=precision) is not None:
                part = self._part(precision=precision)
                parts += [part] * bool(part)
        return self._paying(parts)

    def _adaptive(self) -> None:
        """Families of adaptive samples: of those with the light of the truth, and of those without random rays."""
        if self.trial.against == "centres" or not {"samples", "spp"}.isdisjoint(self.fixed):
            return
        paths = self.own({"depth": self.shallow, "cutoff": 0.0})
        if paths["depth"] > max(DEPTHS[:6]) and "depth" not in self.fixed:
            return  # a tree of rays that nothing cuts off
        own = {"adaptive_depth", "adaptive_threshold"} & self.fixed
        quickest = min(part.ratio for part in self.arithmetic)
        pair = self.parameters.adaptive_depth, self.parameters.adaptive_threshold
        optics = self._optics()
        for optic in (
            optics
            if "sampler" in self.fixed
            else optics[:1] + [optic for optic in optics[1:] if not any(optic.values())]
        ):
            for depth, threshold in (pair,) if len(own) == 2 else ADAPTIVE:
                way = self.own({"adaptive_depth": depth, "adaptive_threshold": threshold})
                changes = {"sampler": "adaptive", **paths, **way, **optic}
                if self.free(**changes) is None or not (method := self.measure(self.job(**changes))):
                    continue
                self.families.append(Family(changes, (1,), measured={1: method}, whole=True))
                if self.holds(method, self.trial.limit) or method.seconds * quickest > self._least():
                    break  # the next ones take longer, and there is a better method, or one should be

    def _least(self) -> float:
        """Seconds of the quickest method that should hold; infinite if none should."""
        limit, change = self.trial.limit, self.truth.doubt
        return next((time for time, error, *_ in self.forecasts() if error * self.miss + change <= limit), np.inf)

    def forecasts(self) -> list[tuple[float, float, Family, float, Parameters]]:
        """(seconds, RMSE with its margin, family, RMSE, changes) of every method, the quickest first."""
        rows = []
        for family in self.families:
            paths = self.paths[:1] if family.whole else self.paths
            for n in family.sides:
                sampled, doubt, seconds = family.forecast(n)
                for path, arithmetic in product(paths, self.arithmetic):
                    error = float(np.sqrt(sampled**2 + path.bias**2 + arithmetic.bias**2))
                    changes = {**family.of(n), **path.changes, **arithmetic.changes}
                    time = seconds * path.ratio * arithmetic.ratio
                    rows.append((time, error * family.worse * (1 + SURE * doubt), family, error, changes))
        return sorted(rows, key=lambda row: row[0])

    def holds(self, method: Method, limit: float) -> bool:
        return (method.rmse + SURE * method.standard_error) * self.miss + self.truth.doubt <= limit

    def choose(self) -> Method | None:
        """The quickest measured method that holds, after those were measured that should be quicker; None if there is
        none. TimeUp.
        """
        if not self.ready:
            self.paths = self._paths()
            self._families()
            self.arithmetic = self._arithmetic()
            self._adaptive()
            self.ready = True
        limit = self.trial.limit
        for number in range(MOST):
            best = self.best
            if best and number >= ENOUGH:
                break
            for seconds, error, *rest in self.forecasts():
                if best and seconds > PAYS * best.seconds:
                    return self._others(best)
                family, plain, changes = rest
                made = self.job(seconds, **changes)
                tried = (self.entry.name, replace(made, kernel=DEFAULT.kernel)) in self.tried
                if not tried and error * self.miss + self.truth.doubt <= limit:
                    break
            else:
                return best and self._others(best)
            if (method := self.measure(made, seconds=seconds)) and plain:
                family.worse = max(method.rmse / plain, 0.25)
        return self.best and self._others(self.best)

    @property
    def best(self) -> Method | None:
        """The quickest measured method that holds."""
        good = (method for method in self.measured if self.holds(method, self.trial.limit))
        return min(good, key=lambda method: method.seconds, default=None)

    @property
    def guess(self) -> Method | None:
        """`best`, or if the time is up before there is one the quickest that should hold by what is measured so far."""
        if self.best:
            return self.best
        for seconds, error, _, plain, changes in self.forecasts():
            if error * self.miss + self.truth.doubt <= self.trial.limit:
                return Method(self.entry, self.job(seconds, **changes), plain, (error - plain) / SURE, seconds)
        return None

    def _others(self, best: Method) -> Method:
        """The quickest variant for a method, of those that measure it together in less time than the picture takes."""
        entries = self.trial.entries
        others = [
            name for name in truth.MAKERS if name in entries and entries[name].renderer is not best.entry.renderer
        ]
        return best if self.variant or best.seconds < LONG else self._quickest(best, others)

    def _quickest(self, best: Method, others: list[str]) -> Method:
        end, job = self.trial.end, replace(best.parameters, kernel=self.parameters.kernel)
        last = min(end, end - self.trial.left + best.seconds)  # all of them together
        for name in others:
            entry = self.trial.entries[name]
            self.trial.end = last
            try:
                method = None if entry.unavailable else self.measure(general(entry, job), entry, best.seconds)
            except TimeUp:
                method = None
            finally:
                self.trial.end = end
            if method and method.seconds < best.seconds and self.holds(method, self.trial.limit):
                best = method
        return best

    def learn(self, method: Method, rmse: float) -> None:
        """That the whole picture by `method` has this error."""
        if method.rmse:
            self.miss = max(self.miss, 1.02 * rmse / (method.rmse + SURE * method.standard_error))

    def in_the_way(self) -> list[str]:
        """Options of the user without which the most accurate method would hold; else those that cost it most."""
        best = min(self.measured, key=lambda method: method.rmse)
        number = {"samples": self.side, **side("sobol", self.side)}
        freed = {**number, "sampler": "sobol", "feelers": 1, "glossy_rays": 1, **self.deep}
        errors = []
        for name in sorted(self.fixed & set(NAMES)):
            value = freed.get(name, getattr(DEFAULT, name))
            if value == getattr(best.parameters, name):
                continue
            more = {key: count for key, count in number.items() if name == "sampler" and key not in self.fixed}
            if name in number and "sampler" not in self.fixed:
                more = {"sampler": "jittered" if name == "samples" else "sobol"}
            method = self.measure(general(best.entry, replace(best.parameters, **{name: value}, **more)))
            if method:
                errors.append((method.rmse, name))
        alone = [name for rmse, name in errors if rmse <= self.trial.limit]
        return alone or [name for rmse, name in sorted(errors) if rmse < 0.9 * best.rmse]
