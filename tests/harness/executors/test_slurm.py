"""The executor for Slurm on a Slurm that the test starts (tests/support/slurm_cluster.py)."""

import os
import random
import re
import signal

import cluster_tasks
import pytest
import slurm_cluster

from harness.errors import UserError
from harness.executors import State
from harness.executors.slurm import Slurm
from harness.experiment.cluster import Slurm as Table


def submit(executor, work, folder, *numbers) -> list[str]:
    """Names of the jobs."""
    found = list(executor.submit(work, folder, list(numbers)))
    assert [number for number, _ in found] == list(numbers)
    return [job for _, job in found]


def ended(executor, jobs, seconds=180.0) -> list[State]:
    """Their states when all have ended."""

    def states():
        now = executor.states(jobs)
        return all(state.kind == "ended" for state in now.values()) and [now[job] for job in jobs]

    return cluster_tasks.until(states, seconds)


def log(folder) -> str:
    return "".join(path.read_text() for path in (folder / "logs").glob("*_log.out"))


def test_one_task_at_a_time_has_a_host_and_all_of_it(slurm, folder, real_cluster, capfd):
    executor = slurm(setup=("export GREETING='good morning'",), options={"comment": "of the test"})
    jobs = submit(executor, cluster_tasks.stamp, folder, 0, 1, 2, 3, 4, 5)
    assert {job.partition("_")[2] for job in jobs} == set("012345")
    assert [state[2:] for state in ended(executor, jobs)] == [("COMPLETED", "")] * 6, log(folder)
    given = [
        re.search(r" mem=(\w+)", real_cluster.ask("scontrol", "show", "job", job).replace(",", " "))[1] for job in jobs
    ]
    assert "100M" not in given, "as those have who do not ask"
    told = cluster_tasks.left(folder)
    assert len(told) == 6
    nodes = {}
    for each in told.values():
        environment = each["environment"]
        nodes.setdefault(environment["SLURMD_NODENAME"], []).append(each)
        assert set(each["cores"]) == os.sched_getaffinity(0) and each["count"] == os.cpu_count()
        assert environment["GREETING"] == "good morning"
    assert set(nodes) == {"node1", "node2"}
    assert not any(cluster_tasks.overlap(tasks) for tasks in nodes.values())
    script = next((folder / "logs").glob("*_submission.sh")).read_text()
    assert "--comment='of the test'" in script and "wckey" not in script
    assert capfd.readouterr() == ("", ""), "what submitit has to say is not for everybody"


def test_what_became_of_a_job(slurm, folder, real_cluster):
    executor = slurm()
    (good,) = submit(executor, cluster_tasks.stamp, folder, 0)
    (left,) = submit(executor, cluster_tasks.leave, folder, 7)
    (fault,) = submit(executor, cluster_tasks.fault, folder, 1)
    (died,) = submit(executor, cluster_tasks.die, folder, int(signal.SIGKILL))
    states = ended(executor, [good, left, fault, died])
    assert {state.host for state in states} <= {"node1", "node2"}
    assert [state.reason for state in states] == ["", "failed (exit 7)", "failed (exit 1)", "failed (signal 9)"]
    assert "task 1 is not possible" in log(folder)
    executor.cancel([good, left])  # have ended, and are left alone
    assert executor.states([good])[good].word == "COMPLETED"


def test_waiting_and_cancelled(slurm, folder):
    executor = slurm(options={"hold": True})
    held = submit(executor, cluster_tasks.stamp, folder, 0, 1, 2) + submit(executor, cluster_tasks.stamp, folder, 3)
    assert set(executor.states(held).values()) == {State("waiting", "", "PENDING", "JobHeldUser")}
    executor.cancel([*held[:2], held[3]])
    states = executor.states(held)
    assert [states[job].kind for job in held] == ["ended", "ended", "waiting", "ended"]
    assert states[held[3]].reason == "was cancelled (scancel)"
    assert states[held[0]].reason == "the scheduler no longer knows it"  # as is what never began of an array


def test_cancelled_while_it_runs(slurm, folder, real_cluster):
    executor = slurm()
    (job,) = submit(executor, cluster_tasks.last, folder, 0)
    pids = cluster_tasks.until(lambda: cluster_tasks.left(folder).get(0))["pids"]
    assert executor.states([job])[job]._replace(host="") == State("running", "", "RUNNING", "")
    executor.cancel([job])
    cluster_tasks.until(lambda: cluster_tasks.left(folder)[0]["heard"])  # it lives on after SIGTERM, and is told
    (state,) = ended(executor, [job])
    assert state.reason == "was cancelled (scancel)"
    heard = cluster_tasks.left(folder)[0]["heard"]
    assert [name for name, _ in heard] == ["SIGTERM"]
    assert not set(pids) & set(real_cluster.processes()), "killed with what it has started, whatever its session"


@pytest.mark.slow
def test_pre_empted(slurm, folder):
    executor = slurm()
    jobs = submit(executor, cluster_tasks.last, folder, 0, 1)
    cluster_tasks.until(lambda: len(cluster_tasks.left(folder)) == 2)
    (urgent,) = submit(slurm(partition="urgent"), cluster_tasks.stamp, folder, 2)
    assert ended(executor, [urgent])[0].reason == ""
    states = executor.states(jobs)
    gone = [number for number, job in enumerate(jobs) if states[job].kind == "ended"]
    assert [states[jobs[number]].reason for number in gone] == ["was pre-empted"]
    assert [name for name, _ in cluster_tasks.left(folder)[gone[0]]["heard"]] == ["SIGTERM"]


def test_a_thousand(slurm, folder, real_cluster):
    executor = slurm(options={"hold": True})
    assert executor.most == 10000
    jobs = submit(executor, cluster_tasks.stamp, folder, *range(1000))
    arrays = [job.partition("_")[0] for job in jobs]
    assert sorted(map(arrays.count, set(arrays))) == [200, 400, 400]
    assert {state.kind for state in executor.states(jobs).values()} == {"waiting"}
    random.seed(1)
    some = [*random.sample(jobs[:400], 150), *jobs[400:800:2]]  # squeue has names for regular gaps
    executor.cancel(some)
    states = executor.states(jobs)
    assert {job for job in jobs if states[job].kind == "ended"} == set(some)
    assert {state.kind for state in states.values()} == {"waiting", "ended"}
    executor.cancel(jobs)
    assert not real_cluster.ask("squeue", "--noheader")


@pytest.mark.parametrize(
    "table, words",
    [
        ({"partition": "nowhere"}, "invalid partition specified: nowhere"),
        ({"constraint": "fast"}, "Invalid feature specification"),
        ({"gpus": 1}, "Invalid generic resource"),
        ({"options": {"no-such-option": 1}}, "unrecognized option '--no-such-option=1'"),
    ],
)
def test_what_slurm_refuses(slurm, folder, table, words, capfd):
    with pytest.raises(UserError) as caught:
        submit(slurm(**table), cluster_tasks.stamp, folder, 0, 1)
    assert words in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_a_job_that_slurm_has_forgotten_and_a_slurm_that_is_down(folder, monkeypatch, real_cluster):
    with slurm_cluster.Cluster(remembered=2, extra="MessageTimeout=4") as short:
        monkeypatch.setenv("SLURM_CONF", short.environment["SLURM_CONF"])
        executor = Slurm(Table(), folder / "logs")
        jobs = submit(executor, cluster_tasks.stamp, folder, 0)
        said = "the scheduler no longer knows it"
        cluster_tasks.until(lambda: executor.states(jobs)[jobs[0]] == State("ended", reason=said))
        assert len(cluster_tasks.left(folder)) == 1
        executor.cancel(jobs)
        short.stop_controller()
        state = executor.states(jobs)[jobs[0]]
        assert state.kind == "unknown" and "Unable to contact slurm controller" in state.reason
        with pytest.raises(UserError, match="Unable to contact slurm controller"):
            executor.cancel(jobs)
        with pytest.raises(UserError, match="Unable to contact slurm controller"):
            submit(executor, cluster_tasks.stamp, folder, 1)
    assert not short.processes()


@pytest.mark.nightly("Slurm takes 140 s, as it counts in minutes; Dask does it by day (test_dask.py)")
def test_at_the_end_of_its_time(slurm, folder):
    """Slurm counts in minutes, and looks twice a minute."""
    (short,) = submit(slurm(time=60), cluster_tasks.last, folder, 0)
    (longer,) = submit(slurm(time=120), cluster_tasks.last, folder, 1)
    states = [*ended(slurm(), [short], 300), *ended(slurm(), [longer], 300)]
    assert [state.reason for state in states] == ["ran out of time"] * 2
    heard = {number: [name for name, _ in told["heard"]] for number, told in cluster_tasks.left(folder).items()}
    assert heard == {0: ["SIGTERM"], 1: ["SIGTERM"]}
