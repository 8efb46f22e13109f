"""A finding of the doctor about one property of a machine."""

from dataclasses import dataclass
from pathlib import Path

UNAVAILABLE = "unavailable: "


@dataclass(frozen=True)
class Finding:
    """verdict: good, doubtful (it may spoil a measurement) or unknown (the system does not tell)."""

    verdict: str
    what: str
    found: str
    remedy: str = ""


def unknown(what: str, why: str, remedy: str = "") -> Finding:
    return Finding("unknown", what, why if why.startswith(UNAVAILABLE) else UNAVAILABLE + why, remedy)


def judged(good: bool, what: str, found: str, remedy: str) -> Finding:
    """Good, or doubtful with what to do about it."""
    return Finding("good", what, found) if good else Finding("doubtful", what, found, remedy)


def read(path: Path) -> str | None:
    """The text of a file of the system; None if it cannot be read."""
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return None
