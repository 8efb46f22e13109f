"""Cheats are found by a frame that nobody could foresee, and honest renderers are not accused."""

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import cheats
import numpy as np
import pytest

from harness.process import repetition
from harness.process.dialog import Answer
from harness.process.repetition import Result
from harness.race import contradiction, frames
from harness.renderer import places, registry
from harness.renderer.events import Said
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs
from harness.store.record import CONTRADICTED, FALSE_FRAMES, UNCHECKED

EXPERIMENT = """title = "cheats"
scenes = ["scene.txt"]
renderers = [{names}]
processes = {processes}
frames = 2
timeout = "120 s"
[image]
width = {size}
height = {size}
depth = 2
shadows = true
"""


def run_of(rayrace, rows, place, names, *more, size=64, processes=1, code=None):
    """The rows of an experiment by variant."""
    (place / "scene.txt").write_text(cheats.SCENE)
    listed = ", ".join(f'"{name}"' for name in names)
    (place / "e.toml").write_text(EXPERIMENT.format(names=listed, processes=processes, size=size))
    rayrace("run", place / "e.toml", "--out", place / "run", *more, code=code)
    return rows(place / "run")


def left_in_memory():
    """Removes what the cheat `shm` has kept."""
    for file in Path("/dev/shm").glob(f"rayrace-cheat-{os.getuid()}-*"):
        file.unlink(missing_ok=True)


@pytest.fixture(scope="module")
def second(rayrace, rows, tmp_path_factory):
    """Rows of all cheats by contract 2, of one process each."""
    place = tmp_path_factory.mktemp("second")
    names = [*cheats.CHEATS, *cheats.DOUBTED, "true"]
    folder = cheats.folder(place / "cheats", 2, *names)
    yield run_of(rayrace, rows, place, [f"cheat2-{name}" for name in names], "--renderer", folder)
    left_in_memory()


# Cheats by contract 1 of which nothing is found.
UNSEEN = [name for name, part in cheats.FIRST.items() if not part]


@pytest.fixture(scope="module")
def first(rayrace, rows, tmp_path_factory):
    """Rows of cheats by contract 1, of two processes each: some keep their picture for the second."""
    place = tmp_path_factory.mktemp("first")
    names = [*UNSEEN, "true"]
    folder = cheats.folder(place / "cheats", 1, *names)
    yield run_of(rayrace, rows, place, [f"cheat1-{name}" for name in names], "--renderer", folder, processes=2)
    left_in_memory()


@pytest.mark.slow
@pytest.mark.whole
@pytest.mark.parametrize("cheat", cheats.CHEATS)
def test_a_cheat_is_found(second, cheat):
    (row,) = second[f"cheat2-{cheat}"]
    status, part = cheats.CHEATS[cheat]
    assert row["status"] == status, (row["status"], row["reason"])
    why = (row["unranked"] or "") if status == "ok" else row["reason"]
    assert status != "ok" or why.startswith(CONTRADICTED), why
    other = cheats.FIRST.get(cheat)  # what its marks may contradict too, in which case no frame is asked for
    if not (other and why.startswith(CONTRADICTED + other)):
        assert part in why and (part in (cheats.OTHER, cheats.WRONG)) == why.startswith(FALSE_FRAMES), why


@pytest.mark.alone
@pytest.mark.parametrize("cheat", cheats.OUTSIDE)
def test_work_outside_of_frames_is_found(cheat, tmp_path):
    """Other programs may run meanwhile: nothing of that is told here, and it lies all the same."""
    entry = registry.entries((cheats.folder(tmp_path / "cheats", 2, *cheats.OUTSIDE),))[f"cheat2-{cheat}"]
    scene, series = text.read(cheats.SCENE), tmp_path / "series.csv"
    parameters = Parameters(width=160, height=160, depth=2, shadows=True, frames=4)
    job = entry, flatten(scene), parameters, needs(scene, parameters)
    result = repetition.run(*job, series=series)
    assert result.status == "ok", result.reason
    told = contradiction.reason(result, series, entry, parameters, None, pytest.fail)
    assert told.startswith(f"{CONTRADICTED}its phases: it"), told


@pytest.mark.slow
@pytest.mark.parametrize("cheat", cheats.DOUBTED)
def test_one_that_cannot_be_checked_is_named(second, cheat):
    (row,) = second[f"cheat2-{cheat}"]
    assert any(text.startswith(UNCHECKED + cheats.DOUBTED[cheat]) for text in row["warnings"]), row["warnings"]
    assert cheats.DOUBTED[cheat] in row["checked"]["unavailable"]


@pytest.mark.slow
@pytest.mark.whole
@pytest.mark.parametrize("cheat", UNSEEN)
def test_by_contract_1_frames_are_unchecked(first, cheat):
    last = first[f"cheat1-{cheat}"][-1]
    assert last["status"] == "ok", last["reason"]
    assert [text for text in last["warnings"] if text.startswith(UNCHECKED)] and last["checked"]["unavailable"]


@pytest.mark.alone
def test_by_contract_1_marks_contradict(rayrace, rows, tmp_path):
    """What others use of the processor meanwhile could be theirs, so nothing may run beside these."""
    names = [name for name in cheats.FIRST if name not in UNSEEN]
    folder = cheats.folder(tmp_path / "cheats", 1, *names)
    # So large that what is rendered outside of frames takes far longer than a start.
    more = {"processes": 2, "size": 144}
    found = run_of(rayrace, rows, tmp_path, [f"cheat1-{name}" for name in names], "--renderer", folder, **more)
    for name in names:
        last = found[f"cheat1-{name}"][-1]
        assert (last["unranked"] or "").startswith(CONTRADICTED + cheats.FIRST[name]), (name, last["unranked"])


@pytest.mark.slow
def test_the_truth_is_not_accused(first, second):
    """That the program that cheats is right where it does not."""
    (row,) = second["cheat2-true"]
    assert (row["status"], row["unranked"]) == ("ok", None)
    assert not [text for text in row["warnings"] if text.startswith(UNCHECKED)]
    assert row["checked"]["frame"] in (1, 2) and row["checked"]["render"] == 0
    assert first["cheat1-true"][-1]["unranked"] is None


def test_one_repetition_of_five_to_nine_has_its_turn():
    for processes in (1, 3, 5, 6, 7, 12, 20):
        due, turns = set(), frames.Turns()
        for cell in map(str, range(60)):
            mine = [number for number in range(processes) if turns.is_due(cell, number, processes)]
            blocks = max(1, processes // frames.BLOCK)
            assert [number * blocks // processes for number in mine] == list(range(blocks))
            due |= set(mine)
        assert due == set(range(processes)), "any of them may be it"


def test_a_resumed_run_has_its_turn():
    """Of what is left of a block."""
    for _ in range(30):
        turns = frames.Turns()
        assert sum(turns.is_due("a", number, 5) for number in (3, 4)) == 1


def repeated(count=2, renders=3, checksum="00c0ffee"):
    """A Result of contract 2 with so many later frames."""
    said = [{"index": index, "renders": renders if index else 1} for index in range(count + 1)]
    for frame in said:
        frame["checksums"] = "".join(f"{frame['index']:04x}{number:04x}" for number in range(frame["renders"]))
    outcome = SimpleNamespace(places=Answer(1.0, (5, 6), said[:1]))
    return Result("ok", array=np.zeros((2, 2, 3)), said=Said(frames=said), outcome=outcome)


def test_a_repetition_that_failed_passes_its_turn_on():
    for _ in range(30):
        turns = frames.Turns()
        assert [turns.is_due("a", number, 5) for number in (0, 1, 4)].count(True) == 1
        assert sum(turns.is_due("b", number, 5) for number in (0, 1)) <= 1


def test_any_render_of_a_later_frame_may_be_named():
    parameters, found = Parameters(width=2, height=2, frames=2, least_frame=1e-3), set()
    for _ in range(200):
        choice = frames.choose(repeated(), parameters)
        assert choice.checksum == f"{choice.frame:04x}{choice.render:04x}"
        assert choice.sample == places.place((5, 6), choice.frame, choice.render, (0.5, 0.5))
        job = choice.job(parameters)
        assert (job.frames, job.least_frame, job.sample_x, job.sample_y) == (0, 0.0, *choice.sample)
        found.add((choice.frame, choice.render))
    assert found == {(frame, render) for frame in (1, 2) for render in range(3)}


RIGHT = np.full((2, 2, 3), 0.25)


@pytest.mark.parametrize(
    ("made", "fault", "why"),
    [
        ([Result("ok", array=RIGHT)], None, None),
        ([Result("ok", array=RIGHT)], "off", f"{FALSE_FRAMES}frame 1 is wrong: off"),
        ([Result("ok", array=RIGHT)], f"{UNCHECKED}nobody", f"{UNCHECKED}nobody"),
        ([Result("ok", array=RIGHT + 1e-12)] * 2, None, f"{FALSE_FRAMES}frame 1 {cheats.OTHER}"),
        ([Result("ok", array=RIGHT + 1), Result("ok", array=RIGHT + 2)], None, f"{UNCHECKED}two processes make"),
        ([Result("failed", "no")], None, f"{UNCHECKED}the job of frame 1 alone: failed: no"),
    ],
)
def test_what_becomes_of_a_named_frame(made, fault, why):
    choice, jobs = frames.Choice(1, 0, (0.5, 0.25), places.checksum(RIGHT)), iter(made)
    parameters = Parameters(width=2, height=2, frames=2)

    def run(job):
        assert job == choice.job(parameters)
        return next(jobs)

    found = frames.verdict(choice, repeated(), parameters, run, lambda *_: fault)
    assert found is None if why is None else found.startswith(why), found


def test_what_is_never_checked():
    known = registry.entries()
    picture, hits = Parameters(frames=2), Parameters(kind="rays", frames=2)
    assert frames.unchecked(known["cpp"], picture) == frames.unchecked(known["naive"], Parameters(frames=0)) == ""
    assert frames.unchecked(known["numba-cuda"], picture).startswith(f"{UNCHECKED}the renderer keeps contract 1")
    assert frames.unchecked(known["cpp"], hits) == f"{UNCHECKED}first hits have no checksums"


HONEST = {
    "plain": {},
    "float32": {"precision": "float32"},
    "lanes": {"vector": "on"},
    "lanes32": {"vector": "on", "precision": "float32"},
    "jittered": {"sampler": "jittered", "samples": 2},
    "adaptive": {"sampler": "adaptive", "adaptive_depth": 1},
    "lens": {"lens_radius": 0.1, "focal_distance": 4.0},
    "soft": {"feelers": 2},
    "fast": {"floating_point": "fast"},
    "batch": {"least_frame": 5e-3},
}
CHECKED = tuple(
    name
    for name, entry in registry.entries().items()
    if entry.contract >= 2 and not (entry.unavailable or entry.variant.exhibit)
)


@pytest.mark.slow
@pytest.mark.parametrize("how", HONEST)
@pytest.mark.parametrize("variant", CHECKED)
def test_honest_renderers_are_not_accused(variant, how, tmp_path_factory):
    """Every later frame, and the last render of each, is that of its place, to the last byte."""
    entry, scene = registry.entries()[variant], text.read(cheats.SCENE.replace("0.6) 0", "0.6) 0.5"))
    parameters = Parameters(width=24, height=20, depth=2, shadows=True, frames=2, **HONEST[how])
    parameters = replace(parameters, threads=2 if entry.variant.threads == "all" else 1)
    job, cache = (entry, flatten(scene)), tmp_path_factory.getbasetemp() / f"honest-{variant}"
    result = repetition.run(*job, parameters, needs(scene, parameters), cache=cache)
    if result.status == "unsupported":
        pytest.skip(result.reason)
    assert result.status == "ok", result.reason
    assert how != "batch" or variant.startswith("python") or result.said.frames[1]["renders"] > 1
    for frame in result.said.frames[1:]:
        render = frame["renders"] - 1
        place = places.place(result.outcome.places.key, frame["index"], render, (0.5, 0.5))
        alone = frames.Choice(frame["index"], render, place, "").job(parameters)
        made = repetition.run(*job, alone, needs(scene, alone), cache=cache)
        assert frame["checksums"][8 * render : 8 * render + 8] == places.checksum(made.array)
        assert not np.array_equal(made.array, result.array)
