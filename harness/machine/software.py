"""Compares rayrace, Python and packages between the hosts of one run."""

import hashlib
from functools import cache
from pathlib import Path

from harness.machine import environment, fingerprint

NAMES = "rayrace", "python", "packages"


def here() -> dict:
    """The versions in this process. rayrace: a hash of the harness's sources, as its version may not change."""
    return {"rayrace": _own(), "python": environment.python(), "packages": environment.packages()}


@cache
def _own() -> str:
    folder = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.suffix in (".py", ".cpp"):
            digest.update(f"{path.relative_to(folder)}\0".encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def differences(wanted: dict, present: dict) -> list[str]:
    """A line for each value of `present` that differs from `wanted`."""
    return [
        f"{name} is {new} here, {old} where it was submitted"
        for name, old, new in fingerprint.changes(wanted, present, NAMES)
    ]
