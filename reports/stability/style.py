"""Gives charts of failures a common look: colours of ways, marks of variants, lines of precisions."""

import textwrap

from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from reports.paper import style
from reports.run.cell import Cell
from reports.run.results import Results, grouped
from reports.stability.stability import Row, Way

ROBUST = "#0072B2", "#009E73", "#56B4E9", "#7A68C2"  # Okabe and Ito's cold colours, and one more
FRAIL = "#D55E00", "#E69F00", "#CC79A7", "#8C510A", "#B5A300", "#666666", "#F0A58F", "#000000"
MARKERS = "osD^vP*X"
LINES = {"float64": "-", "float32": (0, (4, 1.5))}
OTHER_LINE = "-."
THEORY = (0, (1.5, 1.5))
SMALL = style.SMALL  # points
LETTERS = 17  # of small print, to the inch
GREY, PALE = "#888888", "#DDDDDD"


def colours(ways: list[Way]) -> dict[Way, str]:
    """Returns a cold colour for each robust way, a warm one for each naive way."""
    shades = {}
    for palette, group in ((ROBUST, [w for w in ways if not w.naive]), (FRAIL, [w for w in ways if w.naive])):
        shades |= {way: palette[number % len(palette)] for number, way in enumerate(group)}
    return shades


def marker(variant: str, variants: list[str], more: float = 0.0) -> dict:
    """Returns a hollow marker; later variants have smaller ones, so that none hides another. more: size, points."""
    number = variants.index(variant)
    size = more + 6 - 3 * number / max(1, len(variants) - 1)
    return {"marker": MARKERS[number % len(MARKERS)], "ms": size, "mfc": "none", "mew": 0.7}


def line(precision: str):
    return LINES.get(precision, OTHER_LINE)


def short(value: float) -> str:
    """Returns a number such as 1e6, 0.5, 3e-12."""
    number, _, exponent = f"{value:.3g}".partition("e")
    return f"{number}e{int(exponent)}" if exponent else number


def stress_axis(axes, row: Row) -> None:
    """Sets the axis of stress, from mild at the left to extreme at the right."""
    levels = row.levels
    axes.set_xlabel(textwrap.fill(f"{row.facts['stress']}  (mild → extreme)", 48))
    if row.logarithmic:
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(numticks=8))
    else:
        axes.xaxis.get_major_locator().set_params(integer=all(level == int(level) for level in levels))
    axes.xaxis.set_major_formatter(lambda value, _: short(value))
    axes.xaxis.minorticks_off()
    if row.logarithmic:
        room = (max(levels) / min(levels)) ** 0.04 if len(levels) > 1 else 2
        ends = [min(levels) / room, max(levels) * room]
    else:
        room = 0.04 * (max(levels) - min(levels)) or 1
        ends = [min(levels) - room, max(levels) + room]
    axes.set_xlim(*(reversed(ends) if levels[0] > levels[-1] else ends))
    axes.grid()


def amount_axis(axes, values: list[float], most: float | None = None) -> None:
    """Sets a logarithmic axis with a 0 at the lower edge. values: it contains them. most: the largest value."""
    some = [value for value in values if value > 0]
    least, largest = min(some, default=0.1), most or max(some, default=1.0)
    axes.set_yscale("symlog", linthresh=least, linscale=0.5)
    axes.set_ylim(-0.12 * least, 2 * largest)
    lowest, highest = (round(power) for power in (_floor_log(least), _floor_log(2 * largest)))
    step = max(1, -(-(highest - lowest) // 7))
    powers = [10.0**power for power in range(highest, lowest - 1, -step)]
    axes.set_yticks([0, *sorted(power for power in powers if power >= least)])
    axes.yaxis.set_major_formatter(lambda value, _: short(value))
    axes.yaxis.minorticks_off()
    axes.grid()


def _floor_log(value: float) -> int:
    return int(f"{value:e}".partition("e")[2])


def variants(results: Results, rows: list[Row]) -> list[str]:
    """Returns the variants of some rows in the order of the run."""
    return [name for name in results.variants if any(name in row.variants for row in rows)]


def key(row: Row) -> tuple[list[Line2D], list[str]]:
    """Returns handles and labels: a colour for each way, a mark for each variant, a line for each precision."""
    shades, variants = colours(row.ways), row.variants
    handles = [Line2D([], [], color=shades[way], lw=2) for way in row.ways]
    labels = [f"{way.name} (naive)" if way.naive else way.name for way in row.ways]
    handles += [Line2D([], [], ls="", color="black", **marker(variant, variants)) for variant in variants]
    handles += [Line2D([], [], color="black", lw=1, ls=line(precision)) for precision in row.precisions]
    return handles, [*labels, *variants, *row.precisions]


def frame(figure, title: str, keys: tuple[list, list[str]], note: str) -> None:
    """Adds a title and keys above a constrained figure and a grey note of its origin below, and makes it taller."""
    wide, high = figure.get_size_inches()
    title, note = textwrap.fill(title, int(wide * 14)), textwrap.fill(note, int(wide * LETTERS))
    head = 0.09 + 0.145 * len(title.splitlines())
    legend, lines = _legend(figure, keys)
    above = head + 0.06 + 0.135 * lines
    below = 0.08 + 0.13 * len(note.splitlines())
    full = high + above + below
    figure.set_size_inches(wide, full)
    figure.get_layout_engine().set(rect=(0, below / full, 1, high / full))
    figure.text(0.06 / wide, 1 - 0.06 / full, title, fontsize=8, fontweight="bold", va="top")
    figure.text(0.06 / wide, 0.05 / full, note, fontsize=SMALL, color=GREY, va="bottom")
    if legend:
        legend.set_bbox_to_anchor((0, 1 - head / full))


def _legend(figure, keys: tuple[list, list[str]]):
    """Adds a legend in as many columns as there is room for; returns it, or None without keys, and its lines."""
    wide = figure.get_figwidth() * figure.dpi
    for columns in range(min(8, len(keys[0])), 0, -1):
        legend = figure.legend(*keys, loc="upper left", ncols=columns, borderpad=0.2, fontsize=SMALL,
                               handlelength=2.2, columnspacing=1.2, labelspacing=0.35)  # fmt: skip
        if columns == 1 or legend.get_window_extent().width <= wide:
            return legend, -(-len(keys[0]) // columns)
        legend.remove()
    return None, 0


def origin(results: Results, cells: list[Cell]) -> str:
    """Returns the seed, and versions and flags that the renderers reported."""
    wanted = {cell.variant for cell in cells}
    rows = [row for cell in cells for row in cell.timed]
    records = grouped((results.records[row] for row in rows), lambda record: record["variant"])
    built = grouped(
        (name for name in results.variants if name in wanted), lambda variant: _built(records.get(variant, []))
    )
    names = [f"{', '.join(variants)} {text}" for text, variants in built.items()]
    return f"Seed {results.facts['experiment']['seed']}. {'; '.join(names)}."


def _built(records: list[dict]) -> str:
    """Describes one variant: its version, compiler and flags, each once."""
    version = next((record["renderer_version"] for record in records), "unavailable")[:7]
    parts: dict[str, dict[str, None]] = {}
    for record in records:
        contraction = ((record["used"] or {}).get("methods") or {}).get("contraction")
        for name, value in {**(record["versions"] or {}), "contraction": contraction}.items():
            if value is not None and name not in ("implementation", "standard"):
                parts.setdefault(name, {})[str(value)] = None
    words = [" or ".join(v) if n in ("flags", "compiler") else f"{n} {' or '.join(v)}" for n, v in parts.items()]
    return f"{version} ({', '.join(words) or 'no versions reported'})"
