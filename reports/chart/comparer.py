"""Prepares the picture comparer of the page: pictures of one place, their truths, errors and FLIP maps."""

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import LogNorm

from reports.chart.embedded import Embedded, smaller
from reports.pictures import pictures_figure
from reports.run import naming, stored
from reports.run.cell import Cell, Missing
from reports.run.results import Results

LONGEST = 640  # pixels of a side; a larger picture is reduced
MOST = 40  # pictures of a place
GREY = (221, 221, 221)


def data(results: Results, pictures: Embedded) -> dict:
    """Returns `places` with pictures to compare and a note for the page; {} without pictures. Adds to `pictures`."""
    by_place = pictures_figure.places(results)
    places, there = [], 0
    for place, cells in by_place:
        if cells[0].pixels == 1:
            continue
        truth = _truth(results, pictures_figure.with_truth(results, cells), pictures)
        shown = [picture for cell in cells[:MOST] if (picture := _picture(results, cell, pictures))]
        there += len(cells)
        if shown:
            places.append({"label": naming.called(results, place), "pictures": shown + ([truth] if truth else [])})
    if not places:
        return {}
    count = sum(not picture["truth"] for place in places for picture in place["pictures"])
    lacking = f"This page holds {count} of {there} pictures: the others were not stored, or did not fit."
    return {"places": places, "says": lacking if count < there else ""}


def _truth(results: Results, cell: Cell, pictures: Embedded) -> dict | None:
    truth = stored.truth(results, cell)
    if isinstance(truth, Missing) or truth.ndim != 3:
        return None
    seen = smaller(stored.displayed(truth, cell), LONGEST)
    key = pictures.add_pixels(seen, exact=True)
    if key is None:
        return None
    size, details = [seen.shape[1], seen.shape[0]], pictures_figure.told_of_truth(results, cell)
    names = {"label": "the truth", "verdict": "", "told": details, "truth": True}
    return {**names, "size": size, "picture": key, "error": None, "flip": None}


def _picture(results: Results, cell: Cell, pictures: Embedded) -> dict | None:
    picture = stored.raw(results, cell)
    if isinstance(picture, Missing) or picture.ndim != 3:
        return None
    seen = smaller(stored.displayed(picture, cell), LONGEST)
    key = pictures.add_pixels(seen, exact=True)
    if key is None:
        return None
    return {
        "label": cell.label,
        "verdict": cell.verdict,
        "told": pictures_figure.notes(results, cell),
        "truth": False,
        "size": [seen.shape[1], seen.shape[0]],
        "picture": key,
        "error": _error(results, cell, picture, pictures),
        "flip": _flip(results, cell, pictures),
    }


def _error(results: Results, cell: Cell, picture: np.ndarray, pictures: Embedded) -> str | None:
    """Adds the picture's largest channel difference from the truth, coloured as in figure 4.1; returns its key."""
    truth = stored.truth(results, cell)
    if isinstance(truth, Missing) or truth.shape != picture.shape:
        return None
    difference = np.abs(picture - truth).max(axis=-1)
    positive = np.where(np.isfinite(difference) & (difference > 0), difference, 1)
    norm = LogNorm(pictures_figure.least(results, cell), 1.0, clip=True)
    pixels = colormaps["viridis"](norm(positive), bytes=True)[..., :3].copy()
    pixels[difference == 0] = GREY
    pixels[~np.isfinite(difference)] = np.multiply(stored.BROKEN, 255)
    return pictures.add_pixels(smaller(pixels, LONGEST))


def _flip(results: Results, cell: Cell, pictures: Embedded) -> str | None:
    """Adds the map of FLIP of picture and truth, 0 to 1, in its usual colours; returns its key."""
    flip = stored.array(results, (results.record(cell).get("error") or {}).get("flip_file"))
    if isinstance(flip, Missing):
        return None
    return pictures.add_pixels(smaller(colormaps["magma"](np.clip(flip, 0, 1), bytes=True)[..., :3], LONGEST))
