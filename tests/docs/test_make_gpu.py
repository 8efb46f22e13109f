"""`make gpu` with a rayrace that only notes what it is called with: order, time, and how it goes on."""

import re
import subprocess
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
NOTING = """#!/bin/sh
echo "$*" >> {log}
case "$1 $2" in "check renderers/numba") exit 1 ;; esac
while [ $# -gt 0 ]; do case "$1" in --out) mkdir -p "$2" ;; -o) : > "$2" ;; esac; shift; done
"""


@pytest.fixture
def make(tmp_path):
    """make(): what rayrace is called with, and the names of the packed runs."""
    log = tmp_path / "log"
    for name, text in {"rayrace": NOTING.format(log=log), "pip": "#!/bin/sh\n"}.items():
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)

    def run():
        log.write_text("")
        words = [f"BIN={tmp_path}", f"GPU={tmp_path}/gpu", f"PACKED={tmp_path}/packed", "MACHINE=test"]
        command = ["make", "--no-print-directory", "-o", ".venv/installed", "gpu", *words]
        done = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert "left: rayrace check renderers/numba" in done.stdout
        assert "left: rayrace check renderers/opencl" not in done.stdout
        return log.read_text().splitlines(), {path.name for path in (tmp_path / "packed").iterdir()}

    return run


def test_it_goes_on_where_it_ended_within_25_minutes(make):
    calls, kept = make()
    assert calls[:3] == ["doctor", "check renderers/opencl", "check renderers/numba"]
    runs = [call for call in calls if call.startswith("run ")]
    files = [REPOSITORY / call.split()[1] for call in runs]
    assert {"gpu.toml", "launch-blocks.toml"} < {file.name for file in files} and all(file.is_file() for file in files)
    minutes = [float(re.search(r"--max-minutes (\S+)", call)[1]) for call in runs]
    assert sum(minutes) + 2 * 2 + 3 <= 25 and all("--out" in call for call in runs)
    packed = [call for call in calls if call.startswith("export ")]
    assert len(packed) == len(runs) and all("--format packed" in call for call in packed)
    assert kept == {f"{file.stem}.tar.xz" for file in files}
    again, _ = make()
    assert "check renderers/opencl" not in again and "check renderers/numba" in again
    assert [call for call in again if call.startswith("run ")] == [call.replace("--out", "--resume") for call in runs]
