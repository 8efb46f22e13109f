"""The columns of the error of a picture, which stand beside every time."""

from reports.paper import quantity
from reports.paper.table import Column
from reports.run.results import Cell, Missing


def _max_outside(cell: Cell):
    worst = cell.worst("max_outside")
    if isinstance(worst, Missing) and not isinstance(cell.worst("mask_fraction"), Missing):
        return Missing("every pixel is in the mask")
    return worst


UNIT = "linear RGB; of first hits 1"

COLUMNS = [
    Column("largest error outside the mask", "max_error_outside_mask", UNIT, _max_outside),
    Column("its tolerance", "tolerance", UNIT, lambda cell: cell.worst("tolerance")),
    Column(
        "pixels in the mask (%)", "mask_fraction", "1", lambda cell: cell.worst("mask_fraction"),
        lambda value: quantity.text(value) if isinstance(value, Missing) else f"{100 * value:.2f}",
    ),
]  # fmt: skip

CAPTION = (
    "The error is the largest absolute difference in any channel of linear RGB from the reference, which another "
    "renderer made in float64, outside the mask of ill-conditioned pixels; beside it the tolerance above which a "
    "picture is wrong. The mask marks the pixels whose colour in float64 changes visibly when the sample moves by 4 "
    "float32 steps. Where first hits of rays are asked for in place of a picture, the error is that of a hit's "
    "distance, as a share of it; outside the mask, which is of rays, all must hit what the reference says."
)


def shown(cell: Cell) -> str:
    """The error in a few words, for figures and sentences."""
    worst = _max_outside(cell)
    return "error unavailable" if isinstance(worst, Missing) else f"error {worst:.1e}"
