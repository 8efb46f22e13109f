"""Summarises a [[stress]] run in sentences: what broke first, and what has no answer."""

from collections import Counter
from pathlib import Path

from reports.paper import markdown
from reports.run.results import Results, grouped
from reports.stability import stability
from reports.stability import style as look
from reports.stability.stability import Curve, Row


def write(results: Results, _: Path | None = None) -> str:
    """Returns the section of the report."""
    rows = stability.rows(results)
    parts = ["## Summary", markdown.escape(_counts(rows)), markdown.bullets([_first(row) for row in rows])]
    parts += markdown.listed("Robust methods with failures:", _robust(rows)) or ["No robust method has a failure."]
    parts += markdown.listed("Without an answer:", _lacking(rows)) or ["Every cell has an answer."]
    doubts = Counter(text for record in results.records for text in record["warnings"]).most_common()
    parts += markdown.listed("Measurement warnings:", [f"{text} ({count} processes)" for text, count in doubts])
    return "\n\n".join(parts)


def _counts(rows: list[Row]) -> str:
    curves = [curve for row in rows for curve in row.curves]
    points = [point for curve in curves for point in curve.points]
    answered = [point for point in points if point.answered]
    broken = sum(curve.broken is not None for curve in curves)
    answers = sum(point.answers["count"] for point in answered)
    return (
        f"{len(rows)} rows of the catalogue, {len(points)} cells, {len(answered)} of them with an answer, {answers} "
        f"answers judged. Of {len(curves)} curves, one for each row, renderer, precision and method, {broken} break."
    )


def _first(row: Row) -> str:
    """Returns a sentence on the ways that broke first in each precision, and those that held to the end."""
    parts = [text for precision in row.precisions if (text := _of_precision(row, precision))]
    end = "; ".join(parts) or "no answer"
    return f"**{markdown.escape(row.label)}**, {markdown.escape(row.facts['stress'])}: {markdown.escape(end)}."


def _of_precision(row: Row, precision: str) -> str:
    curves = [curve for curve in row.curves if curve.precision == precision and curve.answered]
    broken = [curve for curve in curves if curve.broken]
    if not curves:
        return ""
    if not broken:
        some = " at the levels that have an answer" if any(curve.missing for curve in curves) else ""
        return f"{precision}: nothing breaks{some}"
    levels = row.levels
    first = min(levels.index(curve.broken.level) for curve in broken)
    weakest = [curve for curve in broken if levels.index(curve.broken.level) == first]
    text = f"{precision}: {_named(row, weakest, ' and ')} first, at {look.short(levels[first])}"
    unbroken, cut = ([c for c in curves if not c.broken and bool(c.missing) == is_cut] for is_cut in (False, True))
    text += f"; without a failure to the end: {_named(row, unbroken, ', ') or 'nothing'}"
    return f"{text}; without a failure as far as they have answers: {_named(row, cut, ', ')}" if cut else text


def _named(row: Row, curves: list[Curve], between: str) -> str:
    """Names the ways of curves, each with its variants unless these are all variants with answers."""
    by_way = {way: [c.variant for c in group] for way, group in grouped(curves, lambda curve: curve.way.name).items()}
    every = {curve.variant for curve in row.curves if curve.answered}
    named = (way if set(who) == every else f"{way} ({', '.join(who)})" for way, who in by_way.items())
    return between.join(named)


def _robust(rows: list[Row]) -> list[str]:
    """Returns an item for each row, way and precision: where each variant breaks, and where theory expects it."""
    by_way: dict[tuple, list[Curve]] = {}
    for row in rows:
        for curve in row.curves:
            if curve.broken and not curve.way.naive:
                by_way.setdefault((row.label, curve.way.name, curve.precision), []).append(curve)
    items = []
    for (label, way, precision), curves in by_way.items():
        places = grouped(curves, lambda curve: look.short(curve.broken.level))
        where = "; ".join(
            f"from {level} on in {', '.join(c.variant for c in group)}" for level, group in places.items()
        )
        limit = curves[0].limit
        theory = "" if limit is None else f" (theory: {look.short(limit)})"
        items.append(f"{label}, {way}, {precision}: {where}{theory}")
    return items


def _lacking(rows: list[Row]) -> list[str]:
    """Returns an item for each variant and reason, with its rows."""
    reasons: dict[tuple[str, str], Counter] = {}
    for row in rows:
        for curve in row.curves:
            for why, points in curve.missing.items():
                reasons.setdefault((curve.variant, why), Counter())[row.name] += len(points)
    return [
        f"{variant}: {why} ({cells.total()} cells: {', '.join(cells)})" for (variant, why), cells in reasons.items()
    ]
