"""Where methods fail: each row of the catalogue makes inputs under a stress that grows, and knows the truth."""

from functools import cache
from importlib import import_module

from harness.stress.row import Row

# The modules that have rows, in the order of the catalogue (docs: where methods fail).
MODULES = (
    "spheres", "huge", "ellipsoids", "scales", "acne", "leak", "drift", "cracks", "slivers", "slabs", "coincident",
    "polygons", "refraction", "media", "furnace", "highlight", "codes", "nan", "table", "threads", "pictures",
)  # fmt: skip


@cache
def rows() -> dict[str, Row]:
    """Every row of the catalogue by its name, in its order."""
    found = [row for module in MODULES for row in import_module(f"harness.stress.{module}").ROWS]
    return {row.name: row for row in found}
