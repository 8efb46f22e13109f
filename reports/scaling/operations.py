"""Tells the floating-point operations of a frame and the bytes that it moves."""

import numpy as np

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.run import gpu, launch
from reports.run.results import Cell, Missing, Results

# Of a test that misses: centre to origin 3, its two dots 5 + 5, the nearest point 6, the discriminant 1 (SPH-1).
FLOPS = 20
LINE = 64  # bytes that a miss of the last cache brings
COUNTED = "sums", "products", "divisions", "roots"
BYTES = {"float64": 8, "float32": 4}
# In these the cells of one picture may differ, however they make it.
FREE = (
    *("vector", "precision", "epsilon", "threads", "frames", "least_frame", "accel", "walk", "kernel"),
    *launch.UNSEEN,
)
NO_TIME = "the time of the kernel is not reported"
CAPTION = (
    "Floating-point operations: sums, products, divisions and roots of a frame. A run that counts ([measure] count) "
    "has them from a build of the readable C++ whose numbers count what is done with them: all shapes, all of the "
    "light model, but no powers and sines; what lanes or another search save is not taken off. Else, for spheres "
    f"without a tree, they are rays (primary, reflected, transmitted, shadow) × spheres × {FLOPS}, as for a ray that "
    "misses, without shading; a sphere that a cone excludes, or that a feeler does not come to, is in them. Bytes "
    f"moved: misses of the last cache × {LINE} where perf counts them, else the working set, the scene and the picture "
    "once a frame."
)


def rate(results: Results, cell: Cell, column: str) -> Estimate | Missing:
    """Returns the floating-point operations per second over the times in `column`, median over processes."""
    count = flops(results, cell)
    if isinstance(count, Missing):
        return count
    times = cell.values(column)
    return statistics.median([count / seconds for seconds in times]) if times else Missing(NO_TIME)


def flops(results: Results, cell: Cell) -> float | Missing:
    """Returns the floating-point operations of a frame: those counted of the same picture, else those of its tests."""
    if cell.simulated:
        return Missing("the CUDA simulator runs on the processor and has no peak to compare with")
    if cell.unranked:
        return Missing(f"not ranked: {cell.unranked}")
    counted = _counted(results, cell)
    if counted is not None:
        return float(sum(counted[name] for name in COUNTED))
    tests = _tests(results, cell)
    return tests if isinstance(tests, Missing) else FLOPS * tests


def _counted(results: Results, cell: Cell) -> dict | None:
    """Returns the operations that were counted of the picture of a cell; its own, or those in its precision, first."""

    def picture(other: Cell) -> tuple:
        return other.scene, launch.counts(other), launch.rest(other, FREE)

    def far(other: Cell) -> tuple:
        return other is not cell, other.parameters["precision"] != cell.parameters["precision"]

    wanted = picture(cell)
    counted = [
        (other, counts) for other in results.cells if (counts := results.operations(other)) and picture(other) == wanted
    ]
    return min(counted, key=lambda pair: far(pair[0]), default=(None, None))[1]


def _tests(results: Results, cell: Cell) -> float | Missing:
    """Returns an upper bound of the ray-sphere tests of a frame."""
    record = gpu.record(results, cell)
    shapes = (record or {}).get("shapes")
    if not shapes or not record["rays"]:
        return Missing("its shapes or rays are not reported")
    if any(count for name, count in shapes.items() if name != "sphere"):
        return Missing("it has shapes other than spheres, and the run counted no operations (measure.count)")
    accel = gpu.method(results, cell, "accel")
    if accel != "none":
        return Missing(
            f"accel is {accel}: a tree is used, and the run counted no operations (measure.count)"
            if isinstance(accel, str)
            else "it does not report whether a tree is used"
        )
    return sum(record["rays"][kind] for kind in ("primary", "reflected", "transmitted", "shadow")) * shapes["sphere"]


def moved(results: Results, cell: Cell) -> float | Missing:
    """Returns the bytes that a frame moves to and from memory: from counters, else its working set."""
    counts = results.counts(cell)
    if not isinstance(counts, Missing) and counts.get("cache_misses") and not counts["smaller"]:
        return LINE * counts["cache_misses"]
    size = BYTES.get(cell.parameters["precision"])
    if size is None:
        return Missing("the size of its numbers is not known")
    scene = (gpu.record(results, cell) or {}).get("scene_bytes") or 0  # runs before 0.2 do not tell
    return 3 * size * cell.pixels + scene * size / np.dtype(np.float64).itemsize
