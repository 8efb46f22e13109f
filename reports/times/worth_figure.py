"""Draws what each leave-out of `rayrace needs` is worth: the error without it beside the time of a frame."""

from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from harness.statistics.statistics import NOT_RESOLVED
from reports.paper import style

ROW, LEAST = 0.24, 2.5  # inches: of a bar, and of the whole figure at least
MOST = 44  # bars, for a figure of 12 inches
BAR, PALE = "#0072B2", "#B8D4E8"


def write(path: Path, rows: list[dict], rmse: float) -> None:
    """Writes the figure to `path`, whose suffix matplotlib knows. rows: records of the leave-outs, the largest error
    first; those without a picture are left out. rmse: of the full model."""
    with style.styled():
        figure = draw([one for one in rows if "unavailable" not in one], rmse)
        figure.savefig(path)
        plt.close(figure)


def draw(rows: list[dict], rmse: float) -> Figure:
    """Draws the first MOST rows, and says of how many."""
    count, rows = len(rows), rows[:MOST]
    size = 8, max(LEAST, 1.2 + ROW * len(rows))
    figure, (errors, times) = plt.subplots(1, 2, sharey=True, figsize=size, layout="constrained")
    places = range(len(rows))
    errors.barh(places, [one["error"]["rmse"] for one in rows], color=BAR)
    errors.axvline(rmse, color="black", linewidth=1)
    errors.set_xlabel("RMSE from the truth of the full scene\nline: full model")
    errors.set_yticks(places, [one["left_out"] for one in rows])
    errors.set_ylim(len(rows) - 0.5, -0.5)
    ratios = [one["time"] for one in rows]
    resolved = [ratio["verdict"] != NOT_RESOLVED for ratio in ratios]
    times.barh(places, [ratio["ratio"] for ratio in ratios], color=[BAR if one else PALE for one in resolved])
    for place, ratio in zip(places, ratios, strict=True):
        if ratio["low"] is not None:
            times.plot([ratio["low"], ratio["high"]], [place, place], color="black", linewidth=1)
    times.axvline(1, color="black", linewidth=1)
    if count > MOST:
        style.entitle(figure, f"The {MOST} largest errors of {count}")
    times.set_xlabel("time of a frame, full model = 1\n95 % interval; pale: not resolved")
    return figure
