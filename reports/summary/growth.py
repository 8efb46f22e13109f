"""Says in a sentence what a sweep asks: how a frame's time grows from one end of each swept number to the other."""

from harness.statistics.digits import plain
from reports.run.results import Results, grouped
from reports.scaling import sweep
from reports.scaling.sweep import TIME, Line, Panel

FEW = 3  # values of a number that a run sweeps; fewer are cases
AT = "pixels", "depth"  # axes of which a frame is at a value; it has objects, lights and rays
WORK = (*AT, "objects", "lights", "rays")  # axes of which there is more work with more of them


def gist(results: Results) -> str:
    """Returns the sentence: by number the line that grows least and the one that grows most; "" without a sweep."""
    by_axis = grouped((panel for panel in sweep.panels(results) if panel.axis.name in WORK), lambda panel: panel.axis)
    phrases = [phrase for panels in by_axis.values() if (phrase := _phrase(max(panels, key=_points)))]
    return f"A frame takes {'; '.join(phrases)}." if phrases else ""


def _points(panel: Panel) -> int:
    return sum(len(line.points(TIME)) for line in panel.lines)


def _phrase(panel: Panel) -> str:
    """Returns "9.1 (numpy) to 62 times (cpp) as long at 512 × 512 pixels as at 64 × 64".

    "" of fewer than FEW values.
    """
    values = panel.values
    growths = sorted((growth, line.label) for line in panel.lines if (growth := _growth(line, values)) is not None)
    if len(values) < FEW or panel.mark or not growths:
        return ""
    (least, slow), (most, fast) = growths[0], growths[-1]
    few = f"{plain(least, 2)} ({slow}) to " * (len(growths) > 1)
    first, last = panel.words(values[0]).removesuffix(f" {panel.axis.unit}"), panel.words(values[-1])
    at = "at" if panel.axis.name in AT else "with"
    return f"{few}{plain(most, 2)} times ({fast}) as long {at} {last} as {at} {first}"


def _growth(line: Line, values: list[float]) -> float | None:
    """Returns the time at the last value over that at the first; None if one of them has none."""
    times = dict(line.points(TIME))
    if values[0] not in times or values[-1] not in times:
        return None
    return times[values[-1]].value / times[values[0]].value
