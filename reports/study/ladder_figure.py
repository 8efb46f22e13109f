"""Draws a ladder as a waterfall: a bar from the time of a rung to that of the next, on a logarithmic axis."""

import textwrap

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from harness.statistics.statistics import Estimate
from reports.paper import quantity, style
from reports.run.results import Missing
from reports.study.ladder import Climb

ROW, LEAST = 0.36, 2.2  # inches: of a rung, and of the whole figure at least
MOST = 28  # rungs
FASTER, SLOWER, STUDY = "#0072B2", "#D55E00", "#B0B0B0"
NAME = 34  # letters of a line


def draw(climb: Climb) -> Figure:
    """Draws the first MOST timed rungs of a ladder, below the study's time if it has one."""
    steps = climb.timed[:MOST]
    rows = [(f"{step.name} ({step.variant})", step) for step in steps]
    of_study = isinstance(climb.published, Estimate)
    height = max(LEAST, 1.3 + ROW * (len(rows) + of_study))
    figure, axes = plt.subplots(figsize=(7.4, height), layout="constrained")
    names, texts, ends = [], [], []
    if of_study:
        names.append("the study's time, by pixels:\nthe machine's and whatever else")
        first = steps[0].time.value
        low, high = sorted((climb.published.value, first))
        axes.barh(0, high - low, left=low, height=0.6, color="white", edgecolor=STUDY, hatch="////")
        axes.plot(climb.published.value, 0, "o", color=STUDY, ms=4)
        texts.append(f"{quantity.times(climb.rest)} (estimate)")
        ends += [low, high]
    for row, (name, step) in enumerate(rows, start=int(of_study)):
        names.append(textwrap.fill(name, NAME))
        now = step.time.value
        before = steps[row - of_study - 1].time.value if row > of_study else now
        low, high = sorted((now, before))
        axes.barh(row, high - low, left=low, height=0.6, color=FASTER if now <= before else SLOWER)
        axes.plot(now, row, "o", color="black", ms=3)
        if step.time.low is not None:
            axes.plot([step.time.low, step.time.high], [row, row], color="black", lw=1)
        texts.append(quantity.times(step.factor) if step.factor else quantity.seconds(step.time))
        ends += [low, high]
    axes.set_xscale("log")
    axes.set_xlim(min(ends) / 2, max(ends) * 2)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_yticks(range(len(names)), names)
    beside = axes.secondary_yaxis("right")
    beside.set_yticks(range(len(texts)), texts)
    beside.tick_params(length=0)
    beside.spines["right"].set_visible(False)
    axes.grid(axis="x", color="#EEEEEE")
    style.log_ticks(axes.xaxis)
    axes.set_xlabel("time of a frame (s)")
    style.entitle(figure, _title(climb))
    return figure


def _title(climb: Climb) -> str:
    if isinstance(climb.accounted, Missing):
        return f"{climb.name}: {climb.accounted}"
    measured, product = quantity.times(climb.whole), quantity.times(climb.product)
    return f"{climb.name}: first over last rung {measured}; product of the rungs {product}"
