"""Writes a drawn figure as SVG, PDF or PGF (for LaTeX), smaller or larger than it is drawn, without dates."""

import codecs
import re
from io import BytesIO
from typing import BinaryIO

from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.backends.backend_mixed import MixedModeRenderer
from matplotlib.backends.backend_pdf import Op, PdfFile, RendererPdf
from matplotlib.backends.backend_pgf import RendererPgf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from reports.paper import latex

SIDE = re.compile(rb'(?<= )(width|height)="([\d.]+)pt"')
NO_DATE = {"CreationDate": None, "Creator": None, "Producer": None}
POINTS = 72  # to an inch of PDF
HEAD = r"""%% {wide:.0f} mm wide, {high:.0f} mm high, letters in the font of the document.
%% In the preamble: \usepackage{{pgf}}. In the text: \input{{{name}}}
\begingroup\makeatletter
\setbox0=\hbox{{\begin{{pgfpicture}}
\pgfpathrectangle{{\pgfpointorigin}}{{\pgfqpoint{{{width:f}in}}{{{height:f}in}}}}%%
\pgfusepath{{use as bounding box, clip}}
"""
FOOT = r"""\end{{pgfpicture}}}}%%
\scalebox{{{scale:.5f}}}{{\box0}}\endgroup
"""


def svg(figure: Figure, file: BinaryIO, scale: float) -> None:
    """Writes SVG."""
    drawn = BytesIO()
    FigureCanvasSVG(figure).print_svg(drawn, metadata={"Date": None, "Creator": None})
    if scale == 1:
        file.write(drawn.getvalue())
    else:  # the two sides of the outermost element, which come first
        size = lambda match: b'%s="%fpt"' % (match[1], float(match[2]) * scale)  # noqa: E731
        file.write(SIDE.sub(size, drawn.getvalue(), count=2))


def pdf(figure: Figure, file: BinaryIO, scale: float) -> None:
    """Writes PDF."""
    dpi, figure.dpi = figure.dpi, POINTS
    try:
        wide, high = figure.get_size_inches()
        made = PdfFile(file, metadata=NO_DATE)
        made.newPage(scale * wide, scale * high)
        if scale != 1:
            made.output(scale, 0, 0, scale, 0, 0, Op.concat_matrix)
        renderer = MixedModeRenderer(figure, wide, high, dpi, RendererPdf(made, dpi, high, wide))
        figure.draw(renderer)
        renderer.finalize()
        made.finalize()
        made.close()
    finally:
        figure.dpi = dpi


class _Pgf(RendererPgf):
    """Measures letters in a font of matplotlib, which needs no LaTeX, and escapes what LaTeX would read."""

    def __init__(self, figure: Figure, file):
        super().__init__(figure, file)
        self.measure = RendererAgg(1, 1, figure.dpi).get_text_width_height_descent

    def get_text_width_height_descent(self, s, prop, ismath):
        return self.measure(s, prop, ismath)

    def draw_text(self, gc, x, y, s, prop, angle, ismath=False, mtext=None):
        super().draw_text(gc, x, y, latex.escape(s), prop, angle, ismath, mtext)


def has_pixels(figure: Figure) -> bool:
    """Whether a figure shows pictures, which PGF would need beside it, each in a file of its own."""
    return bool(figure.findobj(AxesImage))


def pgf(figure: Figure, file: BinaryIO, scale: float, name: str) -> None:
    """Writes PGF without LaTeX, for a figure without pixels. name: of the file."""
    wide, high = figure.get_size_inches()
    out = codecs.getwriter("utf-8")(file)
    millimetres = {"wide": 25.4 * scale * wide, "high": 25.4 * scale * high}
    out.write(HEAD.replace("%%", "%").format(**millimetres, name=name, width=wide, height=high))
    figure.draw(MixedModeRenderer(figure, wide, high, figure.dpi, _Pgf(figure, out)))
    out.write(FOOT.replace("%%", "%").format(scale=scale))
