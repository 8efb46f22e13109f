"""CSV files of rays and hits: reads RAYS.csv, writes HITS.csv."""

import csv
import io
import math
from pathlib import Path

import numpy as np

from harness import textfile
from harness.errors import UserError
from harness.scene import check

RAY_COLUMNS = ["ox", "oy", "oz", "dx", "dy", "dz"]
HIT_COLUMNS = ["hit", "t", "px", "py", "pz", "nx", "ny", "nz", "object"]


def read(path: Path) -> np.ndarray:
    """Rays of a CSV file, float64 (R, 6): origin, direction. UserError with file and line for a faulty row.

    Directions may have any length but 0; what is returned has a largest component between 1/2 and 1.
    """
    reader = csv.reader(io.StringIO(textfile.read(path)))
    try:
        header = next(reader, [])
        if [name.strip() for name in header] != RAY_COLUMNS:
            raise UserError(f"expected the header {','.join(RAY_COLUMNS)}", file=path, line=1)
        rows = [_ray(row, path, reader.line_num) for row in reader if row]
    except csv.Error as error:
        raise UserError(str(error), file=path, line=reader.line_num) from None
    return np.array(rows, dtype=np.float64).reshape(-1, 6)


def _ray(row: list[str], path: Path, line: int) -> list[float]:
    if len(row) != 6:
        raise UserError(f"expected 6 numbers, found {len(row)}", file=path, line=line)
    values = []
    for name, text in zip(RAY_COLUMNS, row, strict=True):
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise UserError(f'{name}: expected a finite number, found "{text.strip()}"', file=path, line=line)
        values.append(value)
    if max(map(abs, values[:3])) > check.LARGEST:
        raise UserError(f"the origin is farther than {check.LARGEST:g} from (0,0,0)", file=path, line=line)
    largest = max(map(abs, values[3:]))
    if largest == 0:
        raise UserError("the direction has length 0", file=path, line=line)
    # Brought near length 1 by a power of two, which rounds nothing: its square then fits every precision.
    _, exponent = math.frexp(largest)
    return values[:3] + [math.ldexp(value, -exponent) for value in values[3:]]


def write(file, hits: np.ndarray) -> None:
    """Write hits (R, 8) as the contract returns them to the text file `file`, 17 significant digits."""
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(HIT_COLUMNS)
    for row in hits:
        if row[7] < 0:
            writer.writerow(["0", *[""] * 8])
        else:
            writer.writerow(["1", *(f"{value:.17g}" for value in row[:7]), int(row[7])])
