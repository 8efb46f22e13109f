"""The table of errors: each picture by every measure, numeric first, then perceptual."""

from pathlib import Path

from reports.accuracy import accuracy_columns
from reports.paper import quantity, table
from reports.paper.table import Column
from reports.run import repetition
from reports.run.results import Cell, Missing, Results

CAPTION = (
    "RMSE, largest error, beyond 1/255 and relative MSE (the mean of the squared difference over the squared reference "
    "+ 0.01) are over all pixels. Inside the mask pixels are judged all together: nearly all must lie in what moved "
    "samples span. FLIP, SSIM and PSNR compare what a display shows, sRGB clipped to 0..1: FLIP is "
    "the mean difference that a viewer sees at 67 pixels a degree, 0 to 1; SSIM is 1 for equal pictures. One wrong "
    "pixel hardly moves the three, and none of them tells a right picture from a wrong one: the judge goes by the "
    "agreement outside the mask. Of several repetitions the worst is shown."
)


def _worst(title: str, name: str, unit: str, worst=max, none: str = "the run does not have it") -> Column:
    """A column of the worst of all repetitions. none: why there is no value, where no row says why."""

    def value(cell: Cell):
        found = list(cell.known(name, cell.timed).values())
        if found:
            return float(worst(found))
        judged = cell.worst("rmse")
        if isinstance(judged, Missing):
            return judged
        told = cell.known(f"no_{name}", cell.timed).values() if name in repetition.SEEN else ()
        return Missing(next(iter(told), none))

    return Column(title, name, unit, value, quantity.exact)


COLUMNS = [
    *accuracy_columns.ERRORS,
    _worst("relative MSE", "relative_mse", "1"),
    *accuracy_columns.AGREEMENT[:1],
    _worst("inside it", "max_inside", "linear RGB", none="no pixel is in the mask"),
    *accuracy_columns.AGREEMENT[2:],
    _worst("FLIP", "flip", "1"),
    _worst("SSIM", "ssim", "1", min),
    _worst("PSNR (dB)", "psnr_db", "dB", min),
]  # fmt: skip


def write(results: Results, out: Path) -> str:
    """accuracy-*.csv, one a scene, and the section of the report."""
    tables = [(scene, results.of(scene), COLUMNS) for scene in results.scenes]
    return table.section(out, "accuracy", "Accuracy", tables, CAPTION)
