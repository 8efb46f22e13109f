"""Writes docs/the-study.md from the reference results: python docs/study.py [FILE]."""

import sys
from pathlib import Path

from reports.study import page

ROOT = Path(__file__).parents[1]

if __name__ == "__main__":
    file = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "the-study.md"
    file.write_text(page.write(ROOT / "results" / "reference"), encoding="utf-8")
