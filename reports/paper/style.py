"""The look of every figure: one style, one colour a variant, files whose bytes depend on the data alone."""

from contextlib import contextmanager
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from reports.paper import drawn

DPI = 200

# Okabe and Ito's colours, told apart with any colour vision (jfly.uni-koeln.de/color).
COLOURS = {
    "python": "#0072B2",
    "numpy": "#56B4E9",
    "numba": "#E69F00",
    "numba-parallel": "#D55E00",
    "cpp": "#009E73",
    "cpp-threads": "#005C43",
    "numba-cuda": "#CC79A7",
}
SPARE = ("#000000", "#999999", "#8C6BB1", "#7F5539", "#B5A300", "#5B8DB8")

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

RC = {
    "figure.dpi": DPI,
    "savefig.dpi": DPI,
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same everywhere
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "axes.spines.top": False,
    "axes.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 7,
    "text.parse_math": False,  # a "$" in a name is a "$"
    "svg.hashsalt": "rayrace",
}


@contextmanager
def styled():
    """Within it, figures have the style."""
    with matplotlib.rc_context(), plt.style.context(["default", RC]):
        yield


def colour(variant: str, variants: list[str]) -> str:
    """Returns the colour of a variant: its own, else a spare one by its place among the unknown."""
    unknown = [name for name in variants if name not in COLOURS]
    return COLOURS.get(variant) or SPARE[unknown.index(variant) % len(SPARE)]


def log_ticks(axis, narrow: bool = False) -> None:
    """Numbers without exponents on a logarithmic axis; between decades at 2 and 5 or everywhere, if it is short.

    narrow: is there no room for all of them?
    """

    def minor(value, _):
        low, high = sorted(axis.get_view_interval())
        if (high / low < 6 and not narrow) or (high / low < 30 and f"{value:.3e}"[:5] in ("2.000", "5.000")):
            return f"{value:.3g}"
        return ""

    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_formatter(minor)


def save(figure: Figure, path: Path) -> None:
    """Write `path`.png, .svg and .pdf, without dates, and .json, which tells what they show; and close the figure."""
    figure.savefig(path.with_suffix(".png"), metadata={"Software": None})
    figure.savefig(path.with_suffix(".svg"), metadata={"Date": None, "Creator": None})
    figure.savefig(path.with_suffix(".pdf"), metadata={"CreationDate": None, "Creator": None, "Producer": None})
    drawn.describe(figure, path)
    plt.close(figure)
