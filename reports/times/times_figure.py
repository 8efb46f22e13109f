"""Draws steady times: a panel for each place with medians, intervals, the study's times and the errors."""

import textwrap
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

from reports.accuracy import accuracy_columns
from reports.paper import markdown, style, thinning
from reports.run import launch, naming, ranking, study
from reports.run.results import Missing, Results
from reports.run.words import all_against

TITLE = "Times, drawn"
CAPTION = (
    "Large: the median time of a steady frame over processes, with its 95 % interval where there are enough; small: "
    "each process, outlying ones too. Only what is ranked is drawn. Beside each row the error of the picture over all "
    "pixels, and whether it agrees with another renderer's, as in the table of times. Hollow: the study's time for the "
    "same case on its own machine. Of points that differ only in how the kernel of a GPU is launched the one with the "
    "lowest median is drawn."
)

ROW, HEAD, FOOT, WIDTH, LINE = 0.22, 0.95, 0.3, 7.7, 0.14  # inches
RIGHT = 2.7  # inches beside a panel
HEADER, BESIDE = ("RMSE", "largest", "beyond 1/255", "agrees"), (5, 50, 95, 153)  # points right of a panel
SMALL = 7.85  # points of the letters there, 6 in a column (form.py)
LONGEST = 40  # letters of a name
LEAST_RANGE = 2.0  # of an axis: its end over its start
HIGHEST = 12.0  # inches of a figure, panels beyond are left out
MARKS = ("o", "black"), ("D", "white")  # ours, the study's


def drawable(results: Results, scene: str) -> list[tuple[str, str]]:
    """Returns the places of a scene with a ranked cell."""
    return [place for place, _ in launch.places(results) if place[0] == scene and ranking.ranked(results, place)]


def shown(results: Results, scene: str) -> list[tuple[str, str]]:
    """Returns the places of a scene to draw: as many as a figure has room for, evenly spread."""
    there, letters = drawable(results, scene), _letters(results, scene)
    heights = {place: _height(results, place, letters) for place in there}
    for most in range(len(there), 1, -1):
        places = thinning.few(there, most)
        if sum(heights[place] for place in places) <= HIGHEST - FOOT:
            return places
    return there[:1]


def _height(results: Results, place: tuple[str, str], letters: int) -> float:
    """Returns the height of a panel, inches."""
    return len(ranking.ranked(results, place)) * ROW + HEAD + LINE * _title(results, place, letters).count("\n")


def _letters(results: Results, scene: str) -> int:
    """Returns the most letters of a line of a title, which ends before the errors beside it."""
    names = max((len(name) for place in drawable(results, scene) for name in _names(results, place)), default=0)
    bold = 1.1  # of a letter over a plain one
    return int(((WIDTH - RIGHT) / (style.EM * style.RC["font.size"] / 72) - names) / bold)


def _title(results: Results, place: tuple[str, str], letters: int) -> str:
    """Returns the title of a panel."""
    return textwrap.fill(naming.called(results, place), letters)


def _names(results: Results, place: tuple[str, str]) -> list[str]:
    return [textwrap.shorten(cell.name, LONGEST) for cell in ranking.ranked(results, place)]


def draw(results: Results, scene: str):
    """Draws a scene with a ranked cell."""
    places, letters = shown(results, scene), _letters(results, scene)
    heights = [_height(results, place, letters) for place in places]
    figure, panels = plt.subplots(
        len(places), 1, figsize=(WIDTH, sum(heights) + FOOT), squeeze=False, height_ratios=heights, layout="constrained"
    )
    for place, axes in zip(places, panels[:, 0], strict=True):
        _panel(results, place, letters, axes)
    if any(study.case(cell) for cell in results.of(scene)):
        ours, published = (Line2D([], [], ls="", marker=marker, mfc=fill, mec="black") for marker, fill in MARKS)
        figure.legend([ours, published], ["here", "the study, on its machine"], loc="outside lower center", ncols=2)
    return figure


def _panel(results: Results, place: tuple[str, str], letters: int, axes) -> None:
    cells = ranking.ranked(results, place)
    for row, cell in enumerate(cells):
        time, values = cell.steady, cell.values("steady_s")
        colour = style.colour(cell.variant, results.variants)
        if time.low is not None:
            axes.plot([time.low, time.high], [row, row], color=colour, lw=1.5)
        axes.plot(values, [row] * len(values), ".", color=colour, ms=2.5, alpha=0.6)
        axes.plot(time.value, row, "o", color=colour, ms=5)
        published = study.find(study.TIMES_S, cell)
        if not isinstance(published, Missing):
            axes.plot(published.value, row, "D", mfc="white", mec=colour, ms=5)
        _beside(axes, (1, row), axes.get_yaxis_transform(), accuracy_columns.brief(cell))
    _beside(axes, (1, 1), axes.transAxes, HEADER, up=4)
    against = all_against(cell.against for cell in cells)
    below = f"steady frame (s)\nerrors beside it: {against}" if against else "steady frame (s)"
    axes.set(xscale="log", xlabel=below, ylim=(len(cells) - 0.5, -0.5))
    low, high = axes.get_xlim()
    if high < LEAST_RANGE * low:  # a few per cent are no reason to look closer
        middle = (low * high) ** 0.5
        axes.set_xlim(middle / LEAST_RANGE**0.5, middle * LEAST_RANGE**0.5)
    style.log_ticks(axes.xaxis)
    axes.set_yticks(range(len(cells)), _names(results, place))
    axes.set_title(_title(results, place, letters), loc="left", fontweight="bold")
    axes.grid(axis="x", color="#CCCCCC")


def _beside(axes, at: tuple[float, float], of, texts: tuple[str, ...], up: float = 0) -> None:
    """Writes texts right of a place in coordinates `of`, or so many points above it."""
    for place, text in zip(BESIDE, texts, strict=True):
        axes.annotate(
            text, at, xycoords=of, xytext=(place, up), textcoords="offset points", va="bottom" if up else "center",
            fontsize=SMALL,
        )  # fmt: skip


def write(results: Results, out: Path) -> str:
    """Writes times-NUMBER-SCENE.png and .svg for each scene; returns the section of the report."""
    if all(cell.unranked for cell in results.cells):
        return markdown.unavailable(TITLE, "nothing is ranked")
    parts = [f"## {TITLE}"]
    for number, scene in enumerate(results.scenes):
        there = drawable(results, scene)
        if not there:
            parts.append(f"{markdown.escape(scene)}: unavailable: nothing is ranked.")
            continue
        path = out / f"times-{number}-{markdown.slug(Path(scene).stem)}"
        parts += [f"### {markdown.escape(scene)}", style.figure(path, f"Times: {scene}", draw, results, scene)]
        drawn = len(shown(results, scene))
        parts.append(thinning.note(drawn, len(there), "places", "the numbers of all are in the table's CSV"))
    return "\n\n".join(filter(None, [*parts, markdown.escape(CAPTION)]))
