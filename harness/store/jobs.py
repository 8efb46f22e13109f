"""Records the jobs of a run on a cluster: when each was submitted and how it ended (jobs.jsonl)."""

import errno
from dataclasses import dataclass
from pathlib import Path

from harness.store import lines
from harness.system import output

NAME, RESERVE = "jobs.jsonl", ".reserve"
ROOM = 1 << 18  # bytes of the disk that are reserved, for the lines to be written when it is full


@dataclass
class Job:
    """A job. number: of its batch. at: ISO time of its submission. status: None until it has ended, then "" if it has
    done all it could, else the status of the rows that it has not done; reason: likewise."""

    number: int
    name: str
    at: str
    host: str = ""
    status: str | None = None
    reason: str = ""

    @property
    def ended(self) -> bool:
        return self.status is not None


class Jobs:
    """The jobs of the run in a folder. job_lines: those of its jobs.jsonl, if they were read before."""

    def __init__(self, folder: Path, job_lines: list[dict] | None = None):
        self.path = Path(folder) / NAME
        self.all = of(lines.read(self.path) if job_lines is None else job_lines)

    @property
    def live(self) -> list[Job]:
        return [job for job in self.all.values() if not job.ended]

    def last(self) -> dict[int, Job]:
        """The last job of each batch that had one, by the number of the batch."""
        return {job.number: job for job in self.all.values()}

    def reserve(self) -> None:
        """Reserves room on the disk."""
        output.data(self.path.with_name(RESERVE), bytes(ROOM))

    def submitted(self, number: int, name: str, at: str) -> None:
        self.all[name] = Job(number, name, at)
        self._write(job=name, number=number, submitted=at)

    def end(self, job: Job, host: str, status: str, reason: str, at: str) -> None:
        job.host, job.status, job.reason = host, status, reason
        self._write(job=job.name, ended=at, host=host, status=status, reason=reason)

    def _write(self, **line) -> None:
        """Writes a line to the disk before it returns, in the reserved room if the disk is full."""
        try:
            lines.append(self.path, line)
        except OSError as error:
            if error.errno != errno.ENOSPC:
                raise
            self.path.with_name(RESERVE).unlink(missing_ok=True)
            lines.append(self.path, line)


def of(job_lines: list[dict]) -> dict[str, Job]:
    """The jobs by name. job_lines: of jobs.jsonl."""
    jobs: dict[str, Job] = {}
    for line in job_lines:
        if "submitted" in line:
            jobs[line["job"]] = Job(line["number"], line["job"], line["submitted"])
        elif line["job"] in jobs:
            job = jobs[line["job"]]
            job.host, job.status, job.reason = line["host"], line["status"], line["reason"]
    return jobs
