"""Writes the first section of a report, the run at a glance: what was raced, who won, by how much, what is doubtful."""

import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.statistics.digits import earned
from harness.statistics.statistics import Estimate
from reports.accuracy import accuracy_columns
from reports.chart.embedded import Embedded, smaller
from reports.compare import gate, versions
from reports.paper import markdown, quantity, style
from reports.run import stored, study
from reports.run.results import Cell, Missing, Results
from reports.run.words import all_against
from reports.scaling import complexity, hierarchy
from reports.stability import pictures as failures
from reports.stability import stability
from reports.summary import doubts, growth
from reports.times import headline
from reports.times.headline import Bar, Headline

TITLE = "At a glance"
MOST, LISTED = 10, 60  # bars that are shown at once, and with a click
FEW_TICKS, MOST_TICKS = 3, 6
FAR = 12  # times the fastest: bars of a longer one need a logarithmic scale
SURVIVED = (
    "The share of the range of stress, from mild to extreme, up to the first wrong answer of any renderer and "
    "precision."
)
LANES = "Lanes: a processor computes several rays at once in one instruction (SIMD), which `vector` switches."
GISTS = hierarchy.gist, complexity.gist
PICTURES, LONGEST, SMALL = 18, 340, 120  # pictures, and pixels of a side: of one picture, of several


def write(results: Results, _: Path | None = None) -> str:
    """Returns the section of report.md."""
    outcome = headline.of(results)
    lead = " ".join(sentences(results, outcome))
    parts = [f"## {TITLE}", markdown.escape(lead), markdown.escape(f"{raced(results, outcome)}.")]
    if outcome.bars:
        parts.append(_table(results, outcome))
        parts += [LANES] * lanes(outcome)
    if kinds := stress(results):
        shares = [[kind["name"], *(_survived(kind[what]) for what in ("naive", "robust"))] for kind in kinds]
        parts += [markdown.table(["kind of failure", "naive methods", "robust methods"], shares), SURVIVED]
    return "\n\n".join([*parts, markdown.bullets([markdown.escape(text) for text, _ in remarks(results, outcome)])])


def stress(results: Results) -> list[dict]:
    """Returns for each kind of failure how much stress methods survive, the least robust first; [] of other runs."""
    if not results.facts.get("stability"):
        return []
    kinds = [
        {"name": row.label, "naive": row.survived(True), "robust": row.survived(False)}
        for row in stability.rows(results)
    ]
    return sorted(kinds, key=lambda kind: 1.0 if kind["robust"] is None else kind["robust"])


def failure(results: Results, pictures: Embedded) -> dict | None:
    """Returns the first row whose picture shows a naive method failing where a robust one holds, and these pictures.

    None if there is none. Adds them to `pictures`.
    """
    if not results.facts.get("stability") or results.left_out:
        return None
    for row in stability.rows(results):
        panels = failures.choose(results, row)
        naive = [panel for panel in panels if panel.curve.way.naive]
        robust = [panel for panel in panels if not panel.curve.way.naive]
        if not naive or not robust or naive[0].point.share < failures.ENOUGH:
            continue
        both = max(naive, key=lambda panel: panel.point.share), min(robust, key=lambda panel: panel.point.share)
        shown = [(pictures.add_pixels(_enlarged(panel.picture, LONGEST)), panel) for panel in both]
        if all(key for key, _ in shown):
            return {"about": failures.about(row, panels), "pictures": [(key, failures.named(p)) for key, p in shown]}
    return None


def _enlarged(picture: np.ndarray, longest: int) -> np.ndarray:
    """Returns a picture with a longest side of about so many pixels, each of a small one enlarged."""
    pixels = smaller(picture, longest)
    zoom = max(1, longest // max(pixels.shape))
    return pixels.repeat(zoom, axis=0).repeat(zoom, axis=1)


def _survived(share: float | None) -> str:
    return "no such method" if share is None else quantity.percent(share)


def sentences(results: Results, outcome: Headline) -> list[str]:
    """Returns the verdict of the run's gates, and that on its two versions; then what the run asks first, of a sweep
    how times grow, else the headline; then what other sections found."""
    gates, compared = gate.of(results, results.facts.get("gate")), versions.comparisons(results)
    verdict = [f"G{gate.line(gates)[1:]}."] if gates else []
    verdict += [f"This version: {versions.verdict(compared)}."] if compared else []
    grown = growth.gist(results)
    first = [*outcome.sentences, grown] if outcome.within else [grown, *outcome.sentences]
    return list(filter(None, [*verdict, *first, *(gist(results) for gist in GISTS)]))


def _table(results: Results, outcome: Headline) -> str:
    header = ["renderer", outcome.clock, f"÷ {_base(outcome).name}", "RMSE", "agrees", "the study, 2020"]
    rows = []
    bars = few(outcome.bars, LISTED)
    for bar in bars:
        study_time = _study(outcome, bar)
        rmse, *_, agrees = accuracy_columns.brief(bar.cell)
        ratio = "1" if bar.ratio is None else quantity.ratio(bar.ratio, results.floor.value)
        rows.append([bar.name, quantity.seconds(bar.time), ratio, rmse, agrees, "none" if study_time is None else
                     f"{study.show(study_time)} s"])  # fmt: skip
    if all(row[-1] == "none" for row in rows):
        header, rows = header[:-1], [row[:-1] for row in rows]
    note = f"Shown are {len(bars)} of {len(outcome.bars)} methods, the fastest; the tables' CSV files have all."
    return "\n\n".join([markdown.table(header, rows), *[note] * (len(bars) < len(outcome.bars))])


def lanes(outcome: Headline) -> bool:
    """Does a name of the bars have lanes, which the page then explains?"""
    return any("lanes" in word for bar in outcome.bars for word in (*bar.words, *outcome.shared))


def _base(outcome: Headline) -> Bar:
    """Returns the bar that others are divided by."""
    return next(bar for bar in outcome.bars if bar.ratio is None)


def _study(outcome: Headline, bar: Bar) -> Estimate | None:
    """Returns the study's time for the case of a bar; None if it has none, or used another method."""
    get, study_time = bar.cell.parameters.get, study.find(study.TIMES_S, bar.cell)
    plain = outcome.clock == headline.STEADY and get("vector", "off") == "off" and get("sampler", "one") == "one"
    return study_time if plain and isinstance(study_time, Estimate) else None


def raced(results: Results, outcome: Headline) -> str:
    """Returns what was raced: the place of the bars, its size, and what the scene consists of."""
    if not outcome.bars:
        counted = (len(results.places), "configuration"), (len(results.variants), "renderer")
        return " of ".join(f"{count} {word}{'s' * (count != 1)}" for count, word in counted)
    cell = outcome.bars[0].cell
    if outcome.clock == headline.FIRST and len(results.places) > 1:
        return outcome.where
    record, parameters = results.record(cell) or {}, cell.parameters
    counts = [_counted(count, name) for name, count in (record.get("shapes") or {}).items() if count]
    counts += [_counted(record["lights"], "light")] if record.get("lights") else []
    light = "shadows" if parameters.get("shadows") else "no shadows"
    size = f"{cell.size[1]} × {cell.size[0]}"
    words = [*outcome.where.split(", "), size, f"depth {parameters.get('depth')}", light, *counts, *outcome.shared]
    return ", ".join(dict.fromkeys(words))


def _counted(count: int, name: str) -> str:
    plural = {"sphere": "spheres", "box": "boxes", "csg": "CSG solids"}.get(name, f"{name}s")
    return f"{count} {name if count == 1 and name != 'csg' else plural}"


def machine(results: Results) -> str:
    """Returns the machine in one line."""
    facts = results.facts["environment"]
    cores = facts["cores"]["usable"]
    words = [facts["cpu"], f"{cores} core{'s' * (cores != 1)}", f"{facts['memory_bytes'] / 1e9:.0f} GB", facts["os"]]
    if isinstance(facts["gpu"], dict):
        words.insert(3, facts["gpu"]["name"])
    return ", ".join(words + ["a virtual machine"] * (facts["virtual_machine"] == "yes"))


def remarks(results: Results, outcome: Headline) -> list[tuple[str, str]]:
    """Returns what limits the result, each (sentence, name of the section that has more)."""
    notes = []
    if not results.facts.get("stability"):
        floor = results.floor
        noise = f"Differences under {quantity.percentage(floor.value)} are noise here." if floor.value else ""
        notes.append((noise or f"Noise floor: unavailable: {floor.reason}.", "summary"))
    reasons: dict[str, list[str]] = {}
    for variant, why in outcome.lacking:
        reasons.setdefault(why, []).append(variant)
    notes += [(f"{', '.join(names)}: {why}.", "summary") for why, names in reasons.items()]
    bad = Counter(cell.status for cell in results.cells if cell.status != "ok" and not cell.as_meant)
    wrong = [f"{count} {status}" for status, count in bad.items() if status not in ("unavailable", "unsupported")]
    if wrong:
        notes.append((f"Without a result: {', '.join(wrong)}.", "summary"))
    if count := len(doubts.kinds(results)):
        notes.append(
            (
                f"{count} measurement warning{'s' * (count != 1)}.",
                "summary" if results.facts.get("stability") else "doubts",
            )
        )
    return notes


# --- For the page ---


@dataclass(frozen=True)
class Scale:
    """Places times on an axis, in per cent of its width."""

    low: float
    high: float
    logarithmic: bool

    def at(self, seconds: float) -> float:
        if not self.logarithmic:
            return round(100 * seconds / self.high, 2)
        span = math.log(self.high / self.low)
        return round(100 * min(1.0, max(0.0, math.log(seconds / self.low) / span)), 2)

    @property
    def ticks(self) -> list[tuple[float, str]]:
        """Returns (place, label) of some round times."""
        if self.logarithmic:
            first, last = math.floor(math.log10(self.low)), math.floor(math.log10(self.high))
            decades = [10.0**n for n in range(first, last + 1)]
            there = [value for value in decades if value >= self.low]
            if len(there) < FEW_TICKS:
                there = [m * ten for ten in decades for m in (1, 2, 5) if self.low <= m * ten <= self.high]
            values = there[:: -(-len(there) // MOST_TICKS)]
        else:
            step = _round(self.high / (MOST_TICKS - 1))
            values = [n * step for n in range(int(self.high / step) + 1)]
        return [(self.at(value) if value else 0.0, _label(value)) for value in values]


def _round(value: float) -> float:
    """Returns the nearest number above of 1, 2 and 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return min(factor * power for factor in (1, 2, 5, 10) if factor * power >= value * 0.9999)


def _label(seconds: float) -> str:
    if not seconds:
        return "0"
    size, name = quantity.unit(seconds)
    return f"{seconds / size:g} {name}"


def scale(times: list[Estimate]) -> Scale:
    """Returns the axis for times: from 0, or logarithmic if the longest is far from the shortest."""
    ends = [end for time in times for end in (time.value, time.low, time.high) if end]
    if max(ends) <= FAR * min(ends):
        return Scale(0.0, 1.05 * max(ends), False)
    return Scale(min(ends) / 2, 1.2 * max(ends), True)


def data(results: Results, pictures: Embedded) -> dict:
    """Returns what the first screen shows. Adds pictures to `pictures`."""
    outcome = headline.of(results)
    bars = few(outcome.bars, LISTED)
    study_times = [time for bar in bars if (time := _study(outcome, bar))]
    axis = scale([*(bar.time for bar in bars), *study_times]) if bars else None
    shown = {id(bar) for bar in few(bars, MOST)}
    rows = [{"late": id(bar) not in shown, **_row(results, outcome, bar, axis)} for bar in bars]
    for first, row in enumerate(rows):
        after = next((n for n, later in enumerate(rows[first:]) if not later["late"]), len(rows) - first)
        row["gap"] = (
            after if row["late"] and (first == 0 or not rows[first - 1]["late"]) else 0
        )  # rows hidden from here on
    return {
        "sentences": sentences(results, outcome),
        "count": f"{len(bars)} of {len(outcome.bars)}" if len(bars) < len(outcome.bars) else f"all {len(bars)}",
        "raced": raced(results, outcome),
        "machine": machine(results),
        "pictures": pictures_of(results, outcome, pictures),
        "rows": rows,
        "late": len(rows) - len(shown),
        "clock": outcome.clock,
        "base": _base(outcome).name if outcome.bars else "",
        "axis": axis,
        "study": bool(study_times),
        "lanes": LANES.replace("`", "") if lanes(outcome) else "",
        "unsure": any(row["unresolved"] for row in rows),
        "against": all_against(bar.cell.against for bar in outcome.bars),
        "remarks": remarks(results, outcome),
        "stress": stress(results),
        "failure": failure(results, pictures),
        "survived": SURVIVED,
    }


def few(bars: list[Bar], most: int) -> list[Bar]:
    """Returns at most `most` bars in their order: of each variant the fastest, and that which the sentence compares."""
    if len(bars) <= most:
        return bars
    wanted = [*(bar for bar in bars if bar.compared), *bars]
    by_variant = {bar.cell.variant: bar for bar in reversed(bars)}
    compared = {bar.cell.variant: bar for bar in reversed(bars) if bar.compared}
    chosen = list(dict.fromkeys([bars[0], *compared.values(), *by_variant.values(), *wanted]))[:most]
    return [bar for bar in bars if bar in chosen]


def _row(results: Results, outcome: Headline, bar: Bar, axis: Scale) -> dict:
    study_time, time = _study(outcome, bar), bar.time
    rmse, *_, agrees = accuracy_columns.brief(bar.cell)
    unresolved = bar.ratio is not None and not bar.resolved
    return {
        "name": bar.name,
        "colour": style.colour(bar.cell.variant, results.variants),
        "dark": style.dark(style.colour(bar.cell.variant, results.variants)),
        "end": axis.at(time.value),
        "whisker": None if time.low is None else (axis.at(time.low), axis.at(time.high)),
        "study": None if study_time is None else (axis.at(study_time.value), f"{study.show(study_time)} s"),
        "time": quantity.seconds(time),
        "ratio": "1" if bar.ratio is None else f"{earned(bar.ratio)} ×",
        "unresolved": unresolved,
        "rmse": rmse,
        "agrees": agrees,
    }


def pictures_of(results: Results, outcome: Headline, pictures: Embedded, most: int = PICTURES) -> list[tuple[str, str]]:
    """Returns pictures of what was raced, (key, name): one of each scene and case, that of the bars first.

    Adds them to `pictures`. most: how many there may be.
    """
    places: dict[tuple, list[Cell]] = {}
    for cell in [*(bar.cell for bar in outcome.bars), *results.cells]:
        if cell.pixels > 1 and not cell.apart and cell.parameters.get("kind") != "rays":
            places.setdefault((cell.scene, cell.swept.get("case")), []).append(cell)
    longest = LONGEST if min(most, len(places)) == 1 else SMALL
    made: list[tuple[str, str]] = []
    if results.left_out:
        return made
    for (scene, case), cells in places.items():
        if len(made) == most:
            break
        picture = next((seen for cell in cells if not isinstance(seen := stored.picture(results, cell), Missing)), None)
        if picture is None or picture.ndim != 3:
            continue
        key = pictures.add_pixels(_enlarged(stored.displayed(picture, cells[0]), longest))
        made += [(key, str(case or Path(scene).stem))] if key else []
    return made
