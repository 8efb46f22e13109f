"""Tiles that are rendered by jobs: submitted, followed, refused, lost and done again."""

import json
import shutil

import numpy as np
import pytest
from tiled import EMPTY, image

from harness.errors import UserError
from harness.executors import State
from harness.single import following, mosaic, tiles


class Fake:
    """An Executor that does tasks when it is told to: `plan(number)` is the State of the job after it was asked for.

    A plan may call `work`, and may be about any of the tasks that were submitted.
    """

    most = None

    def __init__(self):
        self.taken, self.plan = [], None

    def submit(self, work, folder, numbers):
        for number in numbers:
            self.taken.append(number)
            yield number, f"job-{number}"

    def states(self, jobs):
        return {job: self.plan(int(job.removeprefix("job-"))) for job in jobs}

    def cancel(self, jobs):
        pass


@pytest.fixture
def fake(monkeypatch):
    made = Fake()
    monkeypatch.setattr(mosaic.executors, "find", lambda name, settings, logs: made)
    monkeypatch.setattr(following, "POLL", 0)
    return made


@pytest.fixture
def piece(write, tmp_path, bad_folder, capsys):
    """Render a picture of six tiles, two to a job, by a renderer that takes no time; what was told, or the error."""
    path, folder = write("empty.txt", EMPTY), bad_folder("bad-nothing", "bad-refuse", name="quick")

    def render(variant="bad-nothing", **values):
        asked = image(**{"width": 14, "height": 10, **values})
        way = mosaic.Way("slurm", None, 2)
        mosaic.render(path, variant, tmp_path / "a.npy", asked, 5, way, 60, (folder,), True)
        out, render.said = capsys.readouterr()
        return json.loads(out)

    render.scene, render.folder, render.place = path, folder, tmp_path / "a.npy.tiles"
    return render


def test_a_job_that_ends_midway(fake, piece, capsys, tmp_path):
    def plan(number):
        if number == 1:
            return State("ended", "node7", "TIMEOUT", "ran out of time")
        tiles.work(str(piece.place), number)
        return State("ended", "node1", "COMPLETED")

    fake.plan = plan
    with pytest.raises(SystemExit) as ended:
        piece()
    assert str(ended.value).startswith("error: 2 of 6 tiles are missing; the same command renders those alone; ")
    assert "1 job: node7: ran out of time\n" in capsys.readouterr().err
    assert fake.taken == [0, 1, 2] and tiles.Folder(piece.place).there() == {0, 1, 4, 5}

    fake.taken.clear()
    assert piece()["kept"] == 4 and fake.taken == [3]
    assert np.array_equal(np.load(tmp_path / "a.npy")[..., 0], np.full((10, 14), np.load(tmp_path / "a.npy")[0, 0, 0]))
    assert not piece.place.exists()


def test_jobs_that_are_in_the_queue_are_not_submitted_again(fake, piece, capsys):
    def stop(number):
        raise KeyboardInterrupt

    fake.plan = stop
    with pytest.raises(KeyboardInterrupt):
        piece()
    said = capsys.readouterr().err
    assert (
        "6 tiles to be rendered by jobs: 3 to be submitted, 0 submitted before\n" in said
        and "stopped; finished tiles stay in " in said
    )
    assert "3 jobs of --executor slurm go on: job-0, job-1, job-2\n" in said

    tiles.work(str(piece.place), 0)  # it ran while nobody looked

    def plan(number):
        if number == 2:
            return State("ended", "", "CANCELLED", "was cancelled (scancel)")
        if asked.append(number) or len(asked) > 1:
            tiles.work(str(piece.place), number)
        return State("running", "node1")

    fake.plan, asked = plan, []
    assert piece()["kept"] == 2 and fake.taken == [0, 1, 2, 3]  # 3 is what 2 was
    assert "4 tiles to be rendered by jobs: 1 to be submitted, 1 submitted before\n" in piece.said


def test_a_task_does_not_do_what_is_there(fake, piece):
    """Whoever else has made it: jobs that were forgotten and submitted twice."""

    def plan(number):
        for each in (0, 1, 2):
            before = {path: path.stat().st_mtime_ns for path in piece.place.glob("?.npy")}
            tiles.work(str(piece.place), each)
            assert before == {path: path.stat().st_mtime_ns for path in before}
        return State("ended")

    fake.plan = plan
    assert piece()["tiles"] == 6


def edited(piece, what):
    """Something that the picture is made of is another: what a job says of it."""
    if what == "scene":
        piece.scene.write_text(EMPTY.replace("0.2", "0.3"))
        return "this host would render another picture: scene was "
    if what == "renderer":
        with open(piece.folder / "main.py", "a") as file:
            file.write("\n# edited\n")
        return "this host would render another picture: renderer was "
    if what == "gone":
        piece.scene.unlink()
        return "empty.txt: no such file"
    spec = json.loads((piece.place / "spec.json").read_text())
    spec["picture"]["packages"]["numpy"] = "1.0"
    (piece.place / "spec.json").write_text(json.dumps(spec))
    return 'this host would render another picture: packages.numpy was "1.0", is "'


@pytest.mark.parametrize("what", ["scene", "renderer", "packages", "gone"])
def test_a_job_refuses_to_mix_pictures(what, fake, piece, capsys):
    words = []

    def plan(number):
        words.append(edited(piece, what)) if not words else None
        tiles._ready.cache_clear()  # a job has a process of its own
        tiles.work(str(piece.place), number)
        return State("ended", "", "COMPLETED")

    fake.plan = plan
    with pytest.raises(SystemExit, match="6 of 6 tiles are missing"):
        piece()
    said = capsys.readouterr().err
    assert "3 jobs: " in said and words[0] in said and not tiles.Folder(piece.place).there()


@pytest.mark.parametrize("what", ["scene", "renderer", "width", "packages"])
def test_the_command_refuses_to_mix_pictures(what, fake, piece):
    fake.plan = lambda number: tiles.work(str(piece.place), 0) or State("ended")
    with pytest.raises(SystemExit):
        piece()
    kept = tiles.Folder(piece.place).there()
    changed = {"width": 15} if what == "width" else {}
    told = "parameters.width was 14, is 15" if what == "width" else edited(piece, what).partition("picture: ")[2]
    if what == "packages":
        told = 'packages.numpy was "1.0", is "'
    with pytest.raises(UserError) as refused:
        piece(**changed)
    assert f"{piece.place} has tiles of another picture: " in str(refused.value) and told in str(refused.value)
    assert str(refused.value).endswith("; remove it to start again") and tiles.Folder(piece.place).there() == kept
    shutil.rmtree(piece.place)
    fake.plan = lambda number: tiles.work(str(piece.place), number) or State("ended")
    assert piece(**changed)["kept"] == 0


def test_a_folder_without_tiles_is_begun_anew(fake, piece):
    fake.plan = lambda number: State("ended", "node1", "NODE_FAIL", "lost its host")
    with pytest.raises(SystemExit):
        piece()
    fake.plan = lambda number: tiles.work(str(piece.place), number) or State("ended")
    fake.taken.clear()
    assert piece(width=15)["width"] == 15 and fake.taken == [0, 1, 2]


def test_a_folder_of_something_else(fake, piece):
    piece.place.mkdir()
    (piece.place / "mine.txt").write_text("mine")
    with pytest.raises(UserError, match="not a folder of tiles; remove it, or give -o another name"):
        piece()
    assert [path.name for path in piece.place.iterdir()] == ["mine.txt"]


def test_a_damaged_tile(fake, piece):
    def plan(number):
        tiles.work(str(piece.place), number)
        if number == 1:
            (piece.place / "3.npy").write_bytes(b"\x93NUMPY")
        return State("ended")

    fake.plan = plan
    with pytest.raises(UserError, match=r"3\.npy: .*; remove it, and the same command renders the tile again"):
        piece()
    (piece.place / "3.npy").unlink()
    fake.plan = lambda number: tiles.work(str(piece.place), number) or State("ended")
    assert piece()["kept"] == 5


def test_a_scheduler_that_takes_few(fake, piece):
    """No more jobs than it takes are in its queue."""
    fake.most = 2
    most = []

    def plan(number):
        most.append(len(fake.taken))
        if number > 0 or len(most) > 4:
            tiles.work(str(piece.place), number)
        return State("running") if number == 0 and len(most) <= 4 else State("ended")

    fake.plan = plan
    assert piece()["tiles"] == 6 and most[0] == 2 and fake.taken == [0, 1, 2]


def test_a_scheduler_that_takes_no_more(fake, piece, capsys):
    def submit(work, folder, numbers):
        yield numbers[0], "job-0"
        raise UserError("Slurm refuses more jobs: QOSMaxSubmitJobPerUserLimit")

    fake.submit, fake.plan = submit, lambda number: tiles.work(str(piece.place), number) or State("ended")
    with pytest.raises(SystemExit, match="4 of 6 tiles are missing"):
        piece()
    assert "1 job: Slurm refuses more jobs: QOSMaxSubmitJobPerUserLimit\n" in capsys.readouterr().err
