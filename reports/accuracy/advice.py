"""Picks the quickest measured method within an error, from the newest run of this machine that has one."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from harness.errors import UserError
from harness.store import store
from reports.accuracy import pareto
from reports.accuracy.pareto import Chart, Point
from reports.run import method, results
from reports.run.results import Results

# Needs that decide which methods a picture calls for: how light gets about, and through what it is looked at.
OPTICS = {"reflection", "transmission", "attenuation", "glossy", "shadows", "soft", "lens"}
SHAPES = {"sphere", "box", "polygon", "ellipsoid", "mesh", "csg"}
REMEDY = "measure some first: rayrace run experiments/accuracy.toml"


@dataclass(frozen=True)
class Advice:
    """parameters: of the method, by name. depth: of the truth that `error` is against; None: the picture's own.

    error: RMSE, linear RGB; seconds: of a steady frame; both as measured with the scene `like`. name: of the method.
    """

    variant: str
    name: str
    parameters: dict
    depth: int | None
    error: float
    seconds: float
    like: str
    run: Path


@dataclass(frozen=True)
class Wanted:
    """A picture that is to be made. scene: hash of its arrays. needs: of the picture with the best methods.

    centres: is it of the centres of pixels, and not of their areas? given: methods that are not open, by name.
    variant: "" or the only one that may make it. here: what tells machines apart, of this one.
    """

    scene: str
    needs: frozenset[str]
    centres: bool
    given: dict
    variant: str
    here: dict[str, str]


def choose(folder: Path, wanted: Wanted, most: float, able: Callable[[str, dict], str | None]) -> Advice:
    """The quickest method with an RMSE of `most` at the most. able(variant, method): None, or why it cannot be used.

    UserError, with what to do, if no run in `folder` has measured the like, or no method is so near to the truth.
    """
    chart, loaded = _chart(folder, wanted)
    points = [point for point in chart.points if _agrees(point, wanted)]
    for point in sorted((p for p in points if p.error <= most), key=lambda point: point.time.value):
        told = method.of(point.cell)
        if able(point.cell.variant, told) is None:
            return Advice(
                point.cell.variant, point.name, told, method.truth_depth(loaded), max(point.error, chart.resolution),
                point.time.value, chart.view.label, loaded.folder,
            )  # fmt: skip
    best = min((point.error for point in points), default=None)
    told = "and none of them is what was asked for" if best is None else f"the nearest has an RMSE of {best:.2g}"
    raise UserError(
        f"no method that {loaded.folder} measured with {chart.view.label} has an RMSE of {most:.3g} or less: {told}",
        remedy="ask for less, give fewer methods yourself, or measure more of them",
    )


def _chart(folder: Path, wanted: Wanted) -> tuple[Chart, Results]:
    """The view that is most like the wanted picture, of the newest run that has one; and that run."""
    optics, seen = wanted.needs & OPTICS, 0
    for run in sorted(folder.glob("*/run.json"), key=lambda path: path.stat().st_mtime, reverse=True):
        try:
            facts, _ = store.read(run.parent)
        except UserError:  # of another format, or damaged
            continue
        machine = facts.get("environment", {})
        if not facts.get("cells") or any(machine.get(name) != value for name, value in wanted.here.items()):
            continue
        loaded = results.load(run.parent)
        alike = []
        for chart in pareto.charts(loaded):
            seen += 1
            needs = {need for cell in chart.view.cells for need in _needs(loaded, cell)}
            centres = all(cell.parameters.get("sampler", "one") == "one" for cell in chart.view.cells)
            if chart.points and centres == wanted.centres and needs & OPTICS == optics:
                same = any(_version(loaded, cell) == wanted.scene for cell in chart.view.cells)
                alike.append((same, -len((needs ^ wanted.needs) & SHAPES), len(chart.points), len(alike), chart))
        if alike:
            return max(alike)[-1], loaded
    raise UserError(
        f"no run in {folder} has measured methods for a picture with {', '.join(sorted(optics)) or 'local light alone'}"
        f" {'at the centres' if wanted.centres else 'over the areas'} of pixels on this machine"
        + (f" (of {seen} views with errors)" if seen else ""),
        remedy=REMEDY,
    )


def _needs(loaded: Results, cell) -> list[str]:
    record = loaded.record(cell)
    return record["needs"] if record else []


def _version(loaded: Results, cell) -> str | None:
    record = loaded.record(cell)
    return record and record.get("scene_version")


def _agrees(point: Point, wanted: Wanted) -> bool:
    told = {**point.cell.parameters, "variant": point.cell.variant}
    given = {**wanted.given, **({"variant": wanted.variant} if wanted.variant else {})}
    return all(told.get(name) == value for name, value in given.items())
