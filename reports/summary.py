"""What came out, in plain words: who is fastest, by how much, what has no rank and why, what is doubtful."""

import re
from collections import Counter

from reports import accuracy_columns, launch, markdown, quantity, ranking, thinning
from reports.results import Cell, Results, place_label, point_label

STARVED = 0.9  # of a core: a renderer that computes all the time and is let uses more
SHORTEST = 0.2  # s of a process, of which starting is then a small part
MOST = 40  # sentences on places
MOST_NAMED = 8  # places that a sentence names


def write(results: Results) -> str:
    """The section of the report."""
    parts = ["## Summary", _floor(results), markdown.bullets(_rankings(results))]
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


def _floor(results: Results) -> str:
    """What the run cannot tell apart: its A/A pair, and the noise floor."""
    floor, pair = results.floor, results.facts.get("pair") or {}
    known = floor.value is not None
    text = f"Noise floor: {100 * floor.value:.2g} %." if known else f"Noise floor: unavailable: {floor.reason}."
    if floor.ratio is not None:
        twice = f"{pair['label']} was run twice in every round (an A/A pair); the ratio of the two is"
        text += f" {twice} {quantity.text(floor.ratio)}."
    end = "No smaller difference is resolved." if known else "What is resolved is decided by the intervals alone."
    return markdown.escape(f"{text} {end}")


def _rankings(results: Results) -> list[str]:
    """A sentence a place, but for places of exhibits alone; one for all that differ only in a launch; of many a few."""
    places = [told for told in launch.places(results) if not all(cell.exhibit for cell in results.at(told[0]))]
    few = thinning.few(places, MOST)
    counted = [_counts(results, [place for place, _ in places])] if len(few) < len(places) else []
    return counted + [
        _ranking(results, place) + (_launches(results, place, others) if others else "") for place, others in few
    ]


def _counts(results: Results, places: list[tuple[str, str]]) -> str:
    """How often who is the fastest."""
    found = Counter(_winner(results, place) for place in places)
    said = ", ".join(f"{markdown.escape(what)} in {count}" for what, count in found.most_common())
    return f"Of {len(places)} places: {said}. The times of all are in the tables' CSV files; of {MOST}, evenly spread:"


def _winner(results: Results, place: tuple[str, str]) -> str:
    ranked = ranking.ranked(results, place)
    if len(ranked) < 2:
        return f"only {ranked[0].variant} is ranked" if ranked else "nothing is ranked"
    return "who is the fastest is not resolved" if _rivals(results, ranked) else f"{ranked[0].variant} is the fastest"


def _rivals(results: Results, ranked: list[Cell]) -> list[Cell]:
    """The cells from which the first is not resolved."""
    first, *others = ranked
    return [cell for cell in others if not ranking.resolved(results, ranking.ratio(cell, first))]


def _launches(results: Results, place: tuple[str, str], others: list[Cell]) -> str:
    """What a place stands for, which is the fastest of the ways to launch a kernel."""
    (first,) = ranking.ranked(results, place)
    rivals = _rivals(results, [first, *others])
    sure = f"the lowest median, not resolved from {len(rivals)} others," if rivals else "the fastest"
    return f" It is {sure} of {1 + len(others)} ways to launch it."


def _ranking(results: Results, place: tuple[str, str]) -> str:
    """One sentence on the ranked cells of a place."""
    label = f"**{markdown.escape(place_label(place))}**: "
    ranked = ranking.ranked(results, place)
    if not ranked:
        return label + "nothing is ranked."
    first, *others = ranked
    name = markdown.escape(first.variant)
    said = f"{markdown.escape(quantity.text(first.steady))} s a frame, {accuracy_columns.shown(first)}"
    if not others:
        return f"{label}only {name} is ranked: {said}."
    rivals = ", ".join(markdown.escape(cell.variant) for cell in _rivals(results, ranked))
    best = f"has the lowest median, not resolved from {rivals}" if rivals else "is the fastest"
    ratios = ((cell.variant, quantity.ratio(ranking.ratio(cell, first), results.floor.value)) for cell in others)
    rest = ", ".join(markdown.escape(f"{variant} {ratio}") for variant, ratio in ratios)
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
    """One item a variant and kind of doubt, with the places where it holds."""
    found: dict[tuple[str, str], list[tuple[str, tuple]]] = {}
    for cell in results.cells:
        for kind, text in _doubts(results, cell):
            found.setdefault((cell.variant, kind), []).append((text, cell.place))
    for record in results.records:
        if record.get("pass") == "pair":
            place = record["scene"], point_label(record["point"])
            for kind, text in _of_row(record, "a second process of the A/A pair"):
                found.setdefault((record["variant"], kind), []).append((text, place))
    return [
        f"{markdown.escape(variant)}: {markdown.escape(said[0][0])}"
        + (f", and {len(said) - 1} more like it" if len({text for text, _ in said}) > 1 else "")
        + f" ({_where(results, [place for _, place in said])})"
        for (variant, _), said in found.items()
    ]


def _doubts(results: Results, cell: Cell) -> list[tuple[str, str]]:
    """What makes a cell doubtful, each with its kind: its text, numbers apart."""
    found = [(_kind(text), f"ok{text}") for text in (cell.lost, cell.disturbed) if text and cell.status == "ok"]
    for row in cell.timed:
        found += [(_kind(text), text) for text in results.records[row]["warnings"]]
    for row in cell.loaded:
        found += _of_row(results.records[row], "" if cell.as_meant else "a repetition of its load pass")
    share = _share_of_a_core(cell)
    if share is not None and share < STARVED and not cell.gpu:
        found.append(
            ("starved", f"used {share:.0%} of one core over its life: it waited, or other programs had the cores")
        )
    return found


def _of_row(record: dict, what: str) -> list[tuple[str, str]]:
    """What makes a row doubtful that is in no table of times; with `what` it is, also that it is not ok."""
    bad = [f"{what} is not ok: {record['status']}: {record['reason']}"] if what and record["status"] != "ok" else []
    return [(_kind(text), text) for text in bad + record["warnings"]]


def _kind(text: str) -> str:
    return re.sub(r"[-+.\de]*\d", "#", text)


def _share_of_a_core(cell: Cell) -> float | None:
    """CPU time over wall time of its repetitions that are long enough to tell; None if there are none."""
    cpu, wall = cell.known("cpu_s"), cell.known("wall_s")
    long = [row for row in cpu if wall[row] > SHORTEST]
    return sum(cpu[row] for row in long) / sum(wall[row] for row in long) if long else None


def _where(results: Results, places: list[tuple[str, str]]) -> str:
    places = list(dict.fromkeys(places))
    if len(places) == len(results.places) > 1:
        return "everywhere"
    if len(places) > MOST_NAMED:
        return f"in {len(places)} of {len(results.places)} places"
    return markdown.escape("; ".join(map(place_label, places)))
