"""Says swept values, and what errors are held against, in words."""

import re
from collections.abc import Iterable

DEPTH = re.compile(r"((?:(?!at depth ).)*)at depth (\d+)")
PLURALS = "objects", "lights", "frames", "rays", "spots"


def spoken(key: str, value) -> str:
    """Returns a swept value in words: "192 objects", "one pixel", "depth 3"."""
    if key == "case" or (key, value) == ("region", "one pixel"):
        return str(value)
    if (key, value) == ("region", "all"):
        return "all pixels"
    if key == "side":
        return f"{value} × {value}"
    if key in PLURALS:
        return f"{value} {key[:-1] if value == 1 else key}"
    return f"{key.replace('_', ' ')} {value}"


def of_point(point: dict) -> str:
    """Returns swept values in words: "192 objects, depth 3"."""
    return ", ".join(spoken(key, value) for key, value in point.items())


def all_against(against: Iterable[str], between: str = " and ") -> str:
    """Returns what errors are held against, in one phrase; "" where all are held against the truth of the scene.

    against: of each cell, in words (harness/store/record.py). What differs in its depth alone is named once.
    """
    depths_by_text: dict[str, list[int]] = {}
    for text in dict.fromkeys(filter(None, against)):
        match = DEPTH.fullmatch(text)
        depths_by_text.setdefault(match[1] if match else text, []).extend([int(match[2])] if match else [])
    return between.join(f"{words}{_depths(depths)}" for words, depths in depths_by_text.items())


def _depths(depths: list[int]) -> str:
    if len(depths) < 2:
        return "".join(f"at depth {depth}" for depth in depths)
    return f"at depths from {min(depths)} to {max(depths)}"
