"""The seed of covering arrays and random scenes, which differs from commit to commit."""

import functools
import hashlib
import os
import subprocess
from pathlib import Path

import numpy as np

VARIABLE = "RAYRACE_SEED"
DEFAULT = "rayrace"  # where there is no git: an unpacked archive


@functools.cache
def seed() -> str:
    """RAYRACE_SEED, else the commit's first 12 digits, else DEFAULT. A string, which random.Random takes."""
    told = os.environ.get(VARIABLE)
    if told:
        return told
    try:
        asked = ["git", "rev-parse", "--short=12", "HEAD"]
        return subprocess.run(
            asked, cwd=Path(__file__).parent, capture_output=True, text=True, check=True
        ).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return DEFAULT


def again(test: str, **variables: object) -> str:
    """The command that repeats the test with the id `test`, with this seed and these environment variables."""
    told = {VARIABLE: seed(), **variables}
    return " ".join([*(f"{name}={value}" for name, value in told.items()), f".venv/bin/pytest -s {test!r}"])


def numbers(*which: object) -> list[int]:
    """A seed of a NumPy generator, another one for each `which`."""
    digest = hashlib.sha256(repr((seed(), *which)).encode()).digest()
    return list(np.frombuffer(digest, np.uint32))
