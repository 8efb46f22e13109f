"""Reads what the measurer wrote of one repetition (measurer.py)."""

import csv
from pathlib import Path


def ticks(series: Path) -> list[dict]:
    """The whole rows of a series, as text by column; none where there is no file."""
    try:
        whole, _, _ = series.read_text(encoding="utf-8").rpartition("\n")
    except OSError:
        return []
    return list(csv.DictReader(whole.splitlines()))
