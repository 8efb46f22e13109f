"""The smallest models of the gallery's scenes within 1/255, rendered again by another renderer and held to the truth.

    .venv/bin/python tests/support/reduced_gallery.py > table.md

For each scene: `rayrace needs --within 1/255` with C++, and the command that it writes, by numba-parallel; its picture
is compared with a truth of the whole scene with seeds of its own. As few samples as keep the whole model within the
limit (SIDES).
"""

import argparse
import json
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]

from promises import Subject  # noqa: E402

from harness.judge import judge  # noqa: E402
from harness.process.session import Sessions  # noqa: E402
from harness.renderer import registry  # noqa: E402
from harness.scene import load  # noqa: E402

SCENES = [ROOT / "experiments/scenes/comparison.txt", *sorted((ROOT / "experiments/scenes/gallery").glob("*.txt"))]
SIZE, LIMIT = (96, 72), 1 / 255
SIDES = (4, 8, 16, 32)  # of samples a pixel, until the whole model is within the limit
OTHER = "numba-parallel"
DEPTH, CUTOFF = 32, 2.0**-20  # of the truth


def search(scene: Path, folder: Path, size: tuple[int, int], more: list[str]) -> dict:
    """What `rayrace needs` says of the smallest model; {"told": reason} if there is none."""
    why = ""
    for side in SIDES:
        words = [sys.executable, "-m", "rayrace", "needs", scene, "-r", "cpp-threads", "--within", "1/255", "--json"]
        words += ["--width", size[0], "--height", size[1], "--sampler", "jittered", "--samples", side, *more]
        words += ["--feelers", 1, "--glossy-rays", 1, "--reduced", folder / "reduced.txt", "--timeout", 120]
        done = subprocess.run(list(map(str, words)), cwd=ROOT, capture_output=True, text=True)
        if done.returncode == 0:
            return {**json.loads(done.stdout), "side": side}
        why = done.stderr.strip().splitlines()[-1].removeprefix("error: ")
    return {"told": why}


def again(command: str, folder: Path) -> np.ndarray | str:
    """The picture of a `rayrace render` command by the OTHER renderer, or why there is none."""
    words = shlex.split(command)[1:]
    words[words.index("-r") + 1], words[words.index("-o") + 1] = OTHER, str(folder / "again.npy")
    done = subprocess.run([sys.executable, "-m", "rayrace", *words], cwd=ROOT, capture_output=True, text=True)
    return np.load(folder / "again.npy") if done.returncode == 0 else done.stderr.strip().splitlines()[-1]


def examine(scene: Path, run, known: dict, size: tuple[int, int], more: list[str]) -> dict:
    row = {"scene": scene.stem}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        told = search(scene, folder, size, more)
        if "told" in told:
            return {**row, "told": told["told"]}
        found = told["smallest"]
        picture = again(found["command"], folder)
        if isinstance(picture, str):
            return {**row, "told": f"{OTHER}: {picture}"}
    subject = Subject(load(scene), {"shadows": True}, size, known, run)
    error = judge.errors(picture, *subject.truth(OTHER, DEPTH, CUTOFF), None)
    time = found["time"]
    return {**row, "side": told["side"], "left": found["left_out"], "before": told["full"]["error"]["rmse"],
            "rmse": error["rmse"], "doubt": error["rmse_standard_error"],
            "time": [time["ratio"], time["low"], time["high"]]}  # fmt: skip


def grouped(left: list[str]) -> str:
    """What was left out, in words: the same thing of several materials, and several objects, counted."""
    counts: dict[str, list[str]] = {}
    for name in left:
        found = re.fullmatch(r"(?P<what>.+) of the material of the .+|the \w+ of line \d+|part \d+ .+", name)
        kind = name if not found else f"{found['what']} of {{}} materials" if found["what"] else "{} objects or parts"
        counts.setdefault(kind, []).append(name)
    return ", ".join(kind.format(len(names)) if len(names) > 1 else names[0] for kind, names in counts.items())


def table(rows: list[dict]) -> str:
    """The rows, as Markdown."""
    lines = [
        "| scene | samples | left out | error before ÷ limit | error after, by another renderer ÷ limit | time |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        if "told" in row:
            lines.append(f"| {row['scene']} | | {row['told']} | | | |")
            continue
        after = f"{row['rmse'] / LIMIT:.2f} ± {row['doubt'] / LIMIT:.2f}"
        ratio, low, high = row["time"]
        interval = "" if low is None else f" [{low:.2g}, {high:.2g}]"
        left = f"{len(row['left'])}: {grouped(row['left'])}"
        head = f"| {row['scene']} | {row['side']} x {row['side']} | {left} | {row['before'] / LIMIT:.2f} "
        lines.append(f"{head}| {after} | {ratio:.2g}{interval} |")
    made = [row for row in rows if "told" not in row]
    kept = sum(row["rmse"] <= LIMIT for row in made)
    half = sum(row["time"][0] <= 0.5 for row in made)
    told = f"{len(made)} of {len(rows)} scenes have such a model; {kept} of these are within the limit by {OTHER}"
    lines += ["", f"{told}; {half} take half the time or less."]
    return "\n".join(lines)


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("scenes", nargs="*", type=Path, default=SCENES)
    asked.add_argument("--more", default="", help="more options of `rayrace needs`, in one word")
    asked.add_argument("--size", nargs=2, type=int, default=SIZE, metavar=("WIDTH", "HEIGHT"))
    told, known, rows = asked.parse_args(), registry.entries(()), []
    for scene in told.scenes:
        with Sessions() as sessions:
            rows.append(examine(scene, sessions.run, known, tuple(told.size), shlex.split(told.more)))
        print(json.dumps(rows[-1]), file=sys.stderr, flush=True)
    print(table(rows))


if __name__ == "__main__":
    main()
