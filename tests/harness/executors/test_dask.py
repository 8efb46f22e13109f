"""The executor for Dask, with a scheduler and two workers on this machine."""

import importlib.util
import json
import os
import signal
import subprocess
import sys
import tempfile
import time

import cluster_tasks
import pytest

from harness import executors
from harness.errors import UserError
from harness.executors import dask_task
from harness.executors.dask import Dask
from harness.experiment.cluster import Dask as Table
from harness.system import lock

distributed = pytest.importorskip("distributed", reason="no distributed: pip install 'rayrace[dask]'")


@pytest.fixture(scope="module")
def workers(tmp_path_factory):
    """Two single-threaded ones. Locks of hosts are files in TMPDIR, where none is held by other tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TMPDIR", str(tmp_path_factory.mktemp("host")))
        patch.setenv("PYTHONPATH", os.path.dirname(cluster_tasks.__file__))
        local = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0")
    with local, distributed.Client(local, set_as_default=False) as client:
        yield client


@pytest.fixture
def table(workers):
    return Table(scheduler=workers.scheduler.address)


def submit(executor, work, folder, *numbers) -> list[str]:
    """Names of the jobs."""
    found = list(executor.submit(work, folder, list(numbers)))
    assert [number for number, _ in found] == list(numbers)
    return [job for _, job in found]


def ended(executor, jobs) -> list[executors.State]:
    """Their states when all have ended."""

    def states():
        now = executor.states(jobs)
        return all(state.kind == "ended" for state in now.values()) and [now[job] for job in jobs]

    return cluster_tasks.until(states)


def test_workers_of_a_host_take_turns(workers, table, folder):
    executor = executors.find("dask", table, folder)
    jobs = submit(executor, cluster_tasks.stamp, folder, 0, 1, 2, 3)
    assert {state.reason for state in ended(executor, jobs)} == {""}
    told = cluster_tasks.left(folder)
    assert len({each["pid"] for each in told.values()}) == 4, "each a process"
    assert {number: each["environment"]["RAYRACE_JOB"] for number, each in told.items()} == dict(enumerate(jobs))
    assert not cluster_tasks.overlap(list(told.values()))
    assert {tuple(each["cores"]) for each in told.values()} == {tuple(sorted(os.sched_getaffinity(0)))}


def test_dask_itself_knows_no_turns_but_the_lock_of_the_host_does(workers, folder):
    """Two tasks that are given to the two workers, as Dask gives them."""
    for work, together in ((cluster_tasks.meet, True), (cluster_tasks.alone, False)):
        workers.gather(workers.map(work, [str(folder)] * 2, [0, 1], pure=False))
        assert cluster_tasks.overlap(list(cluster_tasks.left(folder).values())) == together


def test_what_became_of_a_job(table, folder):
    executor = Dask(table)
    jobs = submit(executor, cluster_tasks.leave, folder, 7)
    jobs += submit(executor, cluster_tasks.fault, folder, 1)
    jobs += submit(executor, cluster_tasks.die, folder, int(signal.SIGKILL))
    jobs += submit(executor, cluster_tasks.stamp, folder / "nowhere", 0)
    reasons = [state.reason for state in ended(executor, jobs)]
    assert reasons[:3] == ["failed (exit 7)", "failed (ValueError: task 1 is not possible)", "failed (signal 9)"]
    assert reasons[3].startswith("failed (FileNotFoundError: ")
    lost = executor.states(["rayrace-0-0"])["rayrace-0-0"]
    assert lost.kind == "ended" and "the scheduler no longer knows it" in lost.reason


def test_a_job_that_fails_before_it_is_known_to_be_taken(table, folder, monkeypatch):
    """It was taken."""
    keep = distributed.fire_and_forget

    def wait(futures):
        keep(futures)
        cluster_tasks.until(lambda: all(future.status == "error" for future in futures))

    monkeypatch.setattr(distributed, "fire_and_forget", wait)
    executor = Dask(table)
    jobs = submit(executor, cluster_tasks.fault, folder, 0, 1)
    assert [state.reason for state in ended(executor, jobs)] == [
        f"failed (ValueError: task {number} is not possible)" for number in (0, 1)
    ]


class NotThere:
    """A function that cannot be loaded."""

    def __init__(self, *_):
        pass

    def __call__(self, *_, **options):
        raise AssertionError

    def __reduce__(self):
        return importlib.import_module, ("not_on_the_scheduler",)


@pytest.mark.filterwarnings("ignore:Client 'fire-and-forget' desires key")
def test_jobs_that_the_scheduler_cannot_read(table, folder, monkeypatch):
    monkeypatch.setattr("harness.executors.dask._run", NotThere)
    begin = time.monotonic()
    with pytest.raises(UserError, match=r"refuses more jobs: Error during deserialization .* different environments"):
        submit(Dask(table), cluster_tasks.stamp, folder, 0, 1)
    assert time.monotonic() - begin < 30, "it does not wait in vain"


SCHEDULER = """
import sys
sys.modules["harness"] = None
from distributed.cli.dask_scheduler import main
main(["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", sys.argv[1]])
"""


def test_a_scheduler_without_rayrace(folder):
    said = folder / "scheduler.json"
    command = [sys.executable, "-c", SCHEDULER, str(said)]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as scheduler:
        try:
            cluster_tasks.until(said.exists)
            executor = Dask(Table(scheduler=json.loads(said.read_text())["address"]))
            jobs = submit(executor, cluster_tasks.stamp, folder, 0, 1)
            assert {state.reason for state in executor.states(jobs).values()} == {"there is no worker"}
            executor.cancel(jobs)
            assert {state.reason for state in executor.states(jobs).values()} == {"was cancelled"}
        finally:
            scheduler.kill()


SUBMIT = """
import sys, cluster_tasks
from pathlib import Path
from harness.experiment.cluster import Dask as Table
from harness.executors.dask import Dask
for _, job in Dask(Table(scheduler=sys.argv[1])).submit(cluster_tasks.stamp, Path(sys.argv[2]), [0, 1, 2]):
    print(job)
"""


@pytest.mark.slow
def test_who_submitted_may_end(table, folder):
    command = [sys.executable, "-c", SUBMIT, table.scheduler, str(folder)]
    jobs = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert len(jobs) == 3
    assert [state.reason for state in ended(Dask(table), jobs)] == [""] * 3
    assert len(cluster_tasks.left(folder)) == 3


def test_stopped_while_it_waits_for_the_host(tmp_path, monkeypatch):
    """The task before it ends, and this one, which was stopped with it, gets the lock: it must not begin."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    of_file = lock.of_file

    def stopped_first(file):
        dask_task.stop(["this job"])
        return of_file(file)

    with monkeypatch.context() as patch:
        patch.setattr(lock, "of_file", stopped_first)
        with dask_task._turn("this job") as mine:
            assert not mine
    with dask_task._turn("another") as mine:
        assert mine, "the host is free again"


def test_cancelled(table, folder):
    executor = Dask(table)
    jobs = submit(executor, cluster_tasks.obey, folder, *range(1000))
    cluster_tasks.until(lambda: cluster_tasks.left(folder))
    (number,) = cluster_tasks.left(folder)
    cluster_tasks.until(lambda: executor.states(jobs)[jobs[number]].kind == "running")
    assert [state.kind for state in executor.states(jobs).values()].count("waiting") >= 998
    executor.cancel(jobs)
    assert {state.reason for state in ended(executor, jobs)} == {"was cancelled"}
    assert {key: told["heard"] for key, told in cluster_tasks.left(folder).items()} == {number: "SIGTERM"}
    executor.cancel(jobs)
    (after,) = submit(executor, cluster_tasks.stamp, folder, 2000)
    assert ended(executor, [after])[0].reason == "", "the host is free again"


def test_cancelled_before_there_is_a_worker(folder):
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=":0") as local,
        distributed.Client(local, set_as_default=False) as client,
    ):
        executor = Dask(Table(scheduler=local.scheduler_address))
        jobs = submit(executor, cluster_tasks.stamp, folder, 0, 1)
        assert {state[:2] + state[3:] for state in executor.states(jobs).values()} == {
            ("waiting", "", "there is no worker")
        }
        executor.cancel(jobs)
        assert {state.reason for state in executor.states(jobs).values()} == {"was cancelled"}
        cluster_tasks.until(lambda: not client.run_on_scheduler(lambda dask_scheduler: len(dask_scheduler.tasks)))


def test_at_the_end_of_its_time(table, folder):
    executor = Dask(table.model_copy(update={"time": 8.0}))
    jobs = submit(executor, cluster_tasks.obey, folder, 0)
    assert ended(executor, jobs)[0].reason == "ran out of time"
    assert cluster_tasks.left(folder)[0]["heard"] == "SIGTERM"


@pytest.mark.slow
def test_a_worker_that_dies(workers, table, folder):
    """Its task ends too, and is done again on another."""
    executor = Dask(table)
    jobs = submit(executor, cluster_tasks.obey, folder, 0)
    first = cluster_tasks.until(lambda: cluster_tasks.left(folder).get(0))["pid"]

    def parent(pid):
        return int(open(f"/proc/{pid}/stat").read().rpartition(")")[2].split()[1])

    os.kill(parent(first), signal.SIGKILL)
    cluster_tasks.until(lambda: cluster_tasks.left(folder)[0]["pid"] != first)
    cluster_tasks.until(lambda: not os.path.exists(f"/proc/{first}"))
    cluster_tasks.until(lambda: executor.states(jobs)[jobs[0]].kind == "running")
    executor.cancel(jobs)
    assert ended(executor, jobs)[0].reason == "was cancelled"
    workers.wait_for_workers(2)


def test_nobody_answers(folder, monkeypatch, capfd):
    monkeypatch.setattr("harness.executors.dask.PATIENCE", 2)
    executor = Dask(Table(scheduler="tcp://127.0.0.1:1"))
    with pytest.raises(UserError, match=r"127\.0\.0\.1:1'?: no answer in 2 s .*; start it"):
        submit(executor, cluster_tasks.stamp, folder, 0)
    state = executor.states(["rayrace-0-0"])["rayrace-0-0"]
    assert state.kind == "unknown" and "no answer" in state.reason
    assert capfd.readouterr() == ("", "")


def test_distributed_is_not_there(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(UserError, match=r"pip install 'rayrace\[dask\]'"):
        Dask(Table(scheduler="tcp://127.0.0.1:1"))
