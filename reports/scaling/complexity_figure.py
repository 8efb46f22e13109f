"""Draws measured against modelled time of a series, and how far the models are off against each factor."""

import matplotlib.pyplot as plt
import numpy as np

from harness.statistics.digits import percentage
from reports.paper import style, thinning
from reports.scaling.complexity_models import COUNTED, ORDERS, STUDY, Fitted
from reports.scaling.complexity_text import FAIR, GOOD

MARKS = {STUDY: ("#D55E00", "o"), ORDERS: ("#56B4E9", "s"), COUNTED: ("#005C43", "^")}
NAMES = {"p": "pixels p", "d": "order d", "o": "objects o", "l": "lights l"}
LABELS = 4  # that have room below a panel of four


def draw(fit: Fitted):
    """Draws a series with at least one fit."""
    varied = fit.series.varied
    models = [model for model in MARKS if fit.line(model)]
    figure = plt.figure(figsize=(7.2, 5.4), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=(1.1, 1))
    _times(upper.subplots(1, len(models), sharex=True, sharey=True, squeeze=False)[0], fit, models)
    _errors(lower.subplots(1, len(varied), sharey=True, squeeze=False)[0], fit, models)
    handles = [plt.Line2D([], [], ls="", color=colour, marker=mark, ms=4) for colour, mark in map(MARKS.get, models)]
    figure.legend(handles, [f"a + b·{model}" for model in models], loc="outside lower center", ncols=len(models))
    figure.suptitle(fit.series.label, x=0.01, ha="left", fontsize=8)
    return figure


def _times(row, fit: Fitted, models: list[str]) -> None:
    seconds = fit.series.points["seconds"]
    ends = np.array([seconds.min() / 1.5, seconds.max() * 1.5])
    for axes, model in zip(row, models, strict=True):
        modelled = seconds * (1 + fit.errors[model])
        some = modelled > 0  # a line with a negative a has times that no logarithmic axis shows
        axes.fill_between(ends, ends * (1 - FAIR), ends * (1 + FAIR), color="#EEEEEE", lw=0)
        axes.plot(ends, ends, color="#888888", lw=0.8)
        colour, mark = MARKS[model]
        axes.plot(seconds[some], modelled[some], mark, color=colour, ms=3.5, mew=0, alpha=0.8)
        axes.set(xscale="log", yscale="log", xlabel="measured (s)")
        axes.set_title(f"a + b·{model}\nspread {percentage(fit.line(model).spread)}", fontsize=7)
        for axis in (axes.xaxis, axes.yaxis):
            style.log_ticks(axis)
        axes.grid(color="#CCCCCC")
    row[0].set_ylabel("modelled (s)")


def _errors(row, fit: Fitted, models: list[str]) -> None:
    points = fit.series.points
    for axes, name in zip(row, fit.series.varied, strict=True):
        axes.axhspan(-100 * FAIR, 100 * FAIR, color="#EEEEEE", lw=0)
        axes.axhspan(-100 * GOOD, 100 * GOOD, color="#DDDDDD", lw=0)
        axes.axhline(0, color="#888888", lw=0.8)
        for number, model in enumerate(models):
            colour, mark = MARKS[model]
            # side by side, so that none hides another
            at = points[name] * 1.07 ** (number - (len(models) - 1) / 2)
            axes.plot(at, 100 * fit.errors[model], mark, color=colour, ms=3.5, mew=0, alpha=0.8)
        values = sorted(points[name].unique())
        if values[0] > 0:
            axes.set_xscale("log")
        else:
            axes.set_xscale("symlog", linthresh=1)
        named = thinning.few(values, LABELS)
        axes.set_xticks(values, [_short(value) if value in named else "" for value in values])
        axes.minorticks_off()
        axes.set_xlabel(NAMES[name])
        axes.grid(axis="y", color="#CCCCCC")
    row[0].set_ylabel("modelled over measured - 1 (%)")


def _short(value: float) -> str:
    """Returns a count as text; a square of three digits or more by its side."""
    side = round(value**0.5)
    return f"{side}²" if value > 99 and side**2 == value else f"{value:g}"
