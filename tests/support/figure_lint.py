"""Finds faults that a reader of a figure would see: text that is clipped, overlaps or is crossed, empty axes, sizes."""

import itertools
import re
from contextlib import contextmanager

from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.path import Path

from reports.paper import style

LARGEST = 8.0, 12.0  # inches: about a page
OVERLAP = 1.5  # pixels at 200 dpi by which boxes may overlap: letters do not fill theirs
EXPONENT, PLAIN = re.compile(r"^[-−]?\d(\.\d+)?e[-+]?\d+$"), re.compile(r"^[-−]?\d{4,}$")


def texts(figure: Figure) -> list:
    """Returns the visible texts of a drawn figure that are not empty."""
    found = [*figure.texts, *(text for legend in figure.legends for text in _legend(legend))]
    found += [figure._suptitle] if figure._suptitle else []
    for axes in filter(Artist.get_visible, figure.axes):
        found += [*axes.texts, axes.title, axes._left_title, axes._right_title]
        if axes.get_legend():
            found += _legend(axes.get_legend())
        if axes.axison:
            found += [label for axis in (axes.xaxis, axes.yaxis) for label in [axis.label, *ticks(axis)]]
    found = [text for text in found if text.get_visible() and text.get_gid() != style.ACROSS]
    seen = {id(text): text for text in found if text.get_text().strip()}
    return list(seen.values())


def ticks(axis) -> list:
    """Returns the labels of an axis that are drawn; matplotlib keeps others beyond its ends."""
    place = axis.get_transform().transform
    low, high = sorted(place(axis.get_view_interval()))
    told = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    room = 1e-9 * (high - low)
    shown = [tick for tick in told if low - room <= place(tick.get_loc()) <= high + room]
    return [label for tick in shown for label in (tick.label1, tick.label2) if label.get_visible()]


def _legend(legend) -> list:
    return [*legend.get_texts(), legend.get_title()]


def faults(figure: Figure) -> list[str]:
    """Draws a figure; returns what is wrong with it, in words."""
    figure.canvas.draw()
    wide, high = figure.get_size_inches()
    found = [f"larger than a page: {wide:.1f} x {high:.1f} inches"] * bool(wide > LARGEST[0] or high > LARGEST[1])
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts(figure)]
    scale = figure.dpi / 200
    for text, box in boxes:
        if not (figure.bbox.padded(1).contains(box.x0, box.y0) and figure.bbox.padded(1).contains(box.x1, box.y1)):
            found.append(f"clipped: {text!r}")
    for (text, box), (other, beside) in itertools.combinations(boxes, 2):
        if box.padded(-OVERLAP * scale).overlaps(beside.padded(-OVERLAP * scale)):
            found.append(f"overlapping: {text!r} and {other!r}")
    for number, axes in enumerate(figure.axes):
        if not axes.get_visible():
            continue
        if axes.axison and not (axes.lines or axes.patches or axes.collections or axes.images or axes.texts):
            found.append(f"axes {number} are empty")
        found += _struck(axes)
        for name, axis in (("x", axes.xaxis), ("y", axes.yaxis)):
            labels = [label.get_text() for label in ticks(axis) if label.get_text()]
            if axis.get_scale() == "log" and len(labels) == 1:
                found.append(f"axes {number}: one number along {name}: {labels}")
            if any(map(EXPONENT.match, labels)) and any(map(PLAIN.match, labels)):
                found.append(f"axes {number}: two ways to write numbers along {name}: {labels}")
    return found


def _struck(axes) -> list[str]:
    """Returns faults of texts inside axes that a mark, a bar or a curve crosses.

    Text with an outline or a background stands that.
    """
    found = []
    mine = {id(text) for text in axes.texts}
    shown = [text for text in texts(axes.figure) if id(text) in mine]
    plain = [text for text in shown if not text.get_path_effects() and not text.get_bbox_patch()]
    boxes = [(text.get_text(), text.get_window_extent()) for text in plain]
    for line in axes.lines if boxes else ():
        if line.get_transform() != axes.transData or not line.get_visible():
            continue  # a guide in the coordinates of the axes
        places = axes.transData.transform(line.get_xydata())
        marked = line.get_marker() not in ("", "None", None)
        solid = line.get_linestyle() not in ("", "None", " ")
        for text, box in boxes:
            inner = box.padded(-0.2 * min(box.width, box.height))
            crossed = solid and len(places) > 1 and Path(places).intersects_bbox(inner, filled=False)
            if crossed or (marked and any(inner.contains(*place) for place in places)):
                found.append(f"crossed by data: {text!r}")
    return list(dict.fromkeys(found))


@contextmanager
def lint():
    """Within the block every figure that a report saves is examined; gives a dict {name: faults}, filled as it goes."""
    found, save = {}, style.save

    def examined(figure, path):
        told = faults(figure)
        if told:
            found[path.name] = told
        save(figure, path)

    style.save = examined
    try:
        yield found
    finally:
        style.save = save
