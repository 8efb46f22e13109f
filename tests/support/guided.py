"""Looks for input that reaches code which no input before has reached, with atheris (libFuzzer).

    python guided.py KIND CASES

It prints nothing but what libFuzzer prints, and exits with 0 when so many cases have held to the contract (hostile.py).
"""

import random
import sys
import tempfile
from pathlib import Path

import atheris

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "hostile")]

with atheris.instrument_imports(include=["harness", "tomllib", "csv"]):
    from harness.experiment import experiment
    from harness.judge import rays
    from harness.renderer import events, manifest
    from harness.scene import load
    from harness.store import store

import hostile  # noqa: E402
import test_events  # noqa: E402
import test_experiments  # noqa: E402
import test_manifests  # noqa: E402
import test_rays  # noqa: E402
import test_scenes  # noqa: E402
from stored_run import facts, rows  # noqa: E402


class Bytes(random.Random):
    """What it draws is what libFuzzer says, so that libFuzzer learns which draws lead somewhere."""

    def __init__(self, data):
        super().__init__(0)
        self.data = atheris.FuzzedDataProvider(data)

    def randint(self, low, high):
        return self.data.ConsumeIntInRange(low, high)

    def choice(self, values):
        return values[self.randint(0, len(values) - 1)]


def _run(folder):
    """Reads run.json and the rows beside it, which are good."""
    return store.read(folder)


# kind: the file, what reads its folder, a text that is good and the pieces of its language
KINDS = {
    "scene text": ("a.txt", lambda folder: load(folder / "a.txt"), test_scenes.TEXT, test_scenes.KINDS["a.txt"][2]),
    "NFF": ("a.nff", lambda folder: load(folder / "a.nff"), test_scenes.NFF, test_scenes.KINDS["a.nff"][2]),
    "RAYS.csv": ("a.csv", lambda folder: rays.read(folder / "a.csv"), test_rays.VALID, test_rays.PIECES),
    "renderer.toml": ("renderer.toml", manifest.load, test_manifests.VALID, test_manifests.PIECES),
    "experiment": (
        "e.toml",
        lambda folder: experiment.load(folder / "e.toml"),
        test_experiments.VALID,
        test_experiments.PIECES,
    ),
    "lines of a renderer": (
        "stdout",
        lambda folder: events.read(folder / "stdout"),
        ["\n".join(test_events.LINES) + "\n"],
        test_events.PIECES,
    ),
    "stored runs": ("run.json", _run, [test_events.json.dumps(facts())], ['"cells": ', "[", "{", "null", "NaN"]),
}


def main(kind, cases):
    name, read, valid, pieces = KINDS[kind]
    with hostile.scratch() as folder, tempfile.TemporaryDirectory() as found:
        (folder / "repetitions.jsonl").write_bytes(
            b"".join(test_events.json.dumps(row).encode() + b"\n" for row in rows())
        )

        def once(data):
            """Either the bytes themselves, or a good text with changes that they choose."""
            content = data[1:] if data[:1] < b"\x40" else hostile.mutated(Bytes(data[1:]), valid, pieces)
            (folder / name).write_bytes(content)
            hostile.outcome(lambda: read(folder), name)

        for number, text in enumerate(valid):
            Path(found, str(number)).write_bytes(b"\0" + text.encode()[:4000])
        limits = [f"-runs={cases}", "-max_len=4096", "-timeout=60", "-rss_limit_mb=3000", "-verbosity=0", "-seed=20"]
        atheris.Setup([sys.argv[0], *limits, found], once)
        atheris.Fuzz()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
