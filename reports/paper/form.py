"""Says how wide figures and tables are where they are shown, and keeps the letters of figures legible there."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from harness.errors import UserError

INCH = 25.4  # mm
COLUMN, LEAST = 150.0, 6.0  # mm, of a text column; points of the smallest letters of a figure that is so wide
NAMES = {"page": None, "thesis": COLUMN, "slides": 300.0}  # widths, mm; None: each figure as it is drawn
NARROWEST, WIDEST = 50.0, 1000.0  # mm


@dataclass(frozen=True)
class Form:
    """The width of all figures, mm; None: each as it is drawn, which suits a page of HTML."""

    width: float | None = None

    @property
    def column(self) -> float:
        """The width that a table may have, mm."""
        return self.width or COLUMN

    @property
    def smallest(self) -> float:
        """The points of the smallest letters of figures."""
        return LEAST * self.column / COLUMN

    def scale(self, figure: Figure) -> float:
        """Returns the size of the figure's files over that in which it is drawn."""
        return self.width / (INCH * figure.get_figwidth()) if self.width else 1.0


PAGE = Form()
_current: ContextVar[Form] = ContextVar("form", default=PAGE)


def current() -> Form:
    """Returns the form that figures and tables are written in now."""
    return _current.get()


@contextmanager
def written_in(form: Form) -> Iterator[None]:
    """Writes figures and tables within the `with` block in a form."""
    token = _current.set(form)
    try:
        yield
    finally:
        _current.reset(token)


def parse(text: str) -> Form:
    """Returns the form of a name, or of a width in mm. UserError if it is neither."""
    if text in NAMES:
        return Form(NAMES[text])
    try:
        width = float(text)
    except ValueError:
        width = 0.0
    if not NARROWEST <= width <= WIDEST:
        remedy = f"give {', '.join(NAMES)}, or a width from {NARROWEST:g} to {WIDEST:g} (mm)"
        raise UserError(f"--figures {text}: no form of figures", remedy=remedy)
    return Form(width)


def legible(figure: Figure) -> None:
    """Raises the letters of a figure that would be too small where it is as wide as a text column."""
    least = LEAST * INCH * figure.get_figwidth() / COLUMN
    for axes in figure.findobj(Axes):
        for axis in (axes.xaxis, axes.yaxis):
            for which, ticks in (("major", axis.get_major_ticks()), ("minor", axis.get_minor_ticks())):
                if ticks and ticks[0].label1.get_size() < least:
                    axis.set_tick_params(which, labelsize=least)  # also of the ticks that are made later
    for text in figure.findobj(Text):
        text.set_size(max(text.get_size(), least))
