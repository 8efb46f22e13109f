"""Prepares the picture comparer of the page: pictures of one place, their errors and FLIP maps."""

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import LogNorm

from reports.page.embedded import Embedded, smaller
from reports.pictures import pictures_figure
from reports.run import stored
from reports.run.cell import Cell, Missing
from reports.run.results import Results, place_label

LONGEST = 640  # pixels of a side; a larger picture is reduced
MOST = 40  # pictures of a place
GREY = (221, 221, 221)


def data(results: Results, pictures: Embedded) -> dict:
    """Returns `places` with pictures to compare and a note for the page; {} without pictures. Adds to `pictures`."""
    found = pictures_figure.places(results)
    places, there = [], 0
    for place, cells in found:
        if cells[0].pixels == 1:
            continue
        shown = [one for cell in cells[:MOST] if (one := _picture(results, cell, pictures))]
        there += len(cells)
        if shown:
            places.append({"label": place_label(place), "pictures": shown})
    if not places:
        return {}
    count = sum(len(place["pictures"]) for place in places)
    lacking = f"This page holds {count} of {there} pictures: the others were not stored, or did not fit."
    return {"places": places, "says": lacking if count < there else ""}


def _picture(results: Results, cell: Cell, pictures: Embedded) -> dict | None:
    picture = stored.raw(results, cell)
    if isinstance(picture, Missing) or picture.ndim != 3:
        return None
    seen = smaller(stored.displayed(picture, cell), LONGEST)
    key = pictures.add_pixels(seen, exact=True)
    if key is None:
        return None
    agreement = results.record(cell)["agreement"] or {}
    return {
        "label": cell.label,
        "verdict": cell.verdict,
        "told": pictures_figure.verdict(agreement).split("\n"),
        "size": [seen.shape[1], seen.shape[0]],
        "picture": key,
        "error": _error(results, picture, agreement, pictures),
        "flip": _flip(results, agreement, pictures),
    }


def _error(results: Results, picture: np.ndarray, agreement: dict, pictures: Embedded) -> str | None:
    """Adds the picture's largest channel difference from the reference, coloured as in figure 4.1; returns its key."""
    reference = stored.reference(results, agreement)
    if isinstance(reference, Missing) or reference.shape != picture.shape:
        return None
    difference = np.abs(picture - reference).max(axis=-1)
    known = np.where(np.isfinite(difference) & (difference > 0), difference, 1)
    norm = LogNorm(pictures_figure.SMALLEST_DIFFERENCE, 1.0, clip=True)
    pixels = colormaps["viridis"](norm(known), bytes=True)[..., :3].copy()
    pixels[difference == 0] = GREY
    pixels[~np.isfinite(difference)] = np.multiply(stored.BROKEN, 255)
    return pictures.add_pixels(smaller(pixels, LONGEST))


def _flip(results: Results, agreement: dict, pictures: Embedded) -> str | None:
    """Adds the FLIP map, 0 to 1, in its usual colours; returns its key."""
    found = stored.array(results, agreement.get("flip_file"))
    if isinstance(found, Missing):
        return None
    return pictures.add_pixels(smaller(colormaps["magma"](np.clip(found, 0, 1), bytes=True)[..., :3], LONGEST))
