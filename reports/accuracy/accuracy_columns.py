"""The columns of the error of a picture, which stand beside every time, and of its agreement with its reference."""

from harness.store import record
from reports.paper import quantity
from reports.paper.table import Column
from reports.run import repetition
from reports.run.results import Cell, Missing

UNIT = "linear RGB; of first hits 1"


def _rmse(cell: Cell) -> float | Missing:
    return Missing("first hits have none") if cell.parameters.get("kind") == "rays" else cell.worst("rmse")


def _outside(cell: Cell) -> float | Missing:
    worst = cell.worst("max_outside")
    if isinstance(worst, Missing) and not isinstance(cell.worst("mask_fraction"), Missing):
        return Missing("every pixel is in the mask")
    return worst


def _percent(value: float | Missing) -> str:
    return quantity.exact(value, 100)


ERRORS = [
    Column("RMSE", "rmse", "linear RGB", _rmse, quantity.exact),
    Column("largest error", repetition.LARGEST, UNIT, lambda cell: cell.worst(repetition.LARGEST), quantity.exact),
    Column("beyond 1/255 (%)", "bad_pixels", "1", lambda cell: cell.worst("bad_pixels"), _percent),
]

AGREEMENT = [
    Column("agreement: at most, outside the mask", "agreement_outside_mask", UNIT, _outside, quantity.exact),
    Column("its tolerance", "tolerance", UNIT, lambda cell: cell.worst("tolerance")),
    Column(
        "pixels in the mask (%)", "mask_fraction", "1", lambda cell: cell.worst("mask_fraction"),
        lambda value: quantity.text(value) if isinstance(value, Missing) else f"{100 * value:.2f}",
    ),
]  # fmt: skip

CAPTION = (
    "Errors are differences in linear RGB from the reference, which another renderer made in float64, over all pixels: "
    "their root mean square, the largest of any channel, and the share of pixels with a channel off by more than a "
    "step of an 8-bit picture. Agreement is what the judge goes by: the largest difference outside the mask of "
    "ill-conditioned pixels, with the tolerance above which a picture is wrong; it is no error of the picture. The "
    "mask marks the pixels whose colour in float64 changes visibly when the sample moves by 4 float32 steps. Where "
    "first hits of rays are asked for in place of a picture, the largest error is that of the distance of a hit, as a "
    "share of it, among rays that hit what the reference says; the share is of rays that hit something else; outside "
    "the mask, which is of rays, none may."
)


def brief(cell: Cell) -> tuple[str, str, str]:
    """RMSE, largest error and share beyond 1/255 as short as can be, for the margin of a figure."""
    rmse, largest, beyond = (column.value(cell) for column in ERRORS)
    found = ((rmse, "{:.2g}".format), (largest, "{:.3g}".format), (beyond, record.percent))
    return tuple("unavailable" if isinstance(value, Missing) else show(value) for value, show in found)
