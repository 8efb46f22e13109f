"""How often the doubt "other programs used the processor" is wrong: renderers beside a busy program, and without one.

    .venv/bin/python tests/support/competing.py > table.md                    # of what was recorded
    .venv/bin/python tests/support/competing.py --record minutes > FILE.csv   # on two cores and a machine that is idle

Rounds take turns: without another program; with one on the other core; with one on the same core, to which rayrace is
bound too. It is busy for a share of the time, in periods of 20 ms. A result holds if the median frame takes at most
BOUND longer than in the median of the rounds without it.
"""

import csv
import itertools
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from harness.store import store  # noqa: E402
from harness.system import trouble  # noqa: E402

RECORDED = ROOT / "tests/harness/system/competing.csv"
BOUND = 0.05
IDLE = 0.9  # of both cores, for 0.4 s before a round begins
SHARES = 1.0, 0.5, 0.25, 0.1, 0.05
EXPERIMENT = """title = "competing"
scenes = ["{scene}"]
renderers = ["python", "numpy", "cpp", "cpp-threads"]
processes = 1
frames = 20
[override.python]
frames = 10
[override.cpp]
frames = 400
[override.cpp-threads]
frames = 400
[image]
width = 64
height = 64
depth = 10
shadows = false
"""
SPIN = """import sys, time
share, period = float(sys.argv[1]), 0.02
while True:
    began = time.perf_counter()
    while time.perf_counter() - began < share * period:
        pass
    time.sleep(max(0.0, period - (time.perf_counter() - began)))
"""
COLUMNS = "where", "share", "variant", "threads", "frame_s", "wall_s", "other_cpu_s", "doubt"


def conditions() -> list[tuple[str, float]]:
    """Where the other program is, and the share of the time for which it is busy."""
    beside = [(where, share) for share in SHARES for where in ("the other core", "the same core")]
    return [("none", 0.0), *beside, ("none", 0.0), ("none, bound", 0.0)]


def record(seconds: float) -> Iterator[list]:
    """Yields the rows of rounds until the time is over."""
    end, program = time.monotonic() + seconds, Path(sys.executable).with_name("rayrace")
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "competing.toml"
        file.write_text(EXPERIMENT.format(scene=ROOT / "experiments/scenes/comparison.txt"))
        for number, (where, share) in enumerate(itertools.cycle(conditions())):
            while _idle(0.4) < IDLE:
                if time.monotonic() > end:
                    return
            bound = ["taskset", "-c", "0"] if where in ("the same core", "none, bound") else []
            core = "0" if where == "the same core" else "1"
            other = subprocess.Popen(["taskset", "-c", core, sys.executable, "-c", SPIN, str(share)]) if share else None
            folder = Path(place) / str(number)
            try:
                words = [*bound, program, "run", file, "--out", folder]
                subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            finally:
                if other:
                    other.kill()
                    other.wait()
            yield from (_row(where, share, row) for row in store.read(folder)[1])


def _row(where: str, share: float, row: dict) -> list:
    numbers = median(row["frames_s"][1:]), row["wall_s"], row["disturbed"]["other_cpu_s"]
    doubt = int(trouble.DOUBTS["other_cpu_s"] in row["warnings"])
    return [where, share, row["variant"], row["parameters"]["threads"], *(f"{n:.4g}" for n in numbers), doubt]


def _idle(seconds: float) -> float:
    """The share of the time for which the cores are idle."""
    before, cores = trouble.look(), len(trouble.usable())
    time.sleep(seconds)
    return 1 - (trouble.look()["busy_s"] - before["busy_s"]) / seconds / cores


def table(file: Path = RECORDED) -> Iterator[str]:
    """Yields the lines of the table: for each place of the other program and number of threads, how often a result
    holds, and how often there is a doubt, by the rule of version 0.1 and by this version's."""
    with open(file, newline="") as lines:
        rows = list(csv.DictReader(lines))
    alone, groups = {}, {}
    for row in rows:
        if row["where"].startswith("none"):
            alone.setdefault((row["variant"], row["threads"]), []).append(float(row["frame_s"]))
        groups.setdefault((_told(row["where"], float(row["share"])), row["threads"]), []).append(row)
    yield "| another program | threads | repetitions | hold | false doubts, 0.1 | now | missed, 0.1 | now |"
    yield "|---|---|---|---|---|---|---|---|"
    for (where, threads), mine in sorted(groups.items()):
        good, bad = [], []
        for row in mine:
            level = median(alone[row["variant"], row["threads"]])
            least = max(trouble.LEAST_S, trouble.SHARE * float(row["wall_s"]))
            doubts = float(row["other_cpu_s"]) > least, row["doubt"] == "1"
            (good if float(row["frame_s"]) <= (1 + BOUND) * level else bad).append(doubts)
        counts = [f"{sum(doubts[rule] for doubts in good)} of {len(good)}" if good else "" for rule in (0, 1)]
        counts += [f"{sum(not doubts[rule] for doubts in bad)} of {len(bad)}" if bad else "" for rule in (0, 1)]
        yield f"| {where} | {threads} | {len(mine)} | {len(good)} | {' | '.join(counts)} |"


def _told(where: str, share: float) -> str:
    if not share:
        return "none"
    return f"on {where}, {'a quarter of the time or more' if share >= 0.25 else 'a tenth or less'}"


if __name__ == "__main__":
    if sys.argv[1:2] == ["--record"]:
        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in record(60 * float(sys.argv[2])):
            writer.writerow(row)
            sys.stdout.flush()
    else:
        print("\n".join(table()))
