"""Chooses the times by which two cells are compared: on a machine that others use, not the median of wall times.

There a frame is interrupted once more or not, so that the times of frames lie around two values or more, and their
median jumps from one to the next: of a program that takes 10 % longer it may tell 6 % or 33 %. The CPU time of a frame
does not grow while others have the core. It is used of one thread: of more, or of a GPU, it does not tell how long they
take together. Then the mean of wall times stands for it, which grows with the work, and wanders more.
"""

from dataclasses import dataclass

from harness.system import trouble
from reports.run import repetition
from reports.run.results import Cell, Results

NAMES = {repetition.STEADY: "time", repetition.CPU: "CPU time", repetition.MEAN: "mean time"}


@dataclass(frozen=True)
class Witness:
    """column: of repetition.COLUMNS. why: what the machine did, where it is not the median of wall times; else ""."""

    column: str
    why: str = ""

    @property
    def name(self) -> str:
        """What is compared, in words."""
        return NAMES[self.column]


def of(*sides: tuple[Results, Cell]) -> Witness:
    """Returns the witness of cells that are compared, each of a run."""
    texts = [text for run, cell in sides for text in trouble.taken(_warnings(run, cell))]
    if not texts:
        return Witness(repetition.STEADY)
    tells = all(_tells_cpu(cell) for _, cell in sides)
    return Witness(repetition.CPU if tells else repetition.MEAN, " and ".join(dict.fromkeys(texts)))


def _warnings(run: Results, cell: Cell) -> list[list[str]]:
    return [run.records[row]["warnings"] for row in cell.counting]


def _tells_cpu(cell: Cell) -> bool:
    """Whether CPU time says how long a frame takes, and is known of most repetitions."""
    most = 2 * len(cell.values(repetition.CPU)) > len(cell.counting)
    return most and cell.parameters["threads"] == 1 and not cell.gpu
