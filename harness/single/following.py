"""Submits batches of tiles (tiles.py) to an executor and follows them until their tiles exist."""

import time
from collections import Counter
from collections.abc import Callable

from harness.errors import UserError
from harness.executors import Executor
from harness.single import tiles

POLL = 5.0  # s
LOOKS = {"ended": 3, "unknown": 60}  # polls before a job in this state counts as lost: file systems may lag
SILENT = "it ended before its tiles were done, and gave no reason"

Tell = Callable[[int, int, str], None]  # number of finished tiles, of all tiles, text about the last one


class Following:
    """The jobs for the missing tiles. name: of the executor; cells: tiles in a job, at most; timeout: s for each tile.

    Jobs of an earlier command that are still waiting or running are followed too, and not submitted again.
    """

    def __init__(self, place: tiles.Folder, executor: Executor, name: str, cells: int, timeout: float):
        self.place, self.executor, self.name = place, executor, name
        self.count, self.there = place.grid.count, place.there()
        self.reasons: Counter = Counter()  # why jobs ended before their tiles were done
        self._looked: Counter = Counter()
        self._groups = [batch["tiles"] for batch in place.batches()]
        before = {batch: job for batch, job in place.jobs(name).items() if self._lacks(batch)}
        states = executor.states(list(before.values())) if before else {}
        # names: job by batch, of all jobs that may still run; live: batches of these with missing tiles.
        self.names = {batch: job for batch, job in before.items() if states[job].kind in ("waiting", "running")}
        self.live = set(self.names)
        taken = {tile for batch in self.live for tile in self._groups[batch]}
        free = [tile for tile in range(self.count) if tile not in self.there and tile not in taken]
        groups = [free[start : start + cells] for start in range(0, len(free), cells)]
        self._waiting = list(place.add(groups, timeout)) if groups else []
        self._groups += groups
        self._most = 1 if name == "local" else executor.most  # local: one by one, to report each tile

    @property
    def due(self) -> int:
        """The number of jobs to be submitted."""
        return len(self._waiting)

    @property
    def missing(self) -> int:
        """The number of missing tiles."""
        return self.count - len(self.there)

    def run(self, tell: Tell) -> None:
        """Returns when all tiles exist, or no job is left for the missing ones. tell: called for each new tile."""
        while self.missing and (self.live or self._waiting):
            self._submit()
            if self.name != "local":
                time.sleep(POLL)
            self._look(tell)

    def wait(self) -> None:
        """Waits a little for jobs to end after their last tile: they still write to the folder."""
        for _ in range(LOOKS["ended"] if self.names and self.name != "local" else 0):
            states = self.executor.states(list(self.names.values()))
            if not any(state.kind == "running" for state in states.values()):
                return
            time.sleep(POLL)

    def _lacks(self, batch: int) -> bool:
        return not self.there.issuperset(self._groups[batch])

    def _submit(self) -> None:
        """Submits as many waiting batches as the scheduler takes."""
        room = len(self._waiting) if self._most is None else max(0, self._most - len(self.live))
        batches, self._waiting = self._waiting[:room], self._waiting[room:]
        try:
            for batch, job in self.executor.submit(tiles.work, self.place.path.resolve(), batches) if batches else ():
                self.place.submitted(batch, job, self.name)
                self.names[batch] = job
                self.live.add(batch)
        except UserError as error:
            self._waiting = []
            self.reasons[str(error)] += 1  # jobs that it accepted go on

    def _look(self, tell: Tell) -> None:
        """Reports new tiles, and gives up jobs that ended without theirs."""
        for tile in sorted(self.place.there() - self.there):
            self.there.add(tile)
            tell(len(self.there), self.count, self._line(tile))
        self.live = {batch for batch in self.live if self._lacks(batch)}
        states = self.executor.states([self.names[batch] for batch in sorted(self.live)]) if self.live else {}
        for batch in sorted(self.live):
            state = states[self.names[batch]]
            if state.kind not in LOOKS:
                continue
            self._looked[batch] += 1
            word = self.place.refused(batch)
            if word or self.name == "local" or self._looked[batch] >= LOOKS[state.kind]:
                self.live.discard(batch)
                self.reasons[word or self._words(state)] += 1
                self._waiting = []  # the next would fail for the same reason

    @staticmethod
    def _words(state) -> str:
        where = f"{state.host}: " if state.host else ""
        return where + (state.reason or SILENT)

    def _line(self, tile: int) -> str:
        told = self.place.facts(tile)
        region = ",".join(map(str, self.place.grid.region(tile)))
        return f"{region}: {told['render_s']:.4g} s, {told['wall_s']:.3g} s in all, {told['host']}"
