"""Exports the counted instructions of each cell as a budget, which `rayrace run --budget` holds later runs to.

JSON: {"budget": 1, "percent": by how much more is too much, "cells": {name: {"instructions": of a steady frame, and how
they were counted: "tool", "version", "width", "height", "options", "environment"}}}. It is for a repository: a line a
number, names in order.
"""

import json

from harness.errors import UserError
from reports.run import naming
from reports.run.results import Missing, Results

VERSION, PERCENT = 1, 1.0
WAY = "tool", "version", "width", "height", "options", "environment"  # of counts that can be compared


def text(results: Results) -> tuple[str, list[str]]:
    """Returns the text of the file, and a line for each cell without counts. UserError if none has any."""
    cells, left_out = {}, []
    for name, cell in zip(naming.names(results.cells), results.cells, strict=True):
        counts = results.counts(cell)
        if isinstance(counts, Missing):
            left_out.append(f"{name}: {counts.reason}")
        else:
            cells[name] = {key: counts[key] for key in ("instructions", *WAY)}
    if not cells:
        message = "\n  ".join([f"{results.folder}: nothing was counted", *left_out])
        raise UserError(message, remedy="run it with --set measure.count=true")
    content = {"budget": VERSION, "percent": PERCENT, "cells": cells}
    return json.dumps(content, indent=1, sort_keys=True) + "\n", left_out
