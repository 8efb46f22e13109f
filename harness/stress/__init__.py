"""The catalogue of failures: each row generates inputs of growing stress and judges results by their truth."""

from functools import cache
from importlib import import_module

from harness.stress.row import Row

# The modules with rows, in the order of the catalogue (docs: where methods fail).
MODULES = (
    "geometry.spheres", "geometry.huge", "geometry.ellipsoids", "geometry.scales", "light.acne", "light.leak",
    "execution.drift", "geometry.cracks", "geometry.slivers", "geometry.slabs", "geometry.coincident",
    "geometry.stepping", "geometry.polygons", "light.refraction", "light.media", "light.furnace", "light.highlight",
    "light.samples", "light.codes", "light.nan", "execution.table", "execution.threads", "pictures",
)  # fmt: skip


@cache
def rows() -> dict[str, Row]:
    """The rows of the catalogue by name, in order."""
    catalogue = [row for module in MODULES for row in import_module(f"harness.stress.{module}").ROWS]
    return {row.name: row for row in catalogue}
