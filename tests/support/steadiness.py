"""How often the rule of the steady state is wrong: false marks and misses, on made-up and on real frames.

    .venv/bin/python tests/support/steadiness.py > table.md      # the tables of docs/measuring-well.md

A made-up process takes its frames from one of KINDS, which knows the level that it ends at. Its result holds if the
median of its frames is within BOUND of that level; a cell's result also if the level is in its interval. A mark on a
result that holds is false; no mark on one that does not is a miss. Real frames are taken as they are, and with a change
put in.
"""

import csv
import math
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from harness.statistics import statistics, steady  # noqa: E402
from harness.store import packed, store  # noqa: E402

BOUND = steady.DRIFT  # a smaller change is not called one
PROCESSES, FRAMES = 6, 21  # of experiments/comparison.toml
SHORTEST, LONGEST = 11, 31  # frames of a process alone
QUIET = ROOT / "results/reference/xeon-2x/comparison.tar.xz"
OF_DOCS = 100, [2026]  # how many of each kind, and the seed
BUSY = ROOT / "tests/harness/statistics/busy_machine.csv"


def noise(rng, count: int, size: float, memory: float = 0.0) -> np.ndarray:
    """Returns factors near 1 with a relative standard deviation; memory: correlation of a frame with the next."""
    made = rng.standard_normal(count + 50)
    for n in range(1, len(made)):
        made[n] = memory * made[n - 1] + math.sqrt(1 - memory**2) * made[n]
    return np.exp(size * made[50:])


def spikes(rng, count: int, share: float) -> np.ndarray:
    hit = rng.random(count) < share
    return np.where(hit, rng.uniform(1.5, 10, count), 1.0)


def every(rng, program, count: int) -> np.ndarray:
    """A timer or a garbage collector."""
    made, step = np.ones(count), int(program.integers(3, 8))
    made[int(rng.integers(step)) :: step] = program.uniform(1.2, 3)
    return made


def decay(count: int, by: float, length: float) -> np.ndarray:
    return 1 + by * np.exp(-np.arange(count) / length)


def step(count: int, at: float, by: float) -> np.ndarray:
    return np.where(np.arange(count) < at * count, 1.0, by)


def either(rng, low: float, high: float) -> float:
    """Returns a factor up or down by a relative size between two."""
    return 1 + rng.uniform(low, high) * (1 if rng.random() < 0.5 else -1)


def modes(rng, count: int, high: float) -> np.ndarray:
    """Two levels, of which each frame changes to the other with a probability of a fifth."""
    turns = np.cumsum(rng.random(count) < 0.2) + rng.integers(2)
    return np.where(turns % 2, high, 1.0)


def some(rng, made: np.ndarray, share: float) -> np.ndarray:
    """Returns `made` in a share of the processes."""
    return made if rng.random() < share else np.ones(len(made))


# Each returns the shape of the frames and the level at their end. program: its generator is the same in all processes
# of a cell, that of `rng` is not.
HOLDING: dict[str, Callable] = {
    **{
        f"noise of {100 * size:g} %": lambda rng, program, n, size=size: (noise(rng, n, size), 1.0)
        for size in (0.005, 0.01, 0.02, 0.05)
    },
    "heavy tails": lambda rng, program, n: (1 + 0.01 * np.abs(rng.standard_t(2, n)), 1.008),
    "rare spikes": lambda rng, program, n: (noise(rng, n, 0.01) * spikes(rng, n, 0.08), 1.0),
    "a spike every 3 to 7 frames": lambda rng, program, n: (noise(rng, n, 0.01) * every(rng, program, n), 1.0),
    "a slow first frame": lambda rng, program, n: (
        noise(rng, n, 0.01) * (1 + (np.arange(n) == 0) * program.uniform(1, 50)), 1.0,
    ),
    "a short warm-up": lambda rng, program, n: (
        noise(rng, n, 0.01) * decay(n, program.uniform(0.2, 4), program.uniform(0.5, n / 15)), 1.0,
    ),
    "a drift of 3 %": lambda rng, program, n: (noise(rng, n, 0.01) * np.linspace(1, 1.03, n), 1.03),
    "wandering by 2 %": lambda rng, program, n: (noise(rng, n, 0.02, rng.uniform(0.5, 0.9)), 1.0),
    "wandering by 5 %": lambda rng, program, n: (noise(rng, n, 0.05, rng.uniform(0.5, 0.9)), 1.0),
    "wandering by 10 %": lambda rng, program, n: (noise(rng, n, 0.1, rng.uniform(0.5, 0.9)), 1.0),
    "another level in 3 of 10 processes": lambda rng, program, n: (
        noise(rng, n, 0.01) * some(rng, step(n, rng.uniform(0.2, 0.9), either(rng, 0.1, 0.4)), 0.3), 1.0,
    ),
}  # fmt: skip
CHANGING: dict[str, Callable] = {
    "another level, late": lambda rng, program, n: _to(
        noise(rng, n, 0.01), step(n, program.uniform(0.55, 0.8), either(program, 0.1, 0.4))
    ),
    "a slow drift": lambda rng, program, n: _to(
        noise(rng, n, 0.01), np.linspace(1, either(program, 0.15, 0.3), n)
    ),
    "a warm-up longer than the run": lambda rng, program, n: (
        noise(rng, n, 0.01) * decay(n, program.uniform(0.3, 3), n * program.uniform(0.3, 1)), 1.0,
    ),
    "growing": lambda rng, program, n: _to(noise(rng, n, 0.02), 1 + program.uniform(0.3, 2) * np.arange(n) / n),
    "two levels in turn": lambda rng, program, n: _between(noise(rng, n, 0.01), rng, n, program.uniform(1.2, 1.5)),
}  # fmt: skip
KINDS = {**HOLDING, **CHANGING}
PUT_IN = {
    "as they are": np.ones,
    "with a drift of 30 %": lambda n: np.linspace(1, 1.3, n),
    "30 % slower after 70 % of the frames": lambda n: step(n, 0.7, 1.3),
    "with a warm-up longer than the run": lambda n: decay(n, 0.8, n / 2),
}


def _to(noise: np.ndarray, shape: np.ndarray) -> tuple[np.ndarray, float]:
    return noise * shape, float(shape[-1])


def _between(noise: np.ndarray, rng, count: int, high: float) -> tuple[np.ndarray, float]:
    return noise * modes(rng, count, high), (1 + high) / 2


def before(frames: list[float]) -> tuple[int, bool]:
    """The rule of version 0.1: the first frame that counts, and whether there is no steady state."""
    later = len(frames) - 1
    settled = frames[-((later + 1) // 2) :]
    level = median(settled)
    width = max(steady.WIDTH * _scale(settled), steady.LEAST_WIDTH * level)
    inside = [abs(frame - level) <= width for frame in frames]
    ends = (n for n in range(len(frames)) if inside[n] and 2 * sum(inside[n + 1 : n + 9]) >= len(inside[n + 1 : n + 9]))
    first = max(1, next(ends, later + 1))
    rest = frames[first:]
    if len(rest) < 2 / 3 * later:
        return 1, True
    early, late = rest[: len(rest) // 2], rest[len(rest) // 2 :]
    change, error = abs(median(late) - median(early)), math.hypot(_error(early), _error(late))
    return (1, True) if change > max(0.05 * min(median(early), median(late)), 3 * error) else (first, False)


def _scale(values: list[float]) -> float:
    return 1.4826 * median(abs(value - median(values)) for value in values)


def _error(values: list[float]) -> float:
    return math.sqrt(math.pi / 2 / len(values)) * _scale(values)


class Rates:
    """Counts marks of results that hold, and of those that do not, by version 0.1 and by this version."""

    def __init__(self):
        self.count = Counter()

    def add(self, holds: bool, was: bool, now: bool) -> None:
        self.count.update({(holds, "all"): 1, (holds, "was"): was, (holds, "now"): now})

    def holding(self) -> float:
        return self.count[True, "all"] / (self.count[True, "all"] + self.count[False, "all"])

    def false(self, rule: str) -> float | None:
        """The share of results that hold and have a mark; None of too few."""
        return self._share(True, self.count[True, rule])

    def missed(self, rule: str) -> float | None:
        return self._share(False, self.count[False, "all"] - self.count[False, rule])

    def _share(self, holds: bool, count: int) -> float | None:
        every = self.count[holds, "all"]
        return count / every if every >= 20 else None


def process(frames: list[float], level: float, rates: Rates) -> None:
    """Judges a process alone."""
    found, (first, was) = steady.find(frames), before(frames)
    holds = all(abs(median(frames[start:]) / level - 1) <= BOUND for start in {found.start, first})
    rates.add(holds, was, found.state == "none")


def cell(processes: list[list[float]], level: float, rates: Rates) -> None:
    """Judges a cell."""
    value = statistics.median([median(frames[steady.find(frames).start :]) for frames in processes])
    rates.add(abs(value.value / level - 1) <= BOUND or value.low <= level <= value.high, *marked(processes))


def marked(processes: list[list[float]]) -> tuple[bool, bool]:
    """Is a cell marked by version 0.1, which did it if any process had no steady state, and by this one?"""
    found = list(map(steady.find, processes))
    now = steady.together([one.change for one in found if one.change is not None], [one.note for one in found])
    return any(before(frames)[1] for frames in processes), bool(now)


def made_up(kind: str, count: int, seed: list[int]) -> tuple[Rates, Rates]:
    """Returns the rates of `count` processes alone, of 11 to 31 frames, and of as many cells."""
    alone, together = Rates(), Rates()
    for number in range(count):
        own = [*seed, number]
        frames = int(np.random.default_rng([*own, 1]).integers(SHORTEST, LONGEST + 1))
        shape, level = KINDS[kind](np.random.default_rng([*own, 2]), np.random.default_rng([*own, 3]), frames)
        process(shape.tolist(), level, alone)
        shapes = [
            KINDS[kind](np.random.default_rng([*own, 4, n]), np.random.default_rng([*own, 3]), FRAMES)
            for n in range(PROCESSES)
        ]
        cell([shape.tolist() for shape, _ in shapes], shapes[0][1], together)
    return alone, together


def quiet() -> list[list[list[float]]]:
    """Returns the frames of the processes of each cell of the reference comparison: two cores, mostly idle."""
    cells = {}
    with packed.opened(QUIET) as folder:
        for row in store.read(folder)[1]:
            if len(row["frames_s"] or []) > steady.LEAST:
                cells.setdefault((row["cell"], row["pass"]), []).append(row["frames_s"])
    return list(cells.values())


def busy() -> list[list[list[float]]]:
    """Returns those of six renderers on two cores that four other programs kept busy."""
    cells = {}
    with open(BUSY, newline="") as file:
        for variant, *frames in csv.reader(file):
            cells.setdefault(variant, []).append(list(map(float, frames)))
    return list(cells.values())


def real(cells: list[list[list[float]]], change: Callable, splits: int, seed: list[int]) -> tuple[float, float]:
    """Returns the shares of cells that are marked, by version 0.1 and by this one.

    Each cell has half of the processes of a real one, drawn `splits` times; change(n): factors of their n frames.
    """
    was, now, rng = [], [], np.random.default_rng(seed)
    for processes in cells:
        for _ in range(splits):
            mine = rng.permutation(len(processes))[: len(processes) // 2].tolist()
            marks = marked([(np.array(processes[n]) * change(len(processes[n]))).tolist() for n in mine])
            was.append(marks[0])
            now.append(marks[1])
    return float(np.mean(was)), float(np.mean(now))


def percent(share: float | None) -> str:
    return "" if share is None else f"{100 * share:.0f} %"


def line(name: str, rates: Rates) -> list[str]:
    shares = [rates.false("was"), rates.false("now"), rates.missed("was"), rates.missed("now")]
    return [name, percent(rates.holding()), *map(percent, shares)]


def tables(count: int, seed: list[int]) -> Iterator[str]:
    """Yields the lines of the three tables."""
    found = {kind: made_up(kind, count, [*seed, number]) for number, kind in enumerate(KINDS)}
    heads = "result holds", "false marks, 0.1", "now", "missed, 0.1", "now"
    for which, what in enumerate(("a process alone", f"a cell of {PROCESSES} processes")):
        yield from _table([what, *heads], [line(kind, both[which]) for kind, both in found.items()])
    of_real = []
    for name, cells in (("mostly idle", quiet()), ("busy", busy())):
        series = sum(map(len, cells))
        for told, change in PUT_IN.items():
            shares = real(cells, change, count // 10, seed)
            of_real.append([f"{series} series of a machine that was {name}, {told}", *map(percent, shares)])
    yield from _table(["half of the processes of a real cell", "marked, 0.1", "now"], of_real)


def _table(header: list[str], rows: list[list[str]]) -> Iterator[str]:
    yield f"| {' | '.join(header)} |"
    yield f"|{'---|' * len(header)}"
    yield from (f"| {' | '.join(row)} |" for row in rows)
    yield ""


if __name__ == "__main__":
    print("\n".join(tables(*OF_DOCS)))
