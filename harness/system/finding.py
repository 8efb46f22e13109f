"""Defines a finding of the doctor about one property of a machine, and reads files of the system."""

from dataclasses import dataclass
from pathlib import Path

UNAVAILABLE = "unavailable: "


@dataclass(frozen=True)
class Finding:
    """verdict: good, doubtful (it may spoil measurements) or unknown. what: the property; value: of it."""

    verdict: str
    what: str
    value: str
    remedy: str = ""


def unknown(what: str, why: str, remedy: str = "") -> Finding:
    """A finding without a value. why: the reason, with or without "unavailable: "."""
    return Finding("unknown", what, why if why.startswith(UNAVAILABLE) else UNAVAILABLE + why, remedy)


def judged(good: bool, what: str, value: str, remedy: str) -> Finding:
    """A finding that is good, or doubtful with a remedy."""
    return Finding("good", what, value) if good else Finding("doubtful", what, value, remedy)


def read(path: Path) -> str | None:
    """The stripped text of a file; None if it cannot be read."""
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return None
