"""The tables [slurm] and [dask] of an experiment: what a cluster job asks for."""

from typing import Annotated

from pydantic import Field

from harness.duration import Seconds
from harness.toml import Strict

Text = Annotated[str, Field(min_length=1)]
WARNING = 60.0  # s


def warning(limit: float) -> float:
    """How long before the end of its time (s) a job begins nothing more, and is told to end."""
    return min(WARNING, limit / 10)


class Slurm(Strict):
    """One job has one host to itself, for a batch of cells.

    account, partition, constraint: as of sbatch. gpus: of each host. time: limit of a job, after which it begins
    nothing more. cells: of a job at most, but for cells that are compared with each other (one scene at one point),
    which stay together. at_once: jobs of an array that run at once; each has a host. setup: lines of shell before the
    work, such as "module load gcc". options: others of sbatch, by name: {qos = "long"}.
    """

    account: Text | None = None
    partition: Text | None = None
    constraint: Text | None = None
    gpus: Annotated[int, Field(ge=1)] | None = None
    time: Seconds = 3600.0
    cells: Annotated[int, Field(ge=1)] = 20
    at_once: Annotated[int, Field(ge=1)] = 256
    setup: tuple[Text, ...] = ()
    options: dict[str, str | int | bool] = {}


class Dask(Strict):
    """scheduler: address of one that runs. Its workers do one batch at a time each, those of one host in turns.

    cells, time: as of Slurm.
    """

    scheduler: Text
    cells: Annotated[int, Field(ge=1)] = 20
    time: Seconds = 3600.0
