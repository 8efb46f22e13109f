"""Tables for a paper: LaTeX with booktabs, every cell escaped."""

from pathlib import Path

import pandas as pd


def write(header: list[str], rows: list[list[str]], path: Path) -> None:
    """Write a `tabular` of plain texts; it wants the packages booktabs and textcomp."""
    frame = pd.DataFrame(rows, columns=header)
    path.write_text(frame.to_latex(index=False, escape=True, column_format="l" * len(header)), encoding="utf-8")
