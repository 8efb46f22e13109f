"""Draws start-up by phases, from the start of a process to the end of its first frame, cold and warm."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.patches import Patch

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from reports.paper import markdown, quantity, style, table
from reports.run.results import Cell, Results, place_label

TITLE = "Start-up: to the first frame, cold and warm"
FRAME = "first frame"
BUILD = "compiled beforehand"  # a program; the phase build is of a hierarchy
CAPTION = (
    "From the start of a process to the end of its first frame, medians over processes, with the 95 % interval of the "
    "sum where there are enough; medians of phases need not add up to it. Cold: with an empty cache of compiled code, "
    "and with the single build of a program that is compiled beforehand (hatched). Warm: with code of an "
    "earlier process; without a cache both are the same. In both, files are in the system's memory, Python's own "
    "compiled modules exist, and start is the interpreter's or the loader's."
)
CSV_HEADER = "scene", "point", "variant", "cache", "phase", "value_s", "low_s", "high_s", "processes"
ROW, HEAD = 0.3, 1.2  # inches


@dataclass(frozen=True)
class Start:
    """The processes of a variant with the same state of the cache, cold or warm.

    phases: median s by name, in order. rounds: from the start to the end of the first frame without the build, s, by
    number and pass of the repetition. total: their median. build: s, None if nothing is built.
    """

    variant: str
    state: str
    phases: dict[str, float]
    rounds: dict[tuple[int, str], float]
    total: Estimate
    build: float | None

    @property
    def compiles(self) -> bool:
        """Does a cold start differ from a warm one?"""
        return self.build is not None or "compile" in self.phases


def starts_by_place(results: Results) -> dict[tuple[str, str], list[Start]]:
    """Returns starts by place; {} for a run without a cold pass."""
    if not any(record.get("pass") == "cold" for record in results.records):
        return {}
    return {
        place: [start for cell in results.at(place) for start in _starts(results, cell)] for place in results.places
    }


def _starts(results: Results, cell: Cell) -> list[Start]:
    rows: dict[str, list[dict]] = {"cold": [], "warm": []}
    for record in _records(results, cell):
        if record["status"] == "ok" and record["frames_s"] and not cell.apart:
            rows[state(record)].append(record)
    return [_start(cell.label, which, records) for which, records in rows.items() if records]


def _records(results: Results, cell: Cell) -> list[dict]:
    """Returns the records of both passes, cold and warm."""
    name = cell.scene, cell.swept, cell.variant
    return [
        record
        for record in results.records
        if (record["scene"], record["point"], record["variant"]) == name
        and (record.get("pass") or "timed") in ("timed", "cold")
    ]


def state(record: dict) -> str:
    """Returns the state of the cache that the process reported, cold or warm; else that of its pass."""
    reported = ((record["used"] or {}).get("methods") or {}).get("compile_cache")
    return reported if reported in ("cold", "warm") else "cold" if record.get("pass") == "cold" else "warm"


def _start(variant: str, which: str, records: list[dict]) -> Start:
    spent = [phases(record) for record in records]
    names = dict.fromkeys(name for times in spent for name in times)
    medians = {name: statistics.median([times.get(name, 0.0) for times in spent]).value for name in names}
    builds = [record["build"]["seconds"] for record in records if record["build"]] if which == "cold" else []
    names = [(record["repetition"], record.get("pass") or "timed") for record in records]
    rounds = {name: sum(times.values()) for name, times in zip(names, spent, strict=True)}
    total = statistics.median([*rounds.values()])
    return Start(variant, which, medians, rounds, total, builds[0] if builds else None)


def phases(record: dict) -> dict[str, float]:
    """Returns the time of each phase before rendering, without gaps, and of the first frame, s."""
    spent: Counter[str] = Counter()
    for name, start, end in record["phases"]:
        if name == "render":
            break
        spent[name] += end - start
    return {**spent, FRAME: record["frames_s"][0]}


def write(results: Results, out: Path) -> str:
    """Writes start.csv, start-NUMBER-PLACE.png and .svg; returns the section, "" for a run without a cold pass."""
    by_place = starts_by_place(results)
    if not by_place:
        return ""
    parts = [f"## {TITLE}"]
    for number, (place, starts) in enumerate(by_place.items()):
        parts.append(f"### {markdown.escape(place_label(place))}")
        lost = [text for cell in results.at(place) if (text := _lost(results, cell))]
        if starts:
            path = out / f"start-{number}-{markdown.slug(place_label(place))}"
            parts += [style.figure(path, f"{TITLE}: {place_label(place)}", draw, starts), _table(starts)]
        parts += [markdown.bullets(lost)] if lost else []
    table.write_lines(out / "start.csv", CSV_HEADER, _csv(by_place))
    return "\n\n".join([*parts, "All numbers: [start.csv](start.csv).", markdown.escape(CAPTION)])


def _lost(results: Results, cell: Cell) -> str:
    """Says which processes are left out and why, and names the warnings of the others; "" without either."""
    records = _records(results, cell)
    bad = [record for record in records if record["status"] != "ok"]
    if cell.apart or not records:
        return f"{markdown.escape(cell.label)}: unavailable: {markdown.escape(cell.apart or cell.reason)}"
    texts = [f"{len(bad)} of {len(records)} left out: {bad[0]['status']}: {bad[0]['reason']}"] if bad else []
    texts += {text for record in records if record.get("pass") == "cold" for text in record["warnings"]}
    return f"{markdown.escape(cell.label)}: {markdown.escape('; '.join(sorted(texts)))}" if texts else ""


def _names(starts: list[Start]) -> list[str]:
    """Returns the phases of all starts, in the order of a process's life."""
    there = {name for start in starts for name in start.phases}
    return [*(name for name in style.PHASES if name in there), *sorted(there - {*style.PHASES, FRAME}), FRAME]


def _table(starts: list[Start]) -> str:
    names = _names(starts)
    rows = [
        [
            start.variant,
            start.state,
            *(quantity.seconds(start.phases[name]) if name in start.phases else "none" for name in names),
            quantity.seconds(start.total),
            "none" if start.build is None else quantity.seconds(start.build),
        ]
        for start in starts
    ]
    return markdown.table(["renderer", "cache", *names, "sum", BUILD], rows)


def _csv(by_place: dict[tuple[str, str], list[Start]]) -> list[tuple]:
    rows = []
    for (scene, point), starts in by_place.items():
        for start in starts:
            name = scene, point, start.variant, start.state
            rows += [
                (*name, phase, seconds, None, None, start.total.processes) for phase, seconds in start.phases.items()
            ]
            rows.append((*name, "sum", start.total.value, start.total.low, start.total.high, start.total.processes))
            rows += [(*name, BUILD, start.build, None, None, 1)] if start.build is not None else []
    return rows


def draw(starts: list[Start]):
    """Draws a bar for each start, divided into its phases."""
    figure, axes = plt.subplots(figsize=(7.2, HEAD + ROW * len(starts)), layout="constrained")
    names = _names(starts)
    shades = {**style.PHASES, FRAME: style.PHASES["render"]}
    for row, start in enumerate(starts):
        left = start.build or 0.0
        if start.build is not None:
            axes.barh(row, left, color=style.PHASES["compile"], hatch="///", edgecolor="#999999", lw=0, height=0.7)
        end = left + start.total.value
        for name in names:
            width = start.phases.get(name, 0.0)
            axes.barh(row, width, left=left, color=shades.get(name, style.OTHER_PHASE), height=0.7, lw=0)
            left += width
        if start.total.low is not None:
            shift = start.build or 0.0
            axes.plot([start.total.low + shift, start.total.high + shift], [row, row], color="black", lw=1)
            left = max(left, start.total.high + shift)
        axes.text(max(left, end), row, f"  {quantity.seconds(end)}", va="center", fontsize=6)
    axes.set_yticks(range(len(starts)), [f"{start.variant}, {start.state}" for start in starts])
    axes.set(
        xlabel="time since the start of the process (s); hatched: the build before it", ylim=(len(starts) - 0.5, -0.5)
    )
    axes.margins(x=0.1)
    axes.set_xlim(left=0)
    patches = [Patch(color=shades.get(name, style.OTHER_PHASE), label=name) for name in names]
    figure.legend(handles=patches, loc="outside lower center", ncols=len(patches))
    return figure
