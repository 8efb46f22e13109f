"""Picks the fastest measured method within an error, from the newest suitable run on this machine."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from harness.errors import UserError
from harness.store import store
from reports.accuracy import pareto
from reports.accuracy.pareto import Chart, Point
from reports.run import method, results
from reports.run.results import Results

# The needs of a picture that decide which methods suit it: the paths of light, and the lens.
OPTICS = {"reflection", "transmission", "attenuation", "glossy", "shadows", "soft", "lens"}
SHAPES = {"sphere", "box", "polygon", "ellipsoid", "mesh", "csg"}
OF_SCENE = method.Truth("scene", "enough")
REMEDY = "measure some first: rayrace run experiments/accuracy.toml"


@dataclass(frozen=True)
class Advice:
    """A method to use.

    name: of the method. parameters: its values by name. error: RMSE, linear RGB, from the truth of the scene. seconds:
    of a steady frame. like: the scene that both were measured with. run: its folder.
    """

    variant: str
    name: str
    parameters: dict
    error: float
    seconds: float
    like: str
    run: Path


@dataclass(frozen=True)
class Wanted:
    """A picture to render.

    scene: hash of its arrays. needs: of the picture with the best methods. given: methods that the user fixed, by
    name. variant: the one that the user fixed, or "".
    here: the identity of this machine.
    """

    scene: str
    needs: frozenset[str]
    given: dict
    variant: str
    here: dict[str, str]


def choose(folder: Path, wanted: Wanted, most: float, able: Callable[[str, dict], str | None]) -> Advice:
    """Returns the fastest method with an RMSE of at most `most`. able(variant, method): None, or why it cannot be used.

    UserError with a remedy if no run in `folder` measured a similar picture, its truth cannot tell, or no method is so
    accurate.
    """
    chart, loaded = _chart(folder, wanted)
    if most < chart.resolution:
        raise UserError(
            f"below {chart.resolution:.2g} the truth of {chart.view.label} in {loaded.folder} cannot tell",
            remedy="allow a larger error, or measure with a larger `times` in [reference]",
        )
    points = [point for point in chart.points if _agrees(point, wanted)]
    for point in sorted((p for p in points if p.error <= most), key=lambda point: point.time.value):
        chosen = method.of(point.cell)
        if able(point.cell.variant, chosen) is None:
            return Advice(
                point.cell.variant, point.name, chosen, max(point.error, chart.resolution), point.time.value,
                chart.view.label, loaded.folder,
            )  # fmt: skip
    best = min((point.error for point in points), default=None)
    why = "none of them is a method that you gave" if best is None else f"the most accurate has an RMSE of {best:.2g}"
    raise UserError(
        f"no method that {loaded.folder} measured with {chart.view.label} has an RMSE of {most:.3g} or less: {why}",
        remedy="allow a larger error, give fewer methods yourself, or measure more methods",
    )


def _chart(folder: Path, wanted: Wanted) -> tuple[Chart, Results]:
    """Returns the view most similar to the wanted picture, of the newest run that has one, and that run."""
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
        if method.truth(loaded) != OF_SCENE:
            continue
        alike = []
        for chart in pareto.charts(loaded):
            seen += 1
            records = [record for cell in chart.view.cells if (record := loaded.record(cell))]
            needs = {need for record in records for need in record["needs"]}
            if chart.points and needs & OPTICS == optics:
                same = any(record.get("scene_version") == wanted.scene for record in records)
                alike.append((same, -len((needs ^ wanted.needs) & SHAPES), len(chart.points), len(alike), chart))
        if alike:
            return max(alike)[-1], loaded
    raise UserError(
        f"no run in {folder} measured methods for a picture with {', '.join(sorted(optics)) or 'local light alone'}"
        " on this machine, with errors from the truth of the scene"
        + (f" (of {seen} views with errors)" if seen else ""),
        remedy=REMEDY,
    )


def _agrees(point: Point, wanted: Wanted) -> bool:
    given = {name: point.cell.parameters.get(name) for name in wanted.given}
    return given == wanted.given and wanted.variant in ("", point.cell.variant)
