"""Limits of memory, disk, output and processes of a renderer, and the message when one is exceeded."""

import psutil
from pydantic import Field

from harness.duration import Bytes
from harness.system import cgroup
from harness.toml import Strict

FREE = 0.9  # of the memory that is free: with less, the system begins to swap, and may kill any process


class Limits(Strict):
    """The limits of one renderer process, including everything that it starts.

    memory: held at once, pages that several of them share counted once, with files in memory (launcher.MemoryFiles);
    never more than nine tenths of what the machine has free when it starts. disk: written below the folders that it was
    given, where an empty file counts as 4 KiB; and the size of any single file. output: printed on standard output and
    standard error. processes: at once, with the dead that nobody waited for.
    """

    memory: Bytes | None = None
    disk: Bytes = 4 * 10**9
    output: Bytes = 64 * 10**6
    processes: int = Field(default=1000, gt=0)

    def now(self) -> dict[str, int]:
        """Returns the limits in bytes and counts for a process that starts now, as the launcher takes them."""
        free = round(FREE * min(psutil.virtual_memory().available, cgroup.memory_limit() or 2**63))
        return {**self.model_dump(), "memory": min(free, self.memory or free)}

    def excess(self, limit: str, used: int, most: int) -> str:
        """Says how a process exceeded a limit, which was `most` when it started."""
        why = ", nine tenths of what was free" if limit == "memory" and most != self.memory else ""
        if limit == "processes":
            return f"had {used} processes at once, the limit is {most}"
        did = {"memory": "used {} of memory", "disk": "wrote {} to disk", "output": "printed {}"}[limit]
        return f"{did.format(amount(used))}, the limit is {amount(most)}{why}"


DEFAULT = Limits()


def amount(count: float) -> str:
    """Bytes for people: "2.35 GB"."""
    for unit in ("B", "kB", "MB", "GB"):
        if count < 999.5:
            break
        count, unit = count / 1000, "TB"
    return f"{count:.3g} {unit}"
