"""The picture comparer of the page: pictures of one place, their errors and FLIP maps."""

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import LogNorm

from reports.page.embedded import Embedded, smaller
from reports.pictures import pictures_figure
from reports.run import stored
from reports.run.cell import Cell, Missing
from reports.run.results import Results, place_label

LONGEST = 640  # pixels of a picture that is too large to be shown pixel for pixel
MOST = 40  # pictures of a place
GREY = (221, 221, 221)


def data(results: Results, pictures: Embedded) -> dict:
    """{} without pictures; else `places` with pictures to compare, and what it says of itself."""
    found = pictures_figure.places(results)
    places, there = [], 0
    for place, cells in found:
        if cells[0].pixels == 1:
            continue
        told = [shown for cell in cells[:MOST] if (shown := _picture(results, cell, pictures))]
        there += len(cells)
        if told:
            places.append({"label": place_label(place), "pictures": told})
    if not places:
        return {}
    shown = sum(len(place["pictures"]) for place in places)
    lacking = f"Inside this page are {shown} of {there} pictures: others were not stored, or had no room."
    return {"places": places, "says": lacking if shown < there else ""}


def _picture(results: Results, cell: Cell, pictures: Embedded) -> dict | None:
    record = results.record(cell)
    if record is None or not record["picture"]:
        return None
    picture = stored.array(results, record["picture"]["file"])
    if isinstance(picture, Missing) or picture.ndim != 3:
        return None
    arithmetic = record["parameters"].get("arithmetic", "linear")
    seen = smaller(pictures_figure.shown(picture, arithmetic), LONGEST)
    key = pictures.add_pixels(seen, exact=True)
    if key is None:
        return None
    accuracy = record["accuracy"] or {}
    return {
        "label": cell.label,
        "verdict": cell.verdict,
        "told": pictures_figure.verdict(accuracy).split("\n"),
        "size": [seen.shape[1], seen.shape[0]],
        "picture": key,
        "error": _error(results, picture, accuracy, pictures),
        "flip": _flip(results, accuracy, pictures),
    }


def _error(results: Results, picture: np.ndarray, accuracy: dict, pictures: Embedded) -> str | None:
    """The largest difference of a channel from the reference, as figure 4.1 colours it."""
    reference = stored.reference(results, accuracy)
    if isinstance(reference, Missing) or reference.shape != picture.shape:
        return None
    difference = np.abs(picture - reference).max(axis=-1)
    known = np.where(np.isfinite(difference) & (difference > 0), difference, 1)
    norm = LogNorm(pictures_figure.SMALLEST_DIFFERENCE, 1.0, clip=True)
    pixels = colormaps["viridis"](norm(known), bytes=True)[..., :3].copy()
    pixels[difference == 0] = GREY
    pixels[~np.isfinite(difference)] = np.multiply(pictures_figure.BROKEN, 255)
    return pictures.add_pixels(smaller(pixels, LONGEST))


def _flip(results: Results, accuracy: dict, pictures: Embedded) -> str | None:
    """Returns the FLIP map, from 0 to 1, in its usual colours."""
    found = stored.array(results, accuracy.get("flip_file"))
    if isinstance(found, Missing):
        return None
    return pictures.add_pixels(smaller(colormaps["magma"](np.clip(found, 0, 1), bytes=True)[..., :3], LONGEST))
