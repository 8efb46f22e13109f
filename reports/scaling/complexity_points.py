"""Makes cells points of the study's equation 4.1: pixels p, order d, objects o, lights l, rays, time."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
import pandas as pd

from harness.statistics import fit
from reports.run import launch, reduced
from reports.run.cell import Cell
from reports.run.results import Results, grouped, point_label

FACTORS = "p", "d", "o", "l"
COUNTS = "primary", "reflected", "transmitted", "shadow"
FREE = "width", "height", "region", "depth", "frames", "least_frame"  # parameters that make a factor, or no difference
SWEPT = (*FREE, "side", "objects", "lights", "size", "processes")  # likewise, as an experiment spells them
LEAST = 5  # ranked cells of a series


@dataclass(frozen=True)
class Series:
    """Cells of one variant that differ in p, d, o and l alone.

    points: the ranked ones, one row each: scene, point, p, d, o, l, paths (primary, reflected and transmitted rays of
    a frame), rays (shadow rays too), depth (paths over primary rays: the effective depth), processes, seconds (median
    over processes) and noise (its relative standard error). What is not told is NaN.
    varied: the factors of more than one value. unranked: why others are not ranked, and how many. lacking: "" or why
    nothing can be fitted.
    """

    variant: str
    label: str
    points: pd.DataFrame
    varied: list[str]
    unranked: dict[str, int]
    lacking: str = ""


def series(results: Results) -> list[Series]:
    """Returns the series of a run, in its order; none if it does not vary two factors over LEAST cells of a variant."""
    # A picture of its own, a case, is no point of a sweep, and neither is a smaller model of a scene.
    groups = grouped(
        (cell for cell in results.cells if not (cell.apart or "case" in cell.swept or reduced.without(cell))),
        lambda cell: (cell.variant, launch.rest(cell, FREE)),
    )
    series = [member for cells in groups.values() if _is_meant(results, cells) for member in _by_method(results, cells)]
    return sorted(series, key=lambda member: results.variants.index(member.variant))


def _is_meant(results: Results, cells: list[Cell]) -> bool:
    """Does it vary at least two factors, one of them by a sweep? The scene stands for unknown numbers of objects and
    lights. Scenes that are merely beside each other differ in more than their numbers."""
    if len({repr([cell.swept.get(key) for key in SWEPT]) for cell in cells}) < 2:
        return False
    values = []
    for cell in cells:
        objects, lights = counts(results.records[cell.timed[0]] if cell.timed else None)
        scene = cell.scene, *(cell.swept.get(key) for key in ("objects", "lights", "size"))
        values.append((cell.pixels, cell.parameters["depth"], scene if objects is None else objects, lights))
    return len(cells) >= LEAST and sum(len(set(column)) > 1 for column in zip(*values, strict=True)) >= 2


def counts(record: dict | None) -> tuple[int | None, int | None]:
    """Returns the numbers of objects and lights; None if not known."""
    shapes, lights = (record or {}).get("shapes"), (record or {}).get("lights")
    return sum(shapes.values()) if shapes else None, lights


def _by_method(results: Results, cells: list[Cell]) -> list[Series]:
    """Returns one series, or one for each hierarchy used: with a tree the time does not grow with o."""
    unranked: Counter[str] = Counter()
    rows: dict[str, list[dict]] = {}
    for cell in cells:
        if cell.unranked:
            unranked[cell.unranked] += 1
            continue
        record = results.records[cell.good.index[0]]
        accel = ((record["used"] or {}).get("methods") or {}).get("accel") or ""
        rows.setdefault(accel, []).append(_row(cell, record))
    rows = rows or {"": []}
    return [
        _made(cells[0], f"accel = {accel}" if len(rows) > 1 else "", method_rows, unranked)
        for accel, method_rows in rows.items()
    ]


_COLUMNS = ("scene", "point", *FACTORS, "paths", "rays", "depth", "processes", "seconds", "noise")


def _row(cell: Cell, record: dict) -> dict:
    (objects, lights), rays, seconds = counts(record), record["rays"], cell.values("steady_s")
    row = {
        "scene": cell.scene, "point": cell.point, "p": cell.pixels, "d": cell.parameters["depth"], "o": objects,
        "l": lights,
        "processes": len(seconds), "seconds": float(np.median(seconds)), "noise": fit.noise(seconds),
    }  # fmt: skip
    if rays:
        paths = sum(rays[kind] for kind in COUNTS[:3])
        row |= {"paths": paths, "rays": paths + rays["shadow"], "depth": paths / rays["primary"]}
    return row


def _made(cell: Cell, method: str, rows: list[dict], unranked: dict[str, int]) -> Series:
    swept = {key: value for key, value in cell.swept.items() if key not in SWEPT}
    label = ", ".join(filter(None, [cell.variant, point_label(swept) if swept else "", method]))
    points = pd.DataFrame(rows, columns=_COLUMNS).astype(dict.fromkeys(_COLUMNS[2:], float))
    varied = [name for name in FACTORS if points[name].nunique() > 1]
    lacking = ""
    if len(points) < LEAST:
        lacking = f"{len(points)} ranked cell{'s' * (len(points) != 1)}, {LEAST} are needed"
    elif points[["o", "l"]].isna().any(axis=None):
        lacking = "the number of objects or of lights is not told"
    elif len(varied) < 2:
        lacking = f"of p, d, o and l only {' and '.join(varied) or 'none'} varies, two are needed"
    return Series(cell.variant, label, points, varied, unranked, lacking)
