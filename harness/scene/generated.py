"""Scenes that are generated when they are asked for, without a file between."""

from dataclasses import replace
from functools import lru_cache

from harness.scene import nff, text
from harness.scene.generate import comparison
from harness.scene.generate_spd import balls, tetra

# What each can be asked for, and how much of it there is by default.
COUNTS = {"comparison": {"objects": 48, "lights": 3}, "balls": {"size": 4}, "tetra": {"size": 6}}


def generated(name, **counts):
    """The `Scene` of a generator for all of its COUNTS. UserError for a count that it cannot have."""
    if name == "comparison":
        return replace(_half(counts["objects"], 0), lights=_half(0, counts["lights"]).lights)
    make = {"balls": balls, "tetra": tetra}[name]
    return nff.read(make(counts["size"]), f"generated/{name}.nff")


@lru_cache(maxsize=256)
def _half(objects, lights):
    """A comparison scene without lights, or without objects: to read those is most of the work of a large sweep."""
    return text.read(comparison(objects, lights), "generated/comparison.txt")
