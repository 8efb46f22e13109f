"""Sessions: the jobs of a list give the results that they give alone, whatever the jobs before them did."""

import os
import random
import time
from dataclasses import replace

import numpy as np
import pytest
from feature_scenes import features

from harness.process import repetition, session
from harness.process.session import Sessions
from harness.renderer import registry
from harness.renderer.limits import Limits
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs

EMPTY = text.read("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\n", "empty")
SMALL = Parameters(width=4, height=3)

# Does what the depth of a job says; `seen` counts the jobs of this process.
PROGRAM = """
import sys, time
from renderers import worker
import numpy as np

seen = []

def main(arguments):
    job = worker.Job(arguments)
    seen.append(job.depth)
    if job.depth == 1:
        worker.refuse("no depth 1")
    if job.depth == 2:
        raise OSError("depth 2 fails")
    if job.depth == 3 and len(seen) > 1:
        import os, signal
        os.kill(os.getpid(), signal.SIGKILL)
    if job.depth == 4 and len(seen) > 1:
        time.sleep(1000)
    if job.depth == 5 and len(seen) > 1:
        raise worker.Apart("depth 5 first")
    place = next(word.partition("=")[2] for word in arguments if word.startswith("--job="))
    if job.depth == 7:
        open(place + "/lights.npy", "ab").write(b"more")
    if open(place + "/lights.npy", "rb").read().endswith(b"more") and job.depth != 7:
        raise OSError("lights of another job")
    if job.depth == 6:
        print("x" * 100_000, file=sys.stderr)
    with worker.phase("load"):
        pass
    worker.render(job, lambda: time.sleep(1e-6))
    with worker.phase("save"):
        np.save(job.output("image.npy"), np.full((job.height, job.width, 3), float(len(seen))))
    worker.say("output", file="image.npy")

worker.serve(main, sys.argv[1:])
"""
MANIFEST = """contract = 1
name = "listed"
technology = "Python"
description = "of the test"
features = ["sphere", "reflection"]
jobs = true
[[variant]]
name = "listed"
command = ["{python}", "{folder}/main.py"]
"""


@pytest.fixture
def listed(tmp_path):
    folder = tmp_path / "listed"
    folder.mkdir()
    (folder / "renderer.toml").write_text(MANIFEST)
    (folder / "main.py").write_text(PROGRAM)
    return registry.entries((folder,))["listed"]


@pytest.fixture
def sessions():
    with Sessions() as made:
        yield made


def do(sessions, entry, depth, **more):
    return sessions.run(entry, flatten(EMPTY), replace(SMALL, depth=depth), (), **more)


def number_of(result):
    """How many jobs the process of a result had, that one included."""
    assert result.status == "ok", (result.status, result.reason)
    return int(result.array[0, 0, 0])


def test_jobs_share_a_process(sessions, listed):
    assert [number_of(do(sessions, listed, 0)) for _ in range(3)] == [1, 2, 3]


def test_jobs_of_one_scene_share_its_files_and_others_have_their_own(sessions, listed):
    """But for what a job has changed, which the next one does not see."""
    other = flatten(text.read("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nAMBIENT (1,1,1)\n", "other"))
    number_of(do(sessions, listed, 0))
    (kept,) = sessions.kept.values()
    first = kept.place
    number_of(do(sessions, listed, 0))
    assert kept.place == first
    assert number_of(sessions.run(listed, other, SMALL, ())) == 3 and kept.place != first and not first.exists()
    failed = do(sessions, listed, 7)
    assert failed.status == "failed" and "changed its job: lights.npy" in failed.reason
    assert number_of(do(sessions, listed, 0)) == 5


def test_a_refused_job_leaves_the_next_ones(sessions, listed):
    do(sessions, listed, 0)
    refused = do(sessions, listed, 1)
    assert (refused.status, refused.reason) == ("unsupported", "no depth 1")
    assert number_of(do(sessions, listed, 0)) == 3


def test_a_job_that_fails_is_tried_again_alone(sessions, listed):
    do(sessions, listed, 0)
    failed = do(sessions, listed, 2)
    assert (failed.status, failed.reason) == ("failed", "exit 1: OSError: depth 2 fails")
    assert number_of(do(sessions, listed, 0)) == 3


def test_a_crash_after_other_jobs_is_no_result(sessions, listed):
    do(sessions, listed, 0)
    assert number_of(do(sessions, listed, 3)) == 1  # alone it does not crash
    assert number_of(do(sessions, listed, 0)) == 1  # in a new process


def test_a_hang_after_other_jobs_is_no_result(sessions, listed):
    do(sessions, listed, 0)
    start = time.monotonic()
    assert number_of(do(sessions, listed, 4, timeout=5.0)) == 1  # it holds for the second try too
    assert 5.0 <= time.monotonic() - start < 60


def test_a_job_that_wants_another_process_gets_it_and_both_stay(sessions, listed):
    assert [number_of(do(sessions, listed, depth)) for depth in (0, 5, 0, 0)] == [1, 1, 2, 3]
    assert len(sessions.kept) == 2


def test_limits_hold(sessions, listed):
    few = Limits(output=50_000)
    assert number_of(do(sessions, listed, 0, limits=few)) == 1
    result = do(sessions, listed, 6, limits=few)
    assert result.status == "failed" and "the limit is 50 kB" in result.reason, result.reason


def test_only_so_many_processes_are_kept(sessions, listed, tmp_path):
    for k in range(session.MOST + 2):
        do(sessions, listed, 0, cache=tmp_path / f"cache-{k}")
    assert len(sessions.kept) == session.MOST


def test_nothing_is_left_behind(listed, tmp_path, monkeypatch):
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    with pytest.raises(KeyboardInterrupt), Sessions() as sessions:
        do(sessions, listed, 0)
        (kept,) = sessions.kept.values()
        pid = kept.process.started["pid"]
        assert os.path.exists(f"/proc/{pid}") or not os.path.exists("/proc/self")
        raise KeyboardInterrupt
    assert not list((tmp_path / "tmp").iterdir())
    assert not os.path.exists(f"/proc/{pid}")


def test_a_session_reports_no_processor_time_or_memory_of_one_job(sessions, listed):
    outcome = do(sessions, listed, 0).outcome
    assert outcome.user_s is None and outcome.wait4_peak_bytes is None and outcome.wall_s > 0


def test_a_renderer_without_lists_gets_a_process_for_each(sessions, listed):
    alone = replace(
        listed, renderer=replace(listed.renderer, manifest=listed.renderer.manifest.model_copy(update={"jobs": False}))
    )
    assert [number_of(do(sessions, alone, 0)) for _ in range(2)] == [1, 1] and not sessions.kept


@pytest.mark.parametrize("variant", ["python", "numpy", "cpp", "cpp-threads"])
def test_the_bytes_of_a_list_are_those_of_single_jobs(bench, tmp_path, variant):
    """Jobs of all kinds in random order: no picture, count or dropped weight depends on the jobs before."""
    seed = int.from_bytes(os.urandom(4))
    print("seed", seed)
    rng, entry, cases = random.Random(seed), bench.entry(variant), features(tmp_path)
    names = rng.sample(sorted(cases), 5)
    for name in [*names, *names]:
        source, jobs = cases[name]
        scene = text.read(source, name)
        size = {"width": rng.randint(2, 9), "height": rng.randint(2, 9), "sample_x": rng.random()}
        kernel = {"kernel": "general"} if entry.renderer.manifest.build else {}
        wanted = Parameters(**{"threads": entry.threads(), **jobs, **size, **kernel})
        needed = needs(scene, wanted)
        one = repetition.run(entry, flatten(scene), wanted, needed, cache=bench.caches / variant)
        other = bench.run(entry, flatten(scene), wanted, needed)
        assert (one.status, one.reason) == (other.status, other.reason), name
        if one.status == "ok":
            assert one.array.tobytes() == other.array.tobytes(), name
            assert (one.said.rays, one.said.used) == (other.said.rays, other.said.used), name
            assert np.array_equal(one.dropped, other.dropped) if one.dropped is not None else other.dropped is None
