"""Styles and saves every figure: one look, one colour per variant, files whose bytes depend on the data alone."""

import logging
import math
import textwrap
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib import font_manager
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, MaxNLocator

from harness.system import output
from reports.paper import drawn, form, markdown, vector
from reports.run.method import SUPERSCRIPT
from reports.run.stored import STEP

DPI = 200
LETTERS = 15  # of a title, to the inch
SMALL = 7.4  # points of small letters, 6 of a figure 7.2 inches wide in a column (form.py)
EM, KEY = 0.55, 0.4  # width of a letter over its size; of a legend's sign with the gaps around it, inches
ACROSS = "across"  # gid of a text that lies over a chart on purpose

# Okabe and Ito's colours, which people with any colour vision tell apart (jfly.uni-koeln.de/color).
COLOURS = {
    "python": "#0072B2",
    "numpy": "#56B4E9",
    "numba": "#E69F00",
    "numba-parallel": "#D55E00",
    "cpp": "#009E73",
    "cpp-threads": "#005C43",
    "numba-cuda": "#CC79A7",
}
OUTLINE = [withStroke(linewidth=2, foreground="white")]  # of text that may lie over data
SPARE = ("#8C6BB1", "#7F5539", "#B5A300", "#5B8DB8", "#999999")  # no black, which is that of intervals and axes

FIXED = FIXED_WHITE, FIXED_BLACK = "#fffffe", "#000001"  # of text over a colour, which no dark page changes
ON_DARK = {"#005C43": "#7FD6BC", "#000000": "#E6E9EC", "#7F5539": "#B98A66"}

PHASES = {
    "start": "#D9D9D9",
    "import": "#BFD3E6",
    "load": "#8C96C6",
    "build": "#80CDC1",
    "compile": "#FDD49E",
    "upload": "#C994C7",
    "render": "#C7E9C0",
    "download": "#DF65B0",
    "save": "#FCBBA1",
    "exit": "#D9D9D9",
}
OTHER_PHASE = "#EEEEEE"

# Fonts of systems for letters that DejaVu Sans lacks, in the order in which they are tried.
OTHER_FONTS = (
    "Noto Sans CJK SC", "Noto Sans CJK JP", "Source Han Sans SC", "Droid Sans Fallback", "WenQuanYi Micro Hei",
    "WenQuanYi Zen Hei", "IPAGothic", "NanumGothic", "Noto Sans Arabic", "Noto Sans Devanagari", "Noto Emoji",
    "Symbola", "Microsoft YaHei", "Yu Gothic", "Malgun Gothic", "Segoe UI Symbol", "PingFang SC", "Hiragino Sans",
    "Arial Unicode MS",
)  # fmt: skip


def fonts() -> list[str]:
    """Returns the fonts of texts: DejaVu Sans, which comes with matplotlib, so that figures are the same everywhere.

    Letters that it lacks are taken from fonts of the system, and else are boxes that name their script.
    """
    # Those of other letters have no bold, which is not worth a line on standard error.
    logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)
    installed = set(font_manager.get_font_names())
    return ["DejaVu Sans", *(name for name in (*OTHER_FONTS, "Last Resort High-Efficiency") if name in installed)]


RC = {
    "figure.dpi": DPI,
    "savefig.dpi": DPI,
    "pdf.fonttype": 42,  # TrueType: publishers refuse fonts of Type 3
    "font.family": fonts(),
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "axes.spines.top": False,
    "axes.linewidth": 0.6,
    "axes.axisbelow": True,
    "grid.linewidth": 0.4,
    "grid.color": "#DDDDDD",
    "legend.frameon": False,
    "legend.fontsize": SMALL,
    "xtick.minor.pad": 5.0,  # labels of minor ticks stand on the line of the others
    "ytick.minor.pad": 5.0,
    "pgf.rcfonts": False,  # letters in the font of the document
    "text.parse_math": False,  # a "$" in a name is a "$"
    "svg.hashsalt": "rayrace",
}


@contextmanager
def styled():
    """Gives the style to figures that are drawn and saved inside the `with` block."""
    with matplotlib.rc_context(), plt.style.context(["default", RC]):
        yield


def colour(variant: str, variants: list[str]) -> str:
    """Returns the colour of a variant: its own, else a spare one by its place among the unknown variants."""
    unknown = [name for name in variants if name not in COLOURS]
    return COLOURS.get(variant) or SPARE[unknown.index(variant) % len(SPARE)]


def dark(colour: str) -> str:
    """Returns the colour that stands for `colour` on a dark page: the same, unless it would be too dark."""
    return ON_DARK.get(colour, colour)


def log_ticks(axis, narrow: bool = False) -> None:
    """Labels a logarithmic axis: decades, on a short axis also 2 and 5, on a very short one all; two labels at least.

    Decades are powers of ten where one of them would have more than five digits. An axis that is linear near 0 (symlog)
    has a 0, and nothing below or beside it. narrow: there is no room for all.
    """

    def minor(value, _):
        low, high = sorted(axis.get_view_interval())
        if low <= 0:
            return ""
        return f"{value:.3g}" if any(math.isclose(value, label) for label in _between(low, high, narrow)) else ""

    def major(value, _):
        low, high = axis.get_view_interval()
        if low >= 1e-4 and high < 1e5:
            return f"{value:g}"
        near = getattr(axis.get_transform(), "linthresh", 0.0)  # below it the axis is linear, and a 0 has the room
        if value < 3 * near:
            return "" if value else "0"
        power = round(math.log10(value))
        return f"10{str(power).translate(SUPERSCRIPT)}" if power else "1"

    if isinstance(axis.get_minor_locator(), LogLocator):
        axis.set_minor_locator(_Minor(subs=range(2, 10)))
    axis.set_major_formatter(major)
    axis.set_minor_formatter(minor)


class _Minor(LogLocator):
    """Places multiples of powers of ten, and between two of them even steps where an axis has no more than one."""

    def tick_values(self, vmin: float, vmax: float):
        low, high = sorted((vmin, vmax))
        if low > 0 and len(_multiples(low, high, range(1, 10))) < 2:
            return [value for value in _even(low, high) if value not in _multiples(low, high, (1,))]
        return super().tick_values(vmin, vmax)


def _between(low: float, high: float, narrow: bool) -> list[float]:
    """Returns the numbers between decades that get a label on an axis from low to high."""
    every, some = _multiples(low, high, range(1, 10)), _multiples(low, high, (1, 2, 5))
    decades = _multiples(low, high, (1,))
    if len(every) < 2:
        chosen = _even(low, high)
    elif high / low < 6 and not narrow:
        chosen = every
    elif high / low < 30 or len(decades) < 2:
        chosen = some if len(some) > 1 else [every[0], every[-1]]
    else:
        chosen = []
    return [value for value in chosen if value not in decades]


def _multiples(low: float, high: float, digits) -> list[float]:
    """Returns the numbers from low to high that are a digit times a power of ten."""
    powers = range(math.floor(math.log10(low)), math.floor(math.log10(high)) + 1)
    return [value for power in powers for digit in digits if low <= (value := float(f"{digit}e{power}")) <= high]


def _even(low: float, high: float) -> list[float]:
    """Returns a few round numbers from low to high, which lie in one step of a digit."""
    return [
        value for value in MaxNLocator(nbins=3, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high) if low <= value <= high
    ]


def figure(path: Path, alt: str, draw: Callable[..., Figure], *arguments) -> str:
    """Saves the figure `draw(*arguments)` in the style (see `save`); returns the Markdown that shows it."""
    with styled():
        made = draw(*arguments)
        form.legible(made)
        save(made, path)
    return markdown.figure(path.name, alt)


def entitle(figure: Figure, text: str) -> None:
    """Sets a long title at the left, each of its lines in as many as it needs."""
    figure.suptitle(wrapped(text, figure.get_figwidth()), x=0.01, ha="left", fontsize=8)


def wrapped(text: str, wide: float) -> str:
    """Returns a title with its lines broken to fit into so many inches."""
    return "\n".join(textwrap.fill(line, int(LETTERS * wide)) for line in text.splitlines())


def columns(names: list[str], wide: float, most: int, size: float = RC["legend.fontsize"]) -> int:
    """Returns in how many columns of a legend, `wide` inches in all, each name fits; 1 if one is too long for two."""
    return max(1, min(most, int(wide / (KEY + max(map(len, names)) * EM * size / 72))))


def visible_step(axes, right: bool = True) -> None:
    """Draws a line at an error of 1/255, a step of an 8-bit picture, with its name at the right or left end."""
    axes.axhline(STEP, color="#888888", lw=0.8)
    text, x, side = ("1/255 ", 1, "right") if right else (" 1/255", 0, "left")
    axes.text(x, STEP, text, transform=axes.get_yaxis_transform(), ha=side, va="bottom", fontsize=6)


def across(axes, text: str) -> None:
    """Writes across a chart what its values are not, such as those of a simulator; nothing for an empty text."""
    if not text:
        return
    wide = axes.get_position().width * axes.figure.get_figwidth()
    size = min(22, 72 * 1.5 * wide / max(1, len(text)))
    at = {"transform": axes.transAxes, "ha": "center", "va": "center", "rotation": 15, "zorder": 9, "gid": ACROSS}
    axes.text(0.5, 0.5, text, fontsize=size, color="#B00020", alpha=0.55, fontweight="bold", **at)


def save(figure: Figure, path: Path) -> None:
    """Writes `path`.png, .svg and .pdf, without dates, and `path`.json with the hash of the data; closes the figure.

    They are as wide as the form says (form.py). For a text or slides there is also `path`.pgf, unless the figure shows
    pictures.
    """
    shape = form.current()
    scale = shape.scale(figure)
    size = {"pil_kwargs": {"dpi": (DPI / scale, DPI / scale)}} if shape.width else {}  # the same pixels
    save_as(figure, path.with_suffix(".png"), own=True, metadata={"Software": None}, **size)
    # The others have the same layout, which takes longer than drawing; `savefig` would draw them twice.
    figure.set_layout_engine("none")
    for suffix, draw in ((".svg", vector.svg), (".pdf", vector.pdf)):
        output.write(path.with_suffix(suffix), lambda file, draw=draw: draw(figure, file, scale), sync=False)
    if shape.width and not vector.has_pixels(figure):
        pgf = path.with_suffix(".pgf")
        output.write(pgf, lambda file: vector.pgf(figure, file, scale, pgf.name), sync=False)
    drawn.describe(figure, path)
    plt.close(figure)


def save_as(figure: Figure, path: Path, own: bool = False, **options) -> None:
    """Writes a figure to `path`, whose suffix matplotlib knows. own: in a folder of rayrace (output.py)."""
    form = path.suffix.removeprefix(".")
    output.write(path, lambda file: figure.savefig(file, format=form, **options), own, sync=False)
