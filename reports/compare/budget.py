"""Holds the counted instructions of a run to a budget, a file that `rayrace export --format budget` wrote."""

import json
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from harness.errors import UserError, of_system
from reports.compare.instructions import Counts, of_two
from reports.exporters import budget as written
from reports.run import naming
from reports.run.results import Missing, Results

REMEDY = "write one: rayrace export RUN --format budget -o FILE"


class Line(BaseModel):
    """Instructions of a steady frame of a cell, and how they were counted."""

    model_config = ConfigDict(extra="forbid")
    instructions: float = Field(gt=0, allow_inf_nan=False)
    tool: str
    version: str
    width: int
    height: int
    options: list[str]
    environment: dict[str, str]


class Budget(BaseModel):
    """percent: by how much more is too much. cells: by name."""

    model_config = ConfigDict(extra="forbid")
    budget: int = Field(ge=1, le=written.VERSION)
    percent: float = Field(ge=0, allow_inf_nan=False)
    cells: dict[str, Line]


@dataclass(frozen=True)
class Held:
    """A cell held to its line. over: it takes too many instructions, or was not counted though the budget has it. both:
    the run and the budget have it."""

    name: str
    counts: Counts
    over: bool
    both: bool = True

    @property
    def text(self) -> str:
        return f"{self.name}: {self.counts.text.replace('B / A', 'run / budget')}"


def read(file: Path) -> Budget:
    """Returns the budget in a file. UserError if it is none."""
    try:
        return parse(json.loads(file.read_text("utf-8")), file)
    except OSError as error:
        raise UserError(of_system(error, file), remedy=REMEDY) from None
    except ValueError as error:  # no JSON, or no UTF-8
        raise UserError(f"it is no budget: {error}", file=file, remedy=REMEDY) from None


def parse(content, file: Path) -> Budget:
    """Returns the budget of a parsed JSON text. UserError if it is none, which names the file."""
    try:
        return Budget.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise UserError(f"{where}: {first['msg']}", file=file, remedy=REMEDY) from None


def hold(results: Results, budget: Budget) -> list[Held]:
    """Returns each cell of the run or of the budget, held to it."""
    cells = dict(zip(naming.names(results.cells), results.cells, strict=True))
    rows = []
    for name in dict.fromkeys((*cells, *budget.cells)):
        line, cell = budget.cells.get(name), cells.get(name)
        if cell is None:
            rows.append(Held(name, Counts(reason="the run does not have it"), False, False))
        elif line is None:
            rows.append(Held(name, Counts(reason="the budget does not have it"), False, False))
        else:
            counts = of_two(line.model_dump(), results.counts(cell), "the budget", "the run")
            lost = isinstance(results.counts(cell), Missing)
            rows.append(Held(name, counts, lost or counts.more(budget.percent)))
    return rows
