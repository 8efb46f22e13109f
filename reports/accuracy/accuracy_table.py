"""The table of errors: each picture by every measure, numeric first, then perceptual, and whether it agrees."""

from pathlib import Path

from reports.accuracy import accuracy_columns
from reports.paper import quantity, table
from reports.paper.table import Column
from reports.run.results import Results

TITLE = "Errors"
CAPTION = (
    "RMSE, largest error, beyond 1/255 and relative MSE (the mean of the squared error over the squared truth + 0.01) "
    "are over all pixels. FLIP, SSIM and PSNR compare what a display shows of the picture and of the truth, sRGB "
    "clipped to 0..1: FLIP is the mean difference that a viewer sees at 67 pixels a degree, 0 to 1; SSIM is 1 for "
    "equal pictures. One wrong pixel hardly moves the three, and none of them tells a right picture from a wrong one: "
    "that is what agreement is for. Truth known to: the root mean square of its own standard error and of what it may "
    "lack: deeper rays (ERR-4), and what no sample has met (ERR-5). Of several processes the worst is shown."
)


def _worst(title: str, name: str, unit: str, worst=max) -> Column:
    return Column(title, name, unit, lambda cell: cell.error(name, worst), quantity.exact)


COLUMNS = [
    *accuracy_columns.ERRORS,
    _worst("truth known to", "uncertainty", "linear RGB"),
    _worst("relative MSE", "error_relative_mse", "1"),
    _worst("FLIP", "error_flip", "1"),
    _worst("SSIM", "error_ssim", "1", min),
    _worst("PSNR (dB)", "error_psnr_db", "dB", min),
    *accuracy_columns.AGREEMENT,
]


def write(results: Results, out: Path) -> str:
    """accuracy-*.csv, one a scene, and the section of the report."""
    tables = [(scene, results.of(scene), COLUMNS) for scene in results.scenes]
    return table.section(out, "accuracy", TITLE, tables, CAPTION)
