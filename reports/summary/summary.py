"""Summarises a run in sentences: which variant is fastest, by how much, and why cells are not ranked."""

from collections import Counter
from pathlib import Path

from reports.paper import markdown, quantity, thinning
from reports.run import launch, naming, ranking
from reports.run.results import Cell, Missing, Results, grouped
from reports.run.words import all_against

MOST = 40  # sentences on places
MOST_NAMED = 8  # places that a sentence names
LARGE_MASK = 0.1  # of a picture: a larger mask is said


def write(results: Results, _: Path | None = None) -> str:
    """Returns the section of the report."""
    parts = ["## Summary", _floor(results), *_enough(results), *_against(results)]
    parts += [markdown.bullets(_rankings(results)), *_masks(results)]
    unranked = _reasons(results, [cell for cell in results.cells if cell.unranked and not cell.as_meant])
    apart = _reasons(results, [cell for cell in results.cells if cell.as_meant])
    if unranked:
        parts += ["Not ranked:", markdown.bullets(unranked)]
    if apart:
        parts += ["Shown, and in no comparison:", markdown.bullets(apart)]
    if not unranked + apart:
        parts.append("Every renderer is ranked.")
    return "\n\n".join(parts)


def _floor(results: Results) -> str:
    """Says which differences the run cannot resolve: its A/A pair and the noise floor."""
    floor = results.floor
    has_floor = floor.value is not None
    value = quantity.percentage(floor.value) if has_floor else f"unavailable: {floor.reason}"
    text = f"Noise floor: {value}."
    if floor.ratio is not None:
        twice = f"{results.pair} was run twice in every round (an A/A pair); the ratio of the two is"
        text += f" {twice} {quantity.text(floor.ratio)}."
    end = "No smaller difference is resolved." if has_floor else "What is resolved is decided by the intervals alone."
    return markdown.escape(f"{text} {end}")


def _enough(results: Results) -> list[str]:
    """Says, in a paragraph, after how many rounds a run ended whose ratios were to be so precise."""
    until, rounds = results.facts["experiment"]["measure"].get("until"), results.facts.get("enough")
    if until is None:
        return []
    if rounds is None:
        return [f"Not every ratio's interval is within {100 * until:g} % of it, as was asked (until)."]
    return [f"It ended after {rounds} rounds: every ratio's interval is within {100 * until:g} % of it (until)."]


def _against(results: Results) -> list[str]:
    """Says what errors are held against, in a paragraph, where that is not the truth of the scene."""
    against = all_against((cell.against for cell in results.cells), " or ")
    return [markdown.escape(f"Errors are {against}.")] if against else []


def _masks(results: Results) -> list[str]:
    """Names the places of which much is ill-conditioned, in a paragraph; none if there are none."""
    masks = [(cell.mask, cell.place) for cell in results.cells]
    large = [(share, place) for share, place in masks if not isinstance(share, Missing) and share > LARGE_MASK]
    if not large:
        return []
    return [
        f"The mask of ill-conditioned pixels, which are judged all together and not one by one, is more than "
        f"{100 * LARGE_MASK:.0f} % of the picture, up to {100 * max(large)[0]:.0f} %: "
        f"{where(results, [place for _, place in large])}."
    ]


def _rankings(results: Results) -> list[str]:
    """A sentence a place, but for places of exhibits alone; one for all that differ only in a launch; of many a few."""
    places = [pair for pair in launch.places(results) if not all(cell.exhibit for cell in results.at(pair[0]))]
    few = thinning.few(places, MOST)
    counted = [_counts(results, [place for place, _ in places])] if len(few) < len(places) else []
    return counted + [
        _ranking(results, place) + (_launches(results, place, others) if others else "") for place, others in few
    ]


def _counts(results: Results, places: list[tuple[str, str]]) -> str:
    """Counts how often each variant is the fastest."""
    winners = Counter(_winner(results, place) for place in places)
    said = ", ".join(f"{markdown.escape(what)} in {count}" for what, count in winners.most_common())
    return f"Of {len(places)} configurations: {said}. All times are in the tables' CSV files; of {MOST}, evenly spread:"


def _winner(results: Results, place: tuple[str, str]) -> str:
    ranked = ranking.ranked(results, place)
    if len(ranked) < 2:
        return f"only {ranked[0].name} is ranked" if ranked else "nothing is ranked"
    return "who is the fastest is not resolved" if _rivals(results, ranked) else f"{ranked[0].name} is the fastest"


def _rivals(results: Results, ranked: list[Cell]) -> list[Cell]:
    """Returns the cells whose ratio to the first is not resolved."""
    first, *others = ranked
    return [cell for cell in others if not ranking.resolved(results, ranking.ratio(cell, first))]


def _launches(results: Results, place: tuple[str, str], others: list[Cell]) -> str:
    """Says which launch shapes a place stands for: it is the fastest of them."""
    (first,) = ranking.ranked(results, place)
    rivals = _rivals(results, [first, *others])
    sure = f"the lowest median, not resolved from {len(rivals)} others," if rivals else "the fastest"
    return f" It is {sure} of {1 + len(others)} launches."


def _ranking(results: Results, place: tuple[str, str]) -> str:
    """Returns a sentence on the ranked cells of a place."""
    label = f"**{markdown.escape(naming.called(results, place))}**: "
    ranked = ranking.ranked(results, place)
    if not ranked:
        return label + "nothing is ranked."
    first, *others = ranked
    name = markdown.escape(first.name)
    said = markdown.escape(f"{quantity.seconds(first.steady)} a frame, {_errors(first)}, agreement {first.agreement}")
    if not others:
        return f"{label}only {name} is ranked: {said}."
    rivals = ", ".join(markdown.escape(cell.name) for cell in _rivals(results, ranked))
    best = f"has the lowest median, not resolved from {rivals}" if rivals else "is the fastest"
    ratios = ((cell.name, quantity.ratio(ranking.ratio(cell, first), results.floor.value)) for cell in others)
    rest = ", ".join(markdown.escape(f"{name} {ratio}") for name, ratio in ratios)
    return f"{label}**{name}** {best}: {said}. Times as long: {rest}."


def _errors(cell: Cell) -> str:
    return cell.errors.removesuffix(f", {cell.against}") if cell.against else cell.errors


def _reasons(results: Results, cells: list[Cell]) -> list[str]:
    """Returns an item for each variant and reason, with its places."""
    groups = grouped(cells, lambda cell: (cell.name, _reason(cell)))
    return [
        f"{markdown.escape(variant)}: {markdown.escape(why)} ({where(results, [cell.place for cell in cells])})"
        for (variant, why), cells in groups.items()
    ]


def _reason(cell: Cell) -> str:
    """Why it is not ranked; of an exhibit without numbers, which differ from place to place."""
    if not cell.as_meant or not cell.exhibit:
        return cell.unranked
    return f"{cell.apart}; its picture is {'wrong, as meant' if cell.status == 'wrong picture' else 'right here'}"


def where(results: Results, places: list[tuple[str, str]]) -> str:
    places = list(dict.fromkeys(places))
    if len(places) == len(results.places) > 1:
        return "everywhere"
    if len(places) > MOST_NAMED:
        return f"in {len(places)} of {len(results.places)} configurations"
    return markdown.escape("; ".join(naming.called(results, place) for place in places))
