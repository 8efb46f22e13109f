"""Draws what each leave-out is worth: the error without it beside the time of a frame."""

import textwrap
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from harness.statistics.change import SURE
from harness.statistics.statistics import NOT_RESOLVED
from reports.paper import style

ROW, LEAST = 0.24, 2.5  # inches: of a bar, and of the whole figure at least
LETTERS = 40  # of a line of a name, of which there are two at most
MOST = 44  # bars, for a figure of 12 inches
BAR, PALE = "#0072B2", "#B8D4E8"
KINDS = {"changes the picture": BAR, "changes no pixel (measured)": "#E69F00", "needs none of it (proved)": "#009E73"}


def write(path: Path, rows: list[dict], rmse: float) -> None:
    """Writes the figure to `path`, whose suffix matplotlib knows. rows: records of the leave-outs, the largest error
    first; those without a picture are left out. rmse: of the full model."""
    with style.styled():
        figure = draw([row for row in rows if "unavailable" not in row], rmse)
        style.save_as(figure, path)
        plt.close(figure)


def draw(rows: list[dict], rmse: float) -> Figure:
    """Draws the first MOST rows, and says of how many. A row without a time has no bar of it."""
    count, rows = len(rows), rows[:MOST]
    size = 8, max(LEAST, 1.4 + ROW * len(rows))
    figure, (errors, times) = plt.subplots(1, 2, sharey=True, figsize=size, layout="constrained")
    places, kinds = range(len(rows)), list(map(_kind, rows))
    errors.barh(places, [row["error"]["rmse"] for row in rows], color=[KINDS[kind] for kind in kinds])
    for place, row in enumerate(rows):
        middle, half = row["error"]["rmse"], SURE * row["error"].get("rmse_standard_error", 0.0)
        errors.plot([max(0.0, middle - half), middle + half], [place, place], color="black", linewidth=1)
    errors.axvline(rmse, color="black", linewidth=1)
    errors.set_xlabel(f"RMSE, ± {SURE} standard errors\nline: full model")
    names = [textwrap.fill(row["left_out"], LETTERS, max_lines=2, placeholder=" ..") for row in rows]
    errors.set_yticks(places, names, fontsize=6.5)
    errors.set_ylim(len(rows) - 0.5, -0.5)
    for place, row in enumerate(rows):
        if "ratio" not in row["time"]:
            continue
        ratio = row["time"]
        times.barh(place, ratio["ratio"], color=PALE if ratio["verdict"] == NOT_RESOLVED else BAR)
        if ratio["low"] is not None:
            times.plot([ratio["low"], ratio["high"]], [place, place], color="black", linewidth=1)
    times.axvline(1, color="black", linewidth=1)
    times.set_xlabel("time of a frame, full model = 1\n95 % interval; pale: not resolved")
    if count > MOST:
        style.entitle(figure, f"The {MOST} largest errors of {count}")
    shown = [Patch(color=colour, label=name) for name, colour in KINDS.items() if name in kinds]
    figure.legend(handles=shown, loc="outside lower left", ncols=len(shown))
    return figure


def _kind(row: dict) -> str:
    """What was proved is told apart from what was measured."""
    if row["proof"]:
        return "needs none of it (proved)"
    return "changes the picture" if row["pixels"] else "changes no pixel (measured)"
