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

# The counts of each scene, and their defaults.
COUNTS = {
    "comparison": {"objects": 48, "lights": 3},
    "balls": {"size": 4},
    "tetra": {"size": 6},
    "icosphere": {"size": 2},
}

# The function that makes each text, the suffix of its file, and its options.
TEXTS = {
    "comparison": (comparison, ".txt", {"spheres", "lights"}),
    "balls": (balls, ".nff", {"size"}),
    "tetra": (tetra, ".nff", {"size"}),
    "lattice": (lattice, ".txt", {"material", "radius"}),
    "knot": (knot, ".obj", set()),
    "icosphere": (obj, ".obj", {"size"}),
}


def written(name, file=None, **values):
    """The text of a scene or mesh. file: where it will be written, or None; values: options, None for the default.

    UserError for an unknown generator or option, or if the file has another suffix.
    """
    if name not in TEXTS:
        raise UserError(f'no generator "{name}"; known: {", ".join(TEXTS)}')
    make, suffix, options = TEXTS[name]
    if file is not None and file.suffix.lower() != suffix:
        raise UserError(f"{file}: {name} is written as {suffix}; give the file that suffix")
    values = {option: value for option, value in values.items() if value is not None}
    for option in values:
        if option not in options:
            raise UserError(f"--{option} is not an option of {name}")
    return make(**values)


def generated(name, **counts):
    """The `Scene` of a generator. counts: all of its COUNTS. UserError for a count out of range."""
    if name == "comparison":
        return replace(_half(counts["objects"], 0), lights=_half(0, counts["lights"]).lights)
    if name == "icosphere":  # in the view and the light of the comparison scene
        return replace(_half(0, 3), objects=(mirror(counts["size"]),))
    make = {"balls": balls, "tetra": tetra}[name]
    return nff.read(make(counts["size"]), f"generated/{name}.nff")


def count(name, **counts):
    """(objects that a ray is tested against, lights) of a scene of `generated`, without generating it."""
    if name == "comparison":
        return counts["objects"], counts["lights"]
    size = counts["size"]
    return {"balls": ((9 ** (size + 1) - 1) // 8 + 1, 3), "tetra": (4**size, 1), "icosphere": (20 * 4**size, 3)}[name]


@lru_cache(maxsize=256)
def _half(objects, lights):
    """A comparison scene without lights, or without objects; cached, as parsing it takes most time of a large sweep."""
    return text.read(comparison(objects, lights), "generated/comparison.txt")
