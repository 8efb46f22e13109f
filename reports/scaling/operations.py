"""Counts the floating-point operations of a frame's ray-sphere tests."""

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.run import gpu
from reports.run.results import Cell, Missing, Results

# Of a test that misses: centre to origin 3, its two dots 5 + 5, the nearest point 6, the discriminant 1 (SPH-1).
FLOPS = 20
NO_TIME = "the time of the kernel is not reported"
CAPTION = (
    f"Tests: rays of a frame (primary, reflected, transmitted, shadow) × spheres. Floating-point operations: {FLOPS} "
    "per test, as for a ray that misses (3 for centre to origin, 5 + 5 for two dot products, 6 for the nearest point, "
    "1 for the discriminant); square roots and divisions of hits and all shading are left out. The number of tests is "
    "an upper bound: a shadow feeler may stop at the first sphere it meets, and a sphere that a cone or a bounding "
    "sphere excludes is counted, but not tested. "
    "C++ and Numba one ray after another need 16 operations for most misses."
)


def rate(results: Results, cell: Cell, column: str) -> Estimate | Missing:
    """Returns the floating-point operations per second over the times in `column`, median over processes."""
    count = tests(results, cell)
    if isinstance(count, Missing):
        return count
    times = cell.values(column)
    return statistics.median([FLOPS * count / seconds for seconds in times]) if times else Missing(NO_TIME)


def tests(results: Results, cell: Cell) -> float | Missing:
    """Returns an upper bound of the ray-sphere tests of a frame."""
    record = gpu.record(results, cell)
    shapes = (record or {}).get("shapes")
    if cell.simulated:
        return Missing("the CUDA simulator runs on the processor and has no peak to compare with")
    if cell.unranked:
        return Missing(f"not ranked: {cell.unranked}")
    if not shapes or not record["rays"]:
        return Missing("its shapes or rays are not reported")
    if any(count for name, count in shapes.items() if name != "sphere"):
        return Missing("it has shapes other than spheres, whose tests are not counted here")
    accel = gpu.method(results, cell, "accel")
    if accel != "none":
        return Missing(
            f"accel is {accel}: a tree is used, and rays are tested against fewer shapes"
            if isinstance(accel, str)
            else "it does not report whether a tree is used"
        )
    return sum(record["rays"][kind] for kind in ("primary", "reflected", "transmitted", "shadow")) * shapes["sphere"]
