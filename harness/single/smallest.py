"""Searches the smallest model of a scene whose error is within a limit: leave-outs together, each step rendered.

Effects do not add up, so nothing is forecast: the search goes through what is harmless alone, the most time saved for
the error first, and keeps what the whole can still do without. Where there are few combinations all can be tried.
"""

from dataclasses import dataclass
from itertools import combinations

from harness.errors import UserError
from harness.judge import judge
from harness.judge.truth import Truth
from harness.race import turns
from harness.race.turns import Times
from harness.reduction.leave_out import LeaveOut, apply
from harness.single.worth import Model, Study, Way, Worth, must_have, take
from harness.statistics import statistics

MOST = 10  # leave-outs that change the picture, of which all combinations are tried
TINY = 1e-12  # of a mean squared error: less than any picture is known to


@dataclass(frozen=True)
class Smallest:
    """The smallest model that was found. left: what it is without, in the order of the list.

    error: judge.errors against the truth of the full scene. time: ratio of frames, reduced over full; faster: its
    statistics.verdict; times: that they are from. memory: ratio of median peaks, or None. rendered: the models that the
    search has rendered.
    """

    model: Model
    left: list[LeaveOut]
    error: dict
    time: statistics.Estimate
    faster: str
    memory: float | None
    rendered: int
    times: list[Times]


@dataclass(frozen=True)
class Best:
    """The quickest of all combinations that are within the limit, about, by a process each, and then timed as others.

    tried: different models; within: those within the limit, the greedy search's among them. over: time of the greedy
    search's, over this one's, and verdict of it; times: that they are from.
    """

    left: list[LeaveOut]
    error: dict
    tried: int
    within: int
    over: statistics.Estimate
    verdict: str
    times: list[Times]


def most(error: dict, true: Truth) -> float:
    """The largest RMSE that a picture may have, as far as the truth is known."""
    return error["rmse"] + error["rmse_standard_error"] + true.doubt


def check(full: Model, true: Truth, limit: float) -> None:
    """UserError if the picture of the full model is not within the limit."""
    error = most(judge.errors(full.picture, true.picture, true.standard_error, None), true)
    if error > limit:
        remedy = "take a larger limit, or more samples, a greater depth or float64 for the full model"
        raise UserError(f"the full model has an RMSE of up to {error:.3g} itself, more than {limit:.3g}", remedy=remedy)


def harmless(study: Study, listed: list[LeaveOut], limit: float) -> list[LeaveOut]:
    """The leave-outs that are within the limit alone and do not slow the picture down: those that save the most time
    for the error first."""

    def gain(pair: tuple[LeaveOut, Worth]) -> float:
        worth = pair[1]
        return (1 - worth.time.value) / max(worth.change.added, TINY)

    pairs = [
        (leave_out, worth)
        for leave_out, worth in zip(listed, study.worths, strict=True)
        if not worth.unavailable and worth.faster != "slower" and most(worth.error, study.truth) <= limit
    ]
    return [leave_out for leave_out, _ in sorted(pairs, key=gain, reverse=True)]


class Search:
    """Combinations of leave-outs of a study, rendered."""

    def __init__(self, study: Study, listed: list[LeaveOut], limit: float, way: Way):
        self.study, self.listed, self.limit, self.way = study, listed, limit, way
        self.candidates = harmless(study, listed, limit)
        full = study.full
        self.models = {(full.scene, full.job): (full, study.error)}

    def without(self, left: list[LeaveOut]) -> tuple[Model, dict] | None:
        """The model without what is `left`, and its error; None if it is not within the limit or has no picture."""
        scene, job = apply(left, self.study.full.scene, self.study.full.job)
        if (scene, job) not in self.models:
            model, error = Model(scene, job), None
            model.shoot(self.way.entry, self.way.run, self.way.timeout)
            if not model.broken:
                true = self.study.truth
                error = judge.errors(model.picture, true.picture, true.standard_error, None, true.doubt)
                model.picture = None
            self.models[scene, job] = model, error
        model, error = self.models[scene, job]
        return (model, error) if error and most(error, self.study.truth) <= self.limit else None

    def greedy(self) -> Smallest:
        """Leaves out one more after another as long as the whole is within the limit, and times the result."""
        left: list[LeaveOut] = []
        smallest, error = self.study.full, self.study.error
        for leave_out in self.candidates:
            more = [other for other in self.listed if other is leave_out or other in left]
            scene, job = apply(more, self.study.full.scene, self.study.full.job)
            if (scene, job) != (smallest.scene, smallest.job) and (made := self.without(more)):
                (smallest, error), left = made, more
        for leave_out in list(left):  # what another has made needless
            fewer = [other for other in left if other is not leave_out]
            if apply(fewer, self.study.full.scene, self.study.full.job) == (smallest.scene, smallest.job):
                left = fewer
        rendered = len(self.models) - 1
        full, model, again = (
            Model(source.scene, source.job) for source in (self.study.full, smallest, self.study.full)
        )
        times = take([full, model, again], self.way)
        must_have(self.way, full, model, again)
        ratio = turns.ratio(model.times, full.times)
        faster = statistics.verdict(ratio, turns.floor(full.times, again.times).value)
        return Smallest(model, left, error, ratio, faster, model.memory_over(full), rendered, times)

    def exhaustive(self, greedy: Smallest) -> Best:
        """Renders and times all combinations of what changes the picture, always without what changes no pixel, and
        compares the quickest with the greedy search's. UserError if they are too many."""
        pairs = zip(self.listed, self.study.worths, strict=True)
        changing = [leave_out for leave_out, worth in pairs if leave_out in self.candidates and worth.change.pixels > 0]
        if len(changing) > MOST:
            many = f"{len(changing)} changes are harmless alone, all combinations of which are too many"
            raise UserError(many, remedy=f"leave --exhaustive out; it is for {MOST} or fewer")
        solutions, tried = {}, set()
        for some in (some for count in range(len(changing) + 1) for some in combinations(changing, count)):
            kept = set(changing) - set(some)
            left = [leave_out for leave_out in self.listed if leave_out in self.candidates and leave_out not in kept]
            tried.add(apply(left, self.study.full.scene, self.study.full.job))
            if made := self.without(left):
                model, error = made
                solutions.setdefault((model.scene, model.job), (model, error, left))
        solutions.setdefault((greedy.model.scene, greedy.model.job), (greedy.model, greedy.error, greedy.left))
        rough = [Model(model.scene, model.job) for model, _, _ in solutions.values()]
        take(rough, self.way, processes=1)
        timed = zip(rough, solutions.values(), strict=True)
        timed = [(model.times.seconds.value, solution) for model, solution in timed if not model.broken]
        if not timed:
            raise UserError("no combination could be timed")
        _, (best, error, left) = min(timed, key=lambda pair: pair[0])
        greedy_model, best_model, again = (
            Model(model.scene, model.job) for model in (greedy.model, best, greedy.model)
        )
        times = take([greedy_model, best_model, again], self.way)
        must_have(self.way, greedy_model, best_model, again)
        over = turns.ratio(greedy_model.times, best_model.times)
        verdict = statistics.verdict(over, turns.floor(greedy_model.times, again.times).value)
        return Best(left, error, len(tried), len(solutions), over, verdict, times)
