"""Times that cannot be: what the marks, the phases and the processor contradict is found, and nothing else is."""

from dataclasses import replace

import liars
import numpy as np
import pytest

from harness.process import measurer, process, repetition
from harness.process.dialog import Answer
from harness.process.repetition import Result
from harness.race import contradiction
from harness.renderer import registry
from harness.renderer.events import Said
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.system import trouble

SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"
MARKS = "its marks contradict "
ARRAYS = flatten(text.read(SCENE))


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    return registry.entries((liars.folder(tmp_path_factory.mktemp("liars") / "liars", *liars.HONEST, *liars.LIES),))


@pytest.fixture
def found(known, tmp_path):
    """found(variant) is what a repetition of it contradicts."""

    def run(variant, **more):
        entry, series = known[f"liar-{variant}"], tmp_path / "series.csv"
        threads = 2 if entry.variant.threads == "all" else 1
        wanted = Parameters(width=32, height=32, frames=2, threads=threads, **more)
        before = trouble.look()
        result = repetition.run(entry, ARRAYS, wanted, (), series=series)
        assert result.status == "ok", result.reason
        # Other programs may run meanwhile: honest renderers wait for a core, and those that lie do so all the same.
        disturbed = trouble.between(before, trouble.look()) if variant in liars.HONEST else None
        told = contradiction.reason(
            result,
            series,
            entry,
            wanted,
            contradiction.Blanks(),
            lambda one: repetition.run(entry, ARRAYS, one, ()),
            disturbed=disturbed,
        )
        print(variant, told)
        return told

    return run


@pytest.mark.alone
@pytest.mark.parametrize("variant", liars.LIES)
def test_false(variant, found):
    assert found(variant).startswith("its marks contradict " + liars.LIES[variant])


@pytest.mark.alone
@pytest.mark.parametrize("variant", liars.HONEST)
def test_true(variant, found):
    assert found(variant) is None
    assert variant != "batches" or found(variant, least_frame=0.02) is None


def made_up(frames, phases, cpu=0.0, exited=None, readings=(), renders=1, resolution=0.02):
    """A Result by stamps, and the text of its series, by readings of time and CPU time."""
    told = [
        {"index": index, "start": start, "end": end, "parts": None, "renders": renders if index else 1}
        for index, (start, end) in enumerate(frames)
    ]
    phases = [{"name": name, "start": start, "end": end} for name, start, end in phases]
    exited = phases[-1]["end"] if exited is None else exited
    outcome = process.Outcome(
        failed=None, spawned=0.0, exited=exited, code=0, signal=None, timed_out=False, user_s=cpu, system_s=0.0,
        wait4_peak_bytes=0, wait4_floor_bytes=0, measurer={"resolution_s": resolution},
    )  # fmt: skip
    lines = [",".join(measurer.COLUMNS[:2]), *(f"{t},{used}" for t, used in readings)]
    return Result("ok", "", outcome, Said(phases=phases, frames=told)), "\n".join(lines) + "\n"


@pytest.fixture
def marks(tmp_path):
    def read(*what, threads=1, least_frame=0.0, lost=0.0, **more):
        result, lines = made_up(*what, **more)
        (tmp_path / "series.csv").write_text(lines)
        return contradiction.marks(result, tmp_path / "series.csv", threads, least_frame, lost)

    return read


def test_frames_and_their_phase_by_hand(marks):
    phases = [("load", 0, 1), ("render", 1, 3)]
    assert marks([(1, 2), (2, 3)], phases) is None
    assert marks([(1, 2), (2, 2.85)], phases) is None
    assert marks([(1, 1.5), (2.1, 3)], phases) == f"{MARKS}its phases: its frames cover 1.4 s of 2 s of phase render"


def test_the_later_frames_are_looked_at_alone(marks):
    told = marks([(0, 9), (9.2, 9.201), (9.4, 9.401), (9.6, 9.601)], [("render", 0, 9.601)])
    assert told == f"{MARKS}its phases: its frames after the first cover 0.003 s of 0.601 s of phase render"


def test_a_machine_that_others_use_tells_less(marks):
    """A renderer that waits for a core between its frames has done nothing there."""
    gap = [(0, 0.001), (0.4, 0.401)], [("render", 0, 0.402)]
    assert marks(*gap) is not None
    assert marks(*gap, lost=0.29) is not None and marks(*gap, lost=0.31) is None


def test_what_is_short_is_not_told(marks):
    assert marks([(0, 1e-6), (0.099, 0.0990001)], [("render", 0, 0.0995)]) is None
    assert marks([(0, 1e-6), (0.101, 0.1010001)], [("render", 0, 0.1015)]) is not None


def test_a_search_for_batches_is_no_contradiction(marks):
    """It is found between the first two frames, of what would be too short; other programs may make it longer."""
    for searched, batch, renders, least_frame, is_one in (
        *((0.14, 0.02, 64, 0.02, True), (0.14, 0.02, 1, 0.02, True), (0.14, 0.02, 1, 0.0, False)),
        *((0.23, 0.001, 64, 0.001, True), (0.4, 0.001, 64, 0.001, False), (2.0, 0.3, 64, 0.3, True)),
    ):
        frames = [(0, 0.001), (0.001 + searched, 0.001 + searched + batch)]
        told = marks(frames, [("render", 0, frames[1][1])], renders=renders, least_frame=least_frame)
        assert (told is None) == is_one, (searched, batch, renders)
    after = [(0, 0.001), (0.001, 0.021), (0.161, 0.181)]
    assert marks(after, [("render", 0, 0.181)], renders=64, least_frame=0.02) is not None


def readings(rate, until=4.0):
    return [(0.05 * tick, rate * 0.05 * tick) for tick in range(round(until / 0.05) + 1)]


def test_processors_and_threads(marks):
    frames, phases = [(1, 2), (2, 3)], [("load", 0, 1), ("render", 1, 3), ("save", 3, 4)]
    for rate, threads in ((0.01, 1), (1, 1), (1, 4), (2, 2), (3.9, 4)):  # the first as if a GPU did it
        assert marks(frames, phases, readings=readings(rate), threads=threads) is None
    told = marks(frames, phases, readings=readings(1.5))
    assert told.startswith(f"{MARKS}the processor: its frames cover 2 s of phase render, which used 2.") and (
        told.endswith(" s of CPU time on 1 thread")
    )
    assert marks(frames, phases, readings=readings(1.5), threads=None) is None
    assert marks(frames, phases) is None  # there is no series


def test_a_reading_counts_from_when_it_has_been_made():
    """The last but one is stamped before the end, and made after it."""
    rows = [{"t": "0.9", "cpu_s": "0"}, {"t": "1.0", "cpu_s": "1"}, {"t": "1.5", "cpu_s": "2"}]
    rows += [{"t": "1.9", "cpu_s": "9"}, {"t": "2.1", "cpu_s": "9"}]
    assert contradiction._cpu_within(rows, 1.0, 2.0) == 1.0


def test_phases_that_cover_little(marks):
    told = marks([(0.1, 0.2)], [("load", 0, 0.1), ("render", 0.1, 0.2), ("save", 2, 2.1)])
    assert told == f"{MARKS}the clock: its phases cover 0.3 s of its life of 2.1 s"


def test_no_phase_render(marks):
    assert marks([(0, 1)], [("load", 0, 1)]).startswith(f"{MARKS}its phases: it has 1 frames and no phase render")


@pytest.mark.parametrize(
    ("cpu", "blanks", "contradicted"),
    [
        (2.05, [], False),  # so little more than the frames that no blank is asked for
        (3.0, [0.8], False),
        (3.0, [0.4], True),
        (3.0, [0.4, 0.8], False),  # the machine is slower than when the first was run
    ],
)
def test_blanks(cpu, blanks, contradicted):
    frames, phases = [(0, 1), (1, 2)], [("render", 0, 2)]
    result, _ = made_up(frames, phases, cpu=cpu)
    parameters, known = Parameters(width=32, height=32, frames=1), contradiction.Blanks()
    made = [made_up([(0, 0)], [("render", 0, 0)], cpu=blank)[0] for blank in blanks]
    told = None
    while made:
        told = known.contradiction("key", result, parameters, lambda: made.pop(0))
    assert bool(told) == contradicted
    if not blanks:
        assert known.contradiction("key", result, parameters, lambda: pytest.fail("it was asked for")) is None


def test_a_blank_that_fails_says_nothing():
    result, _ = made_up([(0, 1), (1, 2)], [("render", 0, 2)], cpu=9.0)
    failed = Result("failed", "no")
    assert contradiction.Blanks().contradiction("", result, Parameters(frames=1), lambda: failed) is None


def test_a_first_frame_counts_as_ten_others():
    wanted = Parameters(width=1, height=1, frames=2)
    for first, explained in ((0.5, 0.7), (1.0, 1.2), (3.0, 1.2)):
        frames = [(0, first), (first, first + 0.1), (first + 0.1, first + 0.2)]
        result, _ = made_up(frames, [("render", 0, first + 0.2)], cpu=5.0)
        assert contradiction.unframed_cpu(result, wanted) == pytest.approx(5.0 - explained)


@pytest.mark.parametrize("region", [None, (100, 50, 500, 450), (5, 6, 6, 7)])
def test_a_blank_is_smaller_at_random(region):
    """No renderer can tell it from other jobs, as from a single pixel or one frame."""
    whole = Parameters(width=640, height=480, frames=5, least_frame=1e-3, depth=3, region=region)
    found = {contradiction.blank(whole) for _ in range(50)}
    for one in found:
        (height, width, _), (high, wide, _) = one.shape(), whole.shape()
        for side, longer in ((width, wide), (height, high)):
            assert side == 1 or longer / 10.1 - 1 < side < longer / 5.9 + 1
        x0, y0, x1, y1 = one.bounds()
        assert region is None or (region[0] <= x0 < x1 <= region[2] and region[1] <= y0 < y1 <= region[3])
        assert (one.depth, one.least_frame) == (3, 1e-3) and one.frames in range(4)
    assert len({one.frames for one in found}) > 1 and (region == (5, 6, 6, 7) or len(found) > 20)


def test_a_frame_is_not_shorter_than_writing_it(monkeypatch):
    """By memset(3) of two threads, which may be three times as quick at other times."""
    monkeypatch.setattr(contradiction.bandwidth, "write_s", lambda size: size * 1e-9)
    result, _ = made_up([(0, 1), (1, 1.1), (1.1, 1.1 + 3e-6)], [("render", 0, 2)])
    result.array = np.zeros((40, 30, 3))  # 28.8 kB: 4.8 us at the least
    told = contradiction.written(result, 2)
    assert told.startswith(f"{MARKS}the memory: frame 2 took 3e-06 s, in which nobody writes its 28.8 kB here")
    result.array = np.zeros((20, 30, 3), np.float32)
    assert contradiction.written(result, 2) is None


def talked(frames, given, end, **more):
    """A Result of contract 2, whose renderer was told the places of its later frames at `given`."""
    result, lines = made_up(frames, [("render", 0, end)], **more)
    result.outcome = replace(result.outcome, places=Answer(given, (0, 0), []))
    result.array = np.zeros((4, 4, 3))
    return result, lines


def test_what_lies_before_the_answer_is_no_frame(tmp_path):
    """A renderer searches for the size of a batch, and waits: for its later frames it can do nothing yet."""
    series = tmp_path / "series.csv"
    for begin, why in ((2.0, None), (2.05, None), (2.3, f"{MARKS}its phases: its frames")):
        result, lines = talked([(0, 0.1), (begin, begin + 0.4), (begin + 0.4, begin + 0.8)], 2.0, begin + 0.8)
        series.write_text(lines)
        told = contradiction.marks(result, series, 1)
        assert told is None if why is None else told.startswith(why), told


@pytest.mark.parametrize(
    ("pauses", "told"),
    [
        ((0, 0.02, 0), False),
        ((0.02, 0, 0.02), False),
        ((0.02, 0.02, 0), True),  # before each frame
        ((0, 0.02, 0.02), True),  # after each
        ((0.02, 0.02), False),  # of one frame
    ],
)
def test_pauses_of_more_than_a_checksum(tmp_path, pauses, told):
    frames, at = [(0, 0.5)], 0.6
    for pause in pauses[:-1]:
        frames.append((at + pause, at + pause + 0.5))
        at += pause + 0.5
    result, lines = talked(frames, 0.6, at + pauses[-1])
    (tmp_path / "series.csv").write_text(lines)
    found = contradiction.marks(result, tmp_path / "series.csv", 1)
    assert bool(found) == told
    assert not told or found.startswith(f"{MARKS}its phases: it pauses for 0.02 s or more at each later frame")
    assert contradiction.marks(result, tmp_path / "series.csv", 1, lost=0.045) is None


@pytest.mark.alone
def test_a_run_and_its_report(rayrace, rows, tmp_path):
    """The picture is right and the row is ok; the first place goes to who tells the time."""
    (tmp_path / "scene.txt").write_text(SCENE)
    (tmp_path / "e.toml").write_text(
        'title = "t"\nscenes = ["scene.txt"]\nrenderers = ["liar-load", "liar-true"]\nprocesses = 1\nframes = 1\n'
        "[image]\nwidth = 32\nheight = 32\ndepth = 0\n"
    )
    folder = liars.folder(tmp_path / "liars", "load", "true")
    done = rayrace("run", tmp_path / "e.toml", "--renderer", folder, "--out", tmp_path / "run", code=0)
    told = rows(tmp_path / "run")
    assert {row["status"] for mine in told.values() for row in mine} == {"ok"}
    assert told["liar-true"][0]["unranked"] is None
    why = told["liar-load"][0]["unranked"]
    assert why.startswith(f"{MARKS}the processor: ") and f"liar-load: unranked: {why}" in done.stdout
    rayrace("report", tmp_path / "run", "-o", tmp_path / "report", code=0)
    summary = (tmp_path / "report" / "report.md").read_text("utf-8").partition("## Summary")[2].partition("\n## ")[0]
    assert "only liar-true is ranked" in summary and f"- liar-load: {why}" in summary
