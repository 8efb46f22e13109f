"""What came out, in plain words: who is fastest, by how much, what has no rank and why, what is doubtful."""

import re

from harness import statistics
from reports import accuracy_columns, launch, markdown, quantity, ranking
from reports.results import Cell, Results, place_label

STARVED = 0.9  # of a core: a renderer that computes all the time and is let uses more
SHORTEST = 0.2  # s of a process, of which starting is then a small part


def write(results: Results) -> str:
    """The section of the report."""
    parts = ["## Summary", markdown.bullets(_rankings(results))]
    unranked = _reasons(results, [cell for cell in results.cells if cell.unranked and not cell.as_meant])
    apart = _reasons(results, [cell for cell in results.cells if cell.as_meant])
    if unranked:
        parts += ["Not ranked:", markdown.bullets(unranked)]
    if apart:
        parts += ["Shown, and in no comparison:", markdown.bullets(apart)]
    if not unranked + apart:
        parts.append("Every variant is ranked.")
    doubts = _warnings(results)
    parts += ["Doubtful:", markdown.bullets(doubts)] if doubts else ["No repetition has a warning."]
    return "\n\n".join(parts)


def _rankings(results: Results) -> list[str]:
    """A sentence a place, but for places of exhibits alone; one for all that differ only in a launch."""
    return [
        _ranking(results, place) + (_launches(results, place, others) if others else "")
        for place, others in launch.places(results)
        if not all(cell.exhibit for cell in results.at(place))
    ]


def _launches(results: Results, place: tuple[str, str], others: list[Cell]) -> str:
    """What a place stands for, which is the fastest of the ways to launch a kernel."""
    (first,) = ranking.ranked(results, place)
    next_best = ranking.ratio(others[0], first)
    sure = "the fastest" if quantity.resolved(next_best) else "the lowest mean, not resolved from the next,"
    return f" It is {sure} of {1 + len(others)} ways to launch it."


def _ranking(results: Results, place: tuple[str, str]) -> str:
    """One sentence on the ranked cells of a place."""
    label = f"**{markdown.escape(place_label(place))}**: "
    ranked = ranking.ranked(results, place)
    if not ranked:
        return label + "nothing is ranked."
    first, *others = ranked
    time = quantity.text(statistics.mean(first.values("steady_s")))
    name = markdown.escape(first.variant)
    said = f"{time} s a frame, {accuracy_columns.shown(first)}"
    if not others:
        return f"{label}only {name} is ranked: {said}."
    ratios = [(other, ranking.ratio(other, first)) for other in others]
    best = "is the fastest" if quantity.resolved(ratios[0][1]) else "has the lowest mean, not resolved from the next"
    rest = ", ".join(markdown.escape(f"{other.variant} {quantity.ratio(ratio)}") for other, ratio in ratios)
    return f"{label}**{name}** {best}: {said}. Times as long: {rest}."


def _reasons(results: Results, cells: list[Cell]) -> list[str]:
    """One item a variant and reason, with the places where it holds."""
    found: dict[tuple[str, str], list[Cell]] = {}
    for cell in cells:
        found.setdefault((cell.variant, _reason(cell)), []).append(cell)
    return [
        f"{markdown.escape(variant)}: {markdown.escape(why)} ({_where(results, [cell.place for cell in cells])})"
        for (variant, why), cells in found.items()
    ]


def _reason(cell: Cell) -> str:
    """Why it is not ranked; of an exhibit without numbers, which differ from place to place."""
    if not cell.as_meant or not cell.exhibit:
        return cell.unranked
    return f"{cell.apart}; its picture is {'wrong, as meant' if cell.status == 'wrong picture' else 'right here'}"


def _warnings(results: Results) -> list[str]:
    """One item a variant and kind of warning (numbers apart), and the repetitions of an ok cell that failed."""
    found: dict[tuple[str, str], list[tuple[str, tuple]]] = {}
    for cell in results.cells:
        if cell.status == "ok" and cell.lost:
            found.setdefault((cell.variant, cell.lost), []).append((f"ok{cell.lost}", cell.place))
        bad = cell.load[cell.load["status"] != "ok"] if not cell.as_meant else cell.load[:0]
        for status, reason in zip(bad["status"], bad["reason"], strict=True):
            text = f"a repetition of its load pass is not ok: {status}: {reason}"
            found.setdefault((cell.variant, text), []).append((text, cell.place))
        for index in cell.rows.index.append(cell.load.index):
            for text in results.records[index]["warnings"]:
                kind = re.sub(r"[-+.\de]*\d", "#", text)
                found.setdefault((cell.variant, kind), []).append((text, cell.place))
        share = _share_of_a_core(cell)
        if share is not None and share < STARVED and not cell.gpu:
            text = f"used {share:.0%} of one core over its life: it waited, or other programs had the cores"
            found.setdefault((cell.variant, "starved"), []).append((text, cell.place))
    return [
        f"{markdown.escape(variant)}: {markdown.escape(said[0][0])}"
        + (f", and {len(said) - 1} more like it" if len({text for text, _ in said}) > 1 else "")
        + f" ({_where(results, [place for _, place in said])})"
        for (variant, _), said in found.items()
    ]


def _share_of_a_core(cell: Cell) -> float | None:
    """CPU time over wall time of its repetitions that are long enough to tell; None if there are none."""
    long = cell.good[cell.good["wall_s"] > SHORTEST].dropna(subset=["user_s", "system_s"])
    return (long["user_s"].sum() + long["system_s"].sum()) / long["wall_s"].sum() if len(long) else None


def _where(results: Results, places: list[tuple[str, str]]) -> str:
    places = list(dict.fromkeys(places))
    if len(places) == len(results.places) > 1:
        return "everywhere"
    return markdown.escape("; ".join(map(place_label, places)))
