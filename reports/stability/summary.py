"""The summary of a [[stress]] run in plain words: what broke first, and what did not run."""

from collections import Counter
from pathlib import Path

from reports.paper import markdown
from reports.run.results import Results
from reports.stability import stability
from reports.stability import style as look
from reports.stability.stability import Curve, Row


def write(results: Results, _: Path | None = None) -> str:
    """The section of the report."""
    rows = stability.rows(results)
    parts = ["## Summary", markdown.escape(_counts(rows)), markdown.bullets([_first(row) for row in rows])]
    failed = _robust(rows)
    if failed:
        parts += ["Ways that are not naive, and have failures all the same:", markdown.bullets(failed)]
    else:
        parts.append("No way that is not naive has a failure.")
    lacking = _lacking(rows)
    parts += ["Without an answer:", markdown.bullets(lacking)] if lacking else ["Every cell has an answer."]
    doubts = Counter(text for record in results.records for text in record["warnings"])
    if doubts:
        told = [markdown.escape(f"{text} ({count} repetitions)") for text, count in doubts.most_common()]
        parts += ["Doubtful:", markdown.bullets(told)]
    return "\n\n".join(parts)


def _counts(rows: list[Row]) -> str:
    curves = [curve for row in rows for curve in row.curves]
    points = [point for curve in curves for point in curve.points]
    known = [point for point in points if point.known]
    broken = sum(curve.broken is not None for curve in curves)
    answers = sum(point.told["count"] for point in known)
    return (
        f"{len(rows)} rows of the catalogue, {len(points)} cells, {len(known)} of them with an answer, {answers} "
        f"answers judged. Of {len(curves)} curves, each a row of one variant, precision and way, {broken} break."
    )


def _first(row: Row) -> str:
    """A sentence on what broke first in each precision, and what held to the end."""
    said = [text for precision in row.precisions if (text := _of_precision(row, precision))]
    end = "; ".join(said) or "no answer"
    return f"**{markdown.escape(row.label)}**, {markdown.escape(row.facts['stress'])}: {markdown.escape(end)}."


def _of_precision(row: Row, precision: str) -> str:
    curves = [curve for curve in row.curves if curve.precision == precision and curve.known]
    broken = [curve for curve in curves if curve.broken]
    if not curves:
        return ""
    if not broken:
        some = " at the levels that have an answer" if any(curve.missing for curve in curves) else ""
        return f"{precision}: nothing breaks{some}"
    levels = row.levels
    first = min(levels.index(curve.broken.level) for curve in broken)
    mine = [curve for curve in broken if levels.index(curve.broken.level) == first]
    text = f"{precision}: {_named(row, mine, ' and ')} first, at {look.short(levels[first])}"
    held, cut = ([c for c in curves if not c.broken and bool(c.missing) == is_cut] for is_cut in (False, True))
    text += f"; to the end without a failure: {_named(row, held, ', ') or 'nothing'}"
    return f"{text}; as far as there are answers: {_named(row, cut, ', ')}" if cut else text


def _named(row: Row, curves: list[Curve], between: str) -> str:
    """Ways, each with its variants where these are not all that have answers."""
    found: dict[str, list[str]] = {}
    for curve in curves:
        found.setdefault(curve.way.name, []).append(curve.variant)
    every = {curve.variant for curve in row.curves if curve.known}
    named = (way if set(who) == every else f"{way} ({', '.join(who)})" for way, who in found.items())
    return between.join(named)


def _robust(rows: list[Row]) -> list[str]:
    """One item a row, way and precision, where theory expects it, and who breaks where."""
    found: dict[tuple, list[Curve]] = {}
    for row in rows:
        for curve in row.curves:
            if curve.broken and not curve.way.naive:
                found.setdefault((row.label, curve.way.name, curve.precision), []).append(curve)
    said = []
    for (label, way, precision), curves in found.items():
        where: dict[str, list[str]] = {}
        for curve in curves:
            where.setdefault(look.short(curve.broken.level), []).append(curve.variant)
        told = "; ".join(f"from {level} on in {', '.join(who)}" for level, who in where.items())
        limit = curves[0].limit
        theory = "" if limit is None else f" (theory: {look.short(limit)})"
        said.append(markdown.escape(f"{label}, {way}, {precision}: {told}{theory}"))
    return said


def _lacking(rows: list[Row]) -> list[str]:
    """One item a variant and reason, with the rows where it holds."""
    found: dict[tuple[str, str], Counter] = {}
    for row in rows:
        for curve in row.curves:
            for why, points in curve.missing.items():
                found.setdefault((curve.variant, why), Counter())[row.name] += len(points)
    return [
        markdown.escape(f"{variant}: {why} ({told.total()} cells: {', '.join(told)})")
        for (variant, why), told in found.items()
    ]
