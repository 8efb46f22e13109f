"""Runs on a cluster, with jobs done in this process: what is submitted, what is kept, what is told of what was lost."""

import json
import re
import shutil

import pytest
from compilers import needs_compiler
from fake_cluster import Cluster

from harness.cluster import batch, campaign, part, status
from harness.errors import UserError
from harness.experiment import experiment
from harness.machine import software
from harness.plan import plan, predict
from harness.race import race
from harness.renderer import registry
from harness.store import alone, likeness, store
from harness.store.record import key
from rayrace import outcome

SCENE = """CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)
AMBIENT (0.2,0.2,0.3)
LIGHT (4,7,9) (0.9,0.8,0.7) 0
SPHERE (0.1,-0.2,-1) 0.8 (0.7,0.3,0.2) 0.4 20 (0,0,0) 1 1
"""
EXPERIMENT = """title = "a few cells"
scenes = ["scene.txt"]
renderers = ["numpy", "python"]
processes = 2
frames = 1
[image]
width = 5
height = 4
depth = 1
[sweep]
depth = [1, 2, 3]
[slurm]
cells = 2
time = "10 min"
"""


@pytest.fixture(autouse=True)
def _no_waiting(monkeypatch):
    monkeypatch.setattr(campaign, "POLL", 0.0)
    monkeypatch.setattr(campaign, "LOOK", 0.0)


@pytest.fixture
def file(tmp_path):
    (tmp_path / "scene.txt").write_text(SCENE)
    (tmp_path / "e.toml").write_text(EXPERIMENT)
    return tmp_path / "e.toml"


@pytest.fixture
def cluster(monkeypatch):
    return Cluster(monkeypatch)


class Front:
    """One who submits, and what it was told."""

    def __init__(self, file, known, cluster, name="run"):
        self.file, self.known, self.cluster = file, known, cluster
        self.folder = file.parent / name
        self.said, self.told = [], []

    def campaign(self, *settings):
        asked = experiment.load(self.file, settings)
        return campaign.Campaign(self.folder, asked, self.file, plan.make(asked, self.file, self.known), "slurm")

    def begin(self, *settings, renderers=()):
        self.folder.mkdir()
        made = self.campaign(*settings)
        predictor = predict.Predictor([])
        made.begin(campaign.plan_batches(made.experiment, made.plan, "slurm", predictor), (), renderers)
        return made

    def run(self, *settings):
        """Begin, or go on, and follow to the end; the rows."""
        if self.folder.exists():
            made = self.campaign(*settings)
            made.go_on()
        else:
            made = self.begin(*settings)
        made.submit(self.cluster, self.said.append)
        made.follow(self.cluster, lambda *told: self.told.append(told))
        return self.rows()

    def rows(self):
        return store.read(self.folder, store.hosts(self.folder))[1]


@pytest.fixture
def front(file, known, cluster):
    return Front(file, known, cluster)


def test_a_run_of_jobs_is_the_same_run(front, file, known):
    """Cells, repetitions and pictures are those of a run on one machine."""
    rows = front.run()
    assert front.cluster.done == [0, 1, 2]
    assert len(front.told) == len(rows) == 12 and {row["status"] for row in rows} == {"ok"}

    asked = experiment.load(file)
    here = race.run(asked, plan.make(asked, file, known), known, file.parent / "here")
    assert {key(row) for row in rows} == {key(row) for row in here}
    for mine, other in zip(sorted(rows, key=key), sorted(here, key=key), strict=True):
        assert mine["picture"]["sha256"] == other["picture"]["sha256"] and mine["cell"] == other["cell"]
        assert (front.folder / mine["picture"]["file"]).exists()
        assert {name: mine["agreement"][name] for name in ("rmse", "max_outside", "wrong")} == {
            name: other["agreement"][name] for name in ("rmse", "max_outside", "wrong")
        }
    facts, _ = store.read(front.folder)
    assert [cell["cell"] for cell in facts["cells"]] == [
        cell["cell"] for cell in store.read(file.parent / "here")[0]["cells"]
    ]
    assert {row["host"] for row in rows} == set(facts["hosts"])
    ended = [(row["started"], row["took_s"]) for row in rows]
    assert all(took > 0 for _, took in ended)


@pytest.mark.slow
def test_a_job_that_is_cancelled_leaves_what_it_had(front):
    """Its finished repetitions stay, the others are rows with the reason; going on runs these alone."""
    front.cluster.stop_after = {1: 3}
    rows = front.run()
    lost = [row for row in rows if row["status"] != "ok"]
    assert len(rows) == 12 and len(lost) == 1
    assert lost[0]["status"] == "killed" and "job 101" in lost[0]["reason"] and "scancel" in lost[0]["reason"]
    assert lost[0]["lost"] is True and lost[0]["point"] == {"depth": 2}
    assert status.of(front.folder).done == 11

    front.cluster.stop_after, front.cluster.done = {}, []
    told = len(front.told)
    rows = front.run()
    assert front.cluster.done == [1] and len(front.told) == told + 1
    assert len(rows) == 12 and {row["status"] for row in rows} == {"ok"}
    assert front.run() == rows and front.cluster.done == [1]  # nothing is left to be submitted


@pytest.mark.slow
def test_a_host_that_dies(front):
    """All of its batch is lost, with the scheduler's word, and the others are not."""
    front.cluster.dead = {0}
    rows = front.run()
    lost = [row for row in rows if row.get("lost")]
    assert {(row["point"]["depth"], row["status"]) for row in lost} == {(1, "killed")} and len(lost) == 4
    assert all("lost its host" in row["reason"] for row in lost)
    front.cluster.dead = set()
    assert {row["status"] for row in front.run()} == {"ok"}


@pytest.mark.slow
def test_jobs_that_live_are_not_submitted_again(front):
    """Who comes back while jobs wait adds none, and follows those that are there."""
    front.cluster.held = True
    made = front.begin()
    made.submit(front.cluster, front.said.append)
    again = front.campaign()
    again.go_on()
    again.submit(front.cluster, front.said.append)
    assert len(front.cluster.jobs) == 3 and "3 of its jobs are still waiting or running" in front.said[-1]
    assert {line.said for line in status_lines(front)} == {"waiting (Priority)"}
    front.cluster.held = False
    again.follow(front.cluster, lambda *told: front.told.append(told))
    assert len(front.told) == 12


def status_lines(front):
    """As `rayrace status` has it, with the cluster of the test for Slurm."""
    with front.cluster.patch.context() as patch:
        patch.setattr(status, "scheduler", lambda folder, told: front.cluster)
        return status.of(front.folder).lines


def test_cancel(front):
    front.cluster.held = True
    front.begin().submit(front.cluster, front.said.append)
    with front.cluster.patch.context() as patch:
        patch.setattr(status, "scheduler", lambda folder, told: front.cluster)
        assert status.cancel(front.folder) == 3
    made = front.campaign()
    made.go_on()
    made.settle(front.cluster)
    assert [row["status"] for row in front.rows()] == ["killed"] * 12


@pytest.mark.slow
def test_another_software_is_refused(front, monkeypatch):
    """A job on a host with another version of a package measures nothing, and says why."""
    real = software.here
    made = front.begin()
    made.submit(front.cluster, front.said.append)
    other = {**real(), "packages": {**real()["packages"], "numpy": "1.0"}}
    with monkeypatch.context() as patch:
        patch.setattr(part.software, "here", lambda: other)
        made.follow(front.cluster, lambda *told: front.told.append(told))
    rows = front.rows()
    assert front.told == [] and {row["status"] for row in rows} == {"unavailable"}
    assert all("packages.numpy is 1.0 here" in row["reason"] for row in rows)
    assert {row["status"] for row in front.run()} == {"ok"}


def test_another_scene_is_refused(front, file):
    """A scene that was changed after it was submitted is not measured; the run cannot be gone on with either."""
    made = front.begin()
    made.submit(front.cluster, front.said.append)
    (file.parent / "scene.txt").write_text(SCENE.replace("0.8 (0.7", "0.9 (0.7"))
    made.follow(front.cluster, lambda *told: front.told.append(told))
    assert front.told == [] and all("scene_version was" in row["reason"] for row in front.rows())
    with pytest.raises(UserError, match="it cannot be resumed after these changes"):
        front.campaign().go_on()


def test_another_renderer_is_refused(file, known, cluster, tmp_path):
    """One whose sources were edited after it was submitted."""
    folder = tmp_path / "own" / "numpy"
    shutil.copytree(known["numpy"].renderer.folder, folder)
    shutil.copy(known["numpy"].renderer.folder.parent / "worker.py", folder.parent)
    manifest = folder / "renderer.toml"
    manifest.write_text(re.sub(r'^(name +=) "numpy"', r'\1 "copied"', manifest.read_text(), flags=re.MULTILINE))
    file.write_text(EXPERIMENT.replace('"numpy"', '"copied"'))
    front = Front(file, registry.entries((folder,)), cluster)
    front.begin(renderers=(folder,)).submit(cluster, front.said.append)
    (folder / "extra.py").write_text("x = 1\n")
    front.campaign().follow(cluster, lambda *told: front.told.append(told))
    rows = front.rows()
    assert all("renderer_version was" in row["reason"] for row in rows) and len(rows) == 12


@pytest.mark.slow
@needs_compiler("c++")
def test_what_was_unavailable_is_tried_again(front, file, monkeypatch):
    """A host without a compiler makes rows that say so; another host may have one."""
    file.write_text(EXPERIMENT.replace('"python"', '"cpp"'))
    with monkeypatch.context() as patch:
        patch.setenv("CXX", "/nonexistent/c++")
        rows = front.run()
    bad = [row for row in rows if row["status"] == "unavailable"]
    assert {row["variant"] for row in bad} == {"cpp"} and len(bad) == 6
    assert "there is no such program" in bad[0]["reason"]
    assert status.of(front.folder).statuses["unavailable"] == 6
    rows = front.run()
    assert len(rows) == 12 and {row["status"] for row in rows} == {"ok"}


@pytest.mark.slow
def test_hosts_are_not_pooled(file, known, monkeypatch, capsys):
    """Rows say which host they are of. Two hosts are read together only if that is asked for."""
    front = Front(file, known, Cluster(monkeypatch, ["left", "right"]))
    rows = front.run()
    by_host = {}
    for row in rows:
        by_host.setdefault(row["host"].rpartition("-")[0], set()).add(row["point"]["depth"])
    assert by_host == {"left": {1, 3}, "right": {2}}
    with pytest.raises(UserError, match="of several hosts, which are not pooled"):
        store.read(front.folder)
    outcome.show(front.folder, rows)
    assert outcome.compared(front.folder, None) is None, "nothing to compare is no fault"
    assert not capsys.readouterr().out
    names = list(store.hosts(front.folder))
    facts, some = store.read(front.folder, names[1:])
    assert facts["environment"]["host"] == "right" and len(some) == 4 and len(facts["cells"]) == 2
    both, all_ = store.read(front.folder, names)
    assert both["environment"]["host"] == "left, right" and len(all_) == 12
    assert likeness.of_run(front.folder) == [] or "does" in likeness.of_run(front.folder)[0]  # alike but for speed


def test_only_one_follows(front):
    front.begin()
    with (
        alone.only_one(front.folder),
        pytest.raises(UserError, match="another rayrace is at work"),
        alone.only_one(front.folder),
    ):
        pass


@pytest.mark.slow
def test_the_scheduler_takes_no_more(front):
    """What does not fit into its queue waits until there is room."""
    front.cluster.most = 2
    rows = front.run()
    assert "2 jobs submitted" in front.said[0] and "1 jobs wait for room" in front.said[1]
    assert front.cluster.done == [0, 1, 2] and len(rows) == 12


@pytest.mark.slow
def test_a_pair_in_each_job(front):
    """The noise floor is of the host and the hour: each job has a pair of its own."""
    rows = front.run("processes=5")
    pairs = {json.dumps(row["point"]) for row in rows if row["pass"] == "pair"}
    assert len(pairs) == 3 and len(rows) == 30 + 15
    facts, _ = store.read(front.folder)
    assert len(facts["pairs"]) == 3 and all("cell" in pair for pair in facts["pairs"])
    assert status.of(front.folder).done == status.of(front.folder).all == 45


def test_a_thousand_cells(file, known):
    """1,000 cells are as many jobs as are asked for, and none holds cells of another place than its own."""
    file.write_text(EXPERIMENT.replace("depth = [1, 2, 3]", f"seed = {list(range(500))}"))
    asked = experiment.load(file)
    made = plan.make(asked, file, known)
    assert len(made.cells) == 1000
    for most, jobs in ((1, 500), (2, 500), (7, 167), (20, 50), (1000, 1)):
        batches = batch.make(made, "auto", most, 3600.0, predict.Predictor([]))
        assert len(batches) == jobs
        assert sorted(cell.key for each in batches for cell in each.cells) == sorted(cell.key for cell in made.cells)
        for each in batches:
            assert len(each.cells) % 2 == 0 and {cell.entry.name for cell in each.cells} == {"numpy", "python"}
    told = campaign.Forecast(asked.slurm, batch.make(made, "auto", 20, 600.0, predict.Predictor([])))
    assert "50 jobs of at most 20 cells" in told.text and "at most 8.33 host hours" in told.text
    again = [batch.restored(json.loads(json.dumps(each.record())), made) for each in told.batches]
    assert [each.cells for each in again] == [each.cells for each in told.batches]
