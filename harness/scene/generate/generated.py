"""Generates scenes on request: as text for a file, or as a Scene without one."""

from dataclasses import replace
from functools import lru_cache

from harness.errors import UserError
from harness.scene import nff, text
from harness.scene.generate.comparison import comparison
from harness.scene.generate.icosphere import mirror, obj
from harness.scene.generate.knot import knot
from harness.scene.generate.lattice import lattice
from harness.scene.generate.spd import balls, tetra

# What each can be asked for, and how much of it there is by default.
COUNTS = {
    "comparison": {"objects": 48, "lights": 3},
    "balls": {"size": 4},
    "tetra": {"size": 6},
    "icosphere": {"size": 2},
}

# Who makes the text of each, how its file ends, and what it can be asked for.
TEXTS = {
    "comparison": (comparison, ".txt", {"spheres", "lights"}),
    "balls": (balls, ".nff", {"size"}),
    "tetra": (tetra, ".nff", {"size"}),
    "lattice": (lattice, ".txt", {"material", "radius"}),
    "knot": (knot, ".obj", set()),
    "icosphere": (obj, ".obj", {"size"}),
}


def written(name, file=None, **asked):
    """The text of a scene or mesh; None asks for the default. file: where it is to go.

    UserError if the file's name ends otherwise, or the generator has no such option.
    """
    if name not in TEXTS:
        raise UserError(f'no generator "{name}"; known: {", ".join(TEXTS)}')
    make, suffix, options = TEXTS[name]
    if file is not None and file.suffix.lower() != suffix:
        raise UserError(f"{file}: {name} is written as {suffix}; end the name with that")
    asked = {option: value for option, value in asked.items() if value is not None}
    for option in asked:
        if option not in options:
            raise UserError(f"--{option} is no option of {name}")
    return make(**asked)


def generated(name, **counts):
    """The `Scene` of a generator for all of its COUNTS. UserError for a count that it cannot have."""
    if name == "comparison":
        return replace(_half(counts["objects"], 0), lights=_half(0, counts["lights"]).lights)
    if name == "icosphere":  # in the view and the light of the comparison scene
        return replace(_half(0, 3), objects=(mirror(counts["size"]),))
    make = {"balls": balls, "tetra": tetra}[name]
    return nff.read(make(counts["size"]), f"generated/{name}.nff")


def count(name, **counts):
    """Objects that a ray is tried against, and lights, of what `generated` makes, told without making it."""
    if name == "comparison":
        return counts["objects"], counts["lights"]
    size = counts["size"]
    return {"balls": ((9 ** (size + 1) - 1) // 8 + 1, 3), "tetra": (4**size, 1), "icosphere": (20 * 4**size, 3)}[name]


@lru_cache(maxsize=256)
def _half(objects, lights):
    """A comparison scene without lights, or without objects: to read those is most of the work of a large sweep."""
    return text.read(comparison(objects, lights), "generated/comparison.txt")
