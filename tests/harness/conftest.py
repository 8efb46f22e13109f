"""Schedulers that tests start themselves, and tasks for them."""

import os

import cluster_tasks
import pytest
import slurm_cluster

from harness.executors.slurm import Slurm
from harness.experiment.cluster import Slurm as Table

ARRAY = 400  # MaxArraySize, which 1,000 jobs go beyond


@pytest.fixture(scope="session")
def real_cluster():
    """A Slurm of two hosts that are this machine (slurm_cluster.py). Tests leave its queue empty."""
    if slurm_cluster.lacking():
        pytest.skip(slurm_cluster.lacking())
    pytest.importorskip("submitit")
    with slurm_cluster.Cluster(nodes=2, array=ARRAY) as real_cluster:
        yield real_cluster


@pytest.fixture
def slurm(real_cluster, folder, monkeypatch):
    """slurm(**table): an Executor of that Slurm."""
    monkeypatch.setenv("SLURM_CONF", real_cluster.environment["SLURM_CONF"])
    yield lambda **table: Slurm(Table(**table), folder / "logs")
    real_cluster.ask("scancel", "--full", "--signal=KILL", "--state=RUNNING", f"--user={os.getuid()}")
    real_cluster.ask("scancel", f"--user={os.getuid()}")
    cluster_tasks.until(lambda: not real_cluster.ask("squeue", "--noheader"))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Of tasks, which find cluster_tasks.py too."""
    monkeypatch.setenv("PYTHONPATH", os.path.dirname(cluster_tasks.__file__))
    place = tmp_path / "a folder's name"
    place.mkdir()
    return place
