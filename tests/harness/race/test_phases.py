"""The phases that a renderer says cover its life, and what the harness makes of them."""

import statistics

import pytest
from nightly import by_night

from harness.process import repetition
from harness.race import row
from harness.renderer import registry
from harness.renderer.events import Said
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.generate.comparison import comparison
from harness.scene.needs import needs

pytestmark = pytest.mark.alone


NAMES = [name for name, entry in registry.entries().items() if not entry.variant.exhibit]
THREADED = {"numba-parallel", "cpp-threads", "povray-threads", "python-processes", "python-threads"} & set(NAMES)


@pytest.mark.parametrize("name", by_night(NAMES, *THREADED))
def test_phases_sum_to_the_wall_time(name, known, tmp_path):
    """The median of three processes: a pause between two phases may be the machine's."""
    entry = known[name]
    if entry.unavailable:
        pytest.skip(entry.unavailable)
    scene = text.read(comparison(12, 2))
    size = 8 if entry.simulated else 48 if name.startswith("python") else 192
    parameters = Parameters(width=size, height=size, depth=3, frames=1, threads=entry.threads())
    sums = []
    for number in range(3):
        result = repetition.run(entry, flatten(scene), parameters, needs(scene, parameters), cache=tmp_path / "cache")
        if result.status == "unsupported":
            pytest.skip(result.reason)
        assert result.status == "ok", result.reason
        made = row.measured(result, tmp_path / f"{number}.csv")
        phases, wall = made["phases"], made["wall_s"]
        marks = [phases[0][1], *(end for _, _, end in phases)]
        assert marks[0] == 0 and marks[-1] == pytest.approx(wall) and marks == sorted(marks)
        assert (phases[0][0], phases[-1][0]) == ("start", "exit")
        render = next(end - start for phase, start, end in phases if phase == "render")
        assert sum(made["frames_s"]) <= render + 1e-3
        sums.append(sum(end - start for _, start, end in phases) / wall)
        assert (abs(sums[-1] - 1) > 0.02) == any("uncovered" in warning for warning in made["warnings"])
    print(sums)
    assert abs(statistics.median(sums) - 1) <= 0.02


def test_cover_by_hand():
    said = Said(phases=[{"name": "load", "start": 10.5, "end": 11}, {"name": "render", "start": 11.25, "end": 13}])
    assert row.cover(said, 10, 14) == [["start", 0, 0.5], ["load", 0.5, 1], ["render", 1.25, 3], ["exit", 3, 4]]
    assert row.cover(Said(), 10, 14) == [["start", 0.0, 4]]


def test_times_are_of_one_render(known, tmp_path):
    entry = known["python"]
    scene = text.read(comparison(1, 1))
    parameters = Parameters(width=2, height=2, frames=2, least_frame=5e-3)
    result = repetition.run(entry, flatten(scene), parameters, needs(scene, parameters))
    assert result.status == "ok", result.reason
    made = row.measured(result, tmp_path / "no.csv")
    first, *later = made["frame_renders"]
    assert first == 1 < later[0] == later[1]
    for seconds, renders, frame in zip(made["frames_s"], made["frame_renders"], result.said.frames, strict=True):
        assert seconds * renders == pytest.approx(frame["end"] - frame["start"])
