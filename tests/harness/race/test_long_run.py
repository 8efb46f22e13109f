"""A long run leaks nothing in the harness: memory, file descriptors, processes, temporary files."""

import gc
import os
import shutil
import tempfile
from pathlib import Path

import psutil
import pytest

from harness.experiment import experiment as experiments
from harness.plan import plan
from harness.race import race
from harness.renderer import registry

C = Path(__file__).parents[1] / "c_renderer"
WARM = 30  # repetitions after which caches are filled
SIDE = 64  # a picture that is kept is 98 kB


@pytest.mark.parametrize(
    "count",
    [
        pytest.param(100, marks=pytest.mark.slow),
        pytest.param(2000, marks=pytest.mark.nightly("CI has 100 repetitions")),
    ],
)
@pytest.mark.skipif(not os.path.exists("/proc/self/fd"), reason="file descriptors are counted in Linux's /proc")
def test_nothing_leaks(count, experiment, tmp_path, monkeypatch):
    if not shutil.which("cc"):
        pytest.skip("no C compiler (apt install gcc)")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    known = registry.entries((C,))
    name = next(name for name, entry in known.items() if entry.renderer.folder == C)
    file = experiment([name], '[measure]\npair = "off"\n', processes=count, size=SIDE)
    asked = experiments.load(file)
    own, seen = psutil.Process(), []
    others = {process.pid for process in own.children(recursive=True)}  # a cluster of other tests

    def look(*_):
        if len(seen) in (WARM, count - 1):
            gc.collect()
        places = sum(1 for path in (tmp_path / "temporary").iterdir())
        children = sum(process.pid not in others for process in own.children(recursive=True))
        seen.append((own.memory_info().rss, own.num_fds(), children, places))

    records = race.run(asked, plan.make(asked, file, known), known, tmp_path / "run", tell=look)
    (rss, files, _, places), (last_rss, last_files, last_children, last_places) = seen[WARM], seen[-1]
    left = [path.name for path in (tmp_path / "temporary").iterdir()]
    each = (last_rss - rss) / (count - WARM)
    print(f"{len(records)} repetitions: {each / 1e3:.2f} kB of memory each, {last_files - files} more descriptors, "
          f"{last_children} processes left, {len(left)} temporary files left")  # fmt: skip
    assert len(records) == count and {record["status"] for record in records} == {"ok"}
    assert each < 60e3  # a row is some 10 kB; a picture would be 98
    assert last_files <= files and last_children == 0 and last_places <= places and left == []
