"""The columns of the error of a picture, which stand beside every time, and of its agreement with its reference."""

from harness.statistics.statistics import Estimate
from harness.store import record
from reports.paper import quantity
from reports.paper.table import AGAINST, Column
from reports.run import repetition
from reports.run.results import Cell, Missing

UNIT = "linear RGB; of first hits 1"
SURE = 0.01  # of the value: a narrower interval, on either side, is not shown
OF_SCENE = "the truth of the scene"


def rmse(cell: Cell) -> Estimate | float | Missing:
    """Returns the RMSE of a cell, with the interval that its truth leaves, 95 %, if it has some: from 0 where the truth
    cannot tell it from 0."""
    value, doubt = cell.error(repetition.RMSE), cell.error("error_rmse_standard_error")
    doubt = 0.0 if isinstance(doubt, Missing) else record.NORMAL * doubt
    if isinstance(value, Missing) or not (doubt or cell.below):
        return value
    samples = cell.error("truth_samples")
    samples = int(samples) if isinstance(samples, float) else 1
    ends = (0.0, cell.below) if cell.below else (value - doubt, value + doubt)
    return Estimate(value, *ends, samples, "95 %, of the noise of the truth")


def shown(value: Estimate | float | Missing) -> str:
    """Returns an RMSE as text: with its interval where that is wide, or "below" where the truth cannot tell it from "
    "0."""
    if not isinstance(value, Estimate):
        return quantity.exact(value)
    if value.low == 0:
        return f"below {value.high:.2g}"
    return f"{value.value:.3g}" if value.high - value.value < SURE * value.value else quantity.text(value)


def shown_rmse(cell: Cell) -> str:
    """Returns the RMSE of a cell as text."""
    return shown(rmse(cell))


def _of_noise(cell: Cell, column: str) -> Estimate | float | Missing:
    """Returns an error to which the noise of the truth adds; where that may be all of it, with an interval from 0."""
    value = cell.error(column)
    if isinstance(value, Missing) or not cell.below:
        return value
    return Estimate(value, 0.0, value, 1, "the truth cannot tell it from 0")


def _most(value: Estimate | float | Missing) -> str:
    return f"at most {quantity.exact(value.high)}" if isinstance(value, Estimate) else quantity.exact(value)


def _percent(value: Estimate | float | Missing) -> str:
    if isinstance(value, Estimate):
        return f"at most {quantity.exact(value.high, 100)}"
    return quantity.exact(value, 100)


def _against(cell: Cell) -> str | Missing:
    error = cell.error(repetition.LARGEST)
    return error if isinstance(error, Missing) else cell.against or OF_SCENE


ERRORS = [
    Column("RMSE", repetition.RMSE, "linear RGB", rmse, shown),
    Column("largest error", repetition.LARGEST, UNIT, lambda cell: _of_noise(cell, repetition.LARGEST), _most),
    Column("beyond 1/255 (%)", repetition.BEYOND, "1", lambda cell: _of_noise(cell, repetition.BEYOND), _percent),
    Column("error against", AGAINST, "", _against),
]

AGREEMENT = [
    Column("agrees", "agrees", "", lambda cell: cell.agrees if isinstance(cell.agrees, Missing) else cell.agreement)
]

CAPTION = (
    "The error of a picture is its distance from the truth of the scene, whatever its method: RMSE, largest error of a "
    "channel, and share of pixels with a channel off by more than a step of an 8-bit picture, in linear RGB over all "
    "pixels. The truth is float64, the mean of many pictures over the areas of pixels, lens, lights and lobes, so deep "
    "that nothing changes; the share of its own noise is taken off the RMSE. An interval of an RMSE (95 %) is of that "
    "noise, and is left out if it is within 1 %; below: the truth cannot tell it from 0. Where an experiment asks for "
    "errors from something else, or the run is of an earlier version, a column says from what. Of first hits the error "
    "is that of the distance of a hit, as a share of it, and the share is of rays that hit something else. Agreement "
    "is a gate and no error: ✓, in float64 another renderer makes the same picture with the same samples and depth; ✗, "
    "it does not. Mask: the share of pixels whose colour changes visibly when a sample moves by 4 float32 steps, which "
    "are judged all together; told above 1 %."
)


def brief(cell: Cell) -> tuple[str, str, str, str]:
    """RMSE, largest error, share beyond 1/255 and agreement as short as can be, for the margin of a figure."""
    columns = (
        (rmse(cell), _short),
        (_of_noise(cell, repetition.LARGEST), _short_most),
        (_of_noise(cell, repetition.BEYOND), _short_percent),
        (cell.agrees, "✗✓".__getitem__),
    )
    return tuple("unavailable" if isinstance(value, Missing) else show(value) for value, show in columns)


def _short(value: Estimate | float) -> str:
    if not isinstance(value, Estimate):
        return f"{value:.2g}"
    return f"< {value.high:.2g}" if value.low == 0 else f"{value.value:.2g}"


def _short_most(value: Estimate | float) -> str:
    return f"≤ {value.high:.3g}" if isinstance(value, Estimate) else f"{value:.3g}"


def _short_percent(value: Estimate | float) -> str:
    if isinstance(value, Estimate) and value.high:
        return f"≤ {quantity.percentage(value.high)}"
    return quantity.percent(value.high if isinstance(value, Estimate) else value)
