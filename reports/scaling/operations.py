"""Counts the floating-point operations of a frame's ray-sphere tests."""

from reports.run import gpu
from reports.run.results import Cell, Missing, Results

FLOPS = 20  # of a test that misses: centre to origin 3, its two dots 5 + 5, the nearest point 6, the discriminant 1
CAPTION = (
    f"Tests: rays of a frame (primary, reflected, transmitted, shadow) × spheres. Floating-point operations: {FLOPS} a "
    "test, those of a ray that misses (3 for centre to origin, 5 + 5 for two dot products, 6 for the nearest point, 1 "
    "for the discriminant); square roots and divisions of hits, and all shading, are left out. The number of tests is "
    "an upper bound: a shadow feeler may stop at the first sphere it meets, and what a cone or a bounding sphere shows "
    "to be out of reach is not tested but counts as if it had been."
)


def tests(results: Results, cell: Cell) -> float | Missing:
    """Tests of a frame, at most."""
    record = gpu.record(results, cell)
    shapes = (record or {}).get("shapes")
    if cell.simulated:
        return Missing("the CUDA simulator runs on the processor: it has no peak to be compared with")
    if cell.unranked:
        return Missing(f"not ranked: {cell.unranked}")
    if not shapes or not record["rays"]:
        return Missing("its shapes or rays are not told")
    if any(count for name, count in shapes.items() if name != "sphere"):
        return Missing("it has shapes other than spheres, whose tests are not counted here")
    accel = gpu.method(results, cell, "accel")
    if accel != "none":
        return Missing(
            f"accel is {accel}: a tree is used, and rays are tried against fewer shapes"
            if isinstance(accel, str)
            else "it does not tell whether a tree is used"
        )
    return sum(record["rays"][kind] for kind in ("primary", "reflected", "transmitted", "shadow")) * shapes["sphere"]
