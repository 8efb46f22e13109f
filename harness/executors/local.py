"""The local executor: runs tasks in this process, one after another."""

from collections.abc import Iterator
from pathlib import Path

from harness.executors import State, Work


class Local:
    """An Executor (harness/executors). Submitting a task runs it."""

    most = None

    def submit(self, work: Work, folder: Path, numbers: list[int]) -> Iterator[tuple[int, str]]:
        for number in numbers:
            work(str(folder), number)
            yield number, f"local-{number}"

    def states(self, jobs: list[str]) -> dict[str, State]:
        return dict.fromkeys(jobs, State("ended"))

    def cancel(self, jobs: list[str]) -> None:
        pass
