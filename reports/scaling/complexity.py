"""Fits the study's equation 4.1, T = a + b p d (o + l), to each variant of a run that varies at least two factors."""

from functools import lru_cache
from pathlib import Path

import pandas as pd

from harness.statistics.fit import Coefficient
from reports.paper import markdown, quantity, style, table
from reports.run.cell import Missing
from reports.run.results import Results
from reports.scaling import complexity_figure
from reports.scaling import complexity_models as models
from reports.scaling import complexity_points as points
from reports.scaling import complexity_text as text
from reports.scaling.complexity_models import Fitted
from reports.scaling.complexity_points import Series

TITLE = "Complexity (the study's equation 4.1)"
CAPTION = (
    "p pixels, d the maximum order of rays, o objects, l lights; rays are those that the renderer counted in a frame: "
    "primary, reflected, transmitted, shadow. T of a cell is the median over its processes, each the steady time of a "
    "frame. Lines: weighted least squares, weights 1/T², so that relative deviations count; [low, high]: 95 % "
    "interval, Student's with HC3 variances from how cells lie about the fit, which holds the noise of processes and "
    "what the model misses, as though the latter were independent from cell to cell; a bootstrap over processes would "
    "hold noise alone. A wrong model comes out low more often than high, since it can be off by +200 % and not -200 %. "
    "Spread: of (modelled - measured) / measured, as a standard deviation; the processes' own scatter: the standard "
    "error of a cell's median, from the MAD of its processes. Exponents: of log T on the logs of the factors that "
    f"vary, from cells of at least {models.FAR} times the a of the line with the least spread, from which nothing is "
    "subtracted. d = 0 has no logarithm and no work in equation 4.1 as written: such cells are in the fits with d + 1 "
    "orders and with rays only."
)


def write(results: Results, out: Path) -> str:
    """Writes complexity*.csv, .png and .svg; returns the section of the report, "" if no two factors were varied."""
    every_series, fits = _fitted(results)
    if not every_series:
        return ""
    parts = [f"## {TITLE}"]
    if fits:
        table.write_frame(out / "complexity.csv", _points(every_series, fits))
        table.write_frame(out / "complexity-fits.csv", _coefficients(fits))
    for number, series in enumerate(every_series):
        parts.append(f"### {markdown.escape(series.label)}")
        if series.lacking:
            parts.append(markdown.escape(f"unavailable: {series.lacking}"))
        else:
            parts += _section(fits[id(series)], out, f"complexity-{number}-{markdown.slug(series.label)}")
        left = [f"{count} not ranked: {why}" for why, count in series.unranked.items()]
        parts += markdown.listed("Left out:", left)
    if fits:
        files = (f"[{name}]({name})" for name in ("complexity.csv", "complexity-fits.csv"))
        parts += [f"Every point: {next(files)}. Every coefficient: {next(files)}.", markdown.escape(CAPTION)]
    return "\n\n".join(parts)


@lru_cache(maxsize=1)
def _fitted(results: Results) -> tuple[list[Series], dict[int, Fitted]]:
    """Returns the series of a run, and by their id what was fitted to those that have enough."""
    every_series = points.series(results)
    return every_series, {id(series): models.fitted(series) for series in every_series if not series.lacking}


def gist(results: Results) -> str:
    """Returns a sentence on how far off the study's equation is for each variant; "" if it was not fitted."""
    off = []
    for fit in _fitted(results)[1].values():
        if fit.line(models.STUDY):
            errors = fit.errors[models.STUDY][fit.series.points["d"] > 0].abs()
            off.append(f"{quantity.percentage(errors.max())} ({fit.series.label})")
    return f"The study's equation 4.1 is off by at most {', '.join(off)}." if off else ""


def _section(fit: Fitted, out: Path, name: str) -> list[str]:
    parts = [
        markdown.bullets([markdown.escape(sentence) for sentence in text.sentences(fit)]),
        _ranges(fit.series),
        _lines(fit),
        _powers(fit),
    ]
    if any(fit.line(model) for model in models.WORK):
        parts.append(style.figure(out / name, f"{TITLE}: {fit.series.label}", complexity_figure.draw, fit))
    return parts


def _ranges(series: Series) -> str:
    ends = [f"{name} {_ends(series.points[name].min(), series.points[name].max())}" for name in points.FACTORS]
    processes = _ends(series.points["processes"].min(), series.points["processes"].max())
    return markdown.escape(f"{len(series.points)} cells: {', '.join(ends)}; processes a cell: {processes}.")


def _ends(low: float, high: float) -> str:
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def _lines(fit: Fitted) -> str:
    """Tabulates a, b and spread of each model."""
    rows = []
    for model, line in fit.lines.items():
        if isinstance(line, Missing):
            rows.append([f"a + b·{model}", "unavailable", "unavailable", "unavailable", "unavailable", str(line)])
            continue
        worst = fit.errors[model][fit.series.points["d"] > 0 if model == models.STUDY else slice(None)].abs().max()
        a, b = _scaled(line.a, 1e3), _scaled(line.b, 1e9)
        shares = [quantity.percentage(share) for share in (line.spread, worst)]
        rows.append([f"a + b·{model}", a, b, *shares, f"{line.cells} cells"])
    return markdown.table(["model of T", "a (ms)", "b (ns)", "spread", "off by at most", "fitted to"], rows)


def _scaled(value: Coefficient, scale: float) -> str:
    return quantity.interval(*(end * scale for end in value))


def _powers(fit: Fitted) -> str:
    """Tabulates every exponent beside the model's own."""
    rows = []
    for power in fit.powers:
        has_exponent = not isinstance(power.exponent, Missing)
        expected = f"{power.expected:.3g}" if has_exponent else "unavailable"
        judged = ("differs" if power.differs else "agrees") if has_exponent else "unavailable"
        ends = _ends(power.low, power.high) if power.cells else "unavailable"
        rows.append([power.model, power.factor, ends, str(power.cells), text.power(power), expected, judged])
    return markdown.table(["model", "factor", "range", "cells", "exponent", "of the model", "judged"], rows)


def _points(every_series: list[Series], fits: dict[int, Fitted]) -> pd.DataFrame:
    """Returns every ranked cell with its factors, its time, and how far each model is off."""
    tables = []
    for series in every_series:
        table = series.points.rename(columns={"depth": "effective_depth", "noise": "relative_noise"})
        table.insert(0, "series", series.label)
        fit = fits.get(id(series))
        for model in models.WORK:
            table[f"deviation of {model}"] = float("nan") if fit is None else fit.errors[model]
        lacking = [f"{model}: {line}" for model, line in fit.lines.items() if isinstance(line, Missing)] if fit else []
        table["note"] = series.lacking or "; ".join(lacking)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def _coefficients(fits: dict[int, Fitted]) -> pd.DataFrame:
    """Returns every coefficient with its interval, in s and units of work; NaN where there is none, and why."""
    rows = []
    for fit in fits.values():
        label = fit.series.label
        for model, line in fit.lines.items():
            named = {"a": "s", "b": "s per unit of work"}
            for name, unit in named.items():
                missing = isinstance(line, Missing)
                value = (None,) * 3 if missing else getattr(line, name)
                rows.append((label, model, name, unit, *value, None if missing else line.cells, str(line) * missing))
        for power in fit.powers:
            missing = isinstance(power.exponent, Missing)
            value = (None,) * 3 if missing else power.exponent
            rows.append((
                label, power.model, f"exponent of {power.factor}", "1", *value, power.cells,
                str(power.exponent) * missing,
            ))  # fmt: skip
    return pd.DataFrame(rows, columns=["series", "model", "name", "unit", "value", "low", "high", "cells", "note"])
