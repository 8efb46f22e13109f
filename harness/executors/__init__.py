"""Where repetitions run. The loop of a run (race.py) knows no more of it than this."""

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Protocol

import numpy as np

from harness.job import Parameters
from harness.registry import Entry
from harness.repetition import Result


class Executor(Protocol):
    """Runs repetitions, and tells the time and the state of the machine they run on."""

    @property
    def references(self) -> Path | None:
        """Folder of references that runs share (kept.py); None: each run makes its own."""

    def exclusive(self) -> AbstractContextManager:
        """Held during a run: nothing else is measured there meanwhile."""

    def clock(self) -> float:
        """Seconds on a clock that never steps; its epoch means nothing."""

    def look(self) -> dict:
        """The machine's counters now, as trouble.look has them."""

    def peaks(self, threads: int) -> dict:
        """What the machine can do at most just now, as calibration.peaks has it."""

    def run(
        self,
        entry: Entry,
        arrays: dict[str, np.ndarray],
        parameters: Parameters,
        needs: tuple[str, ...],
        timeout: float = 600.0,
        series: Path | None = None,
        interval: float = 0.05,
        cache: Path | None = None,
        log: Path | None = None,
    ) -> Result:
        """One repetition, as repetition.run says."""
