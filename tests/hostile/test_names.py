"""Names of files that steer a terminal, a page or a shell, or are no Unicode: every command works with them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

RAYRACE = Path(sys.executable).with_name("rayrace")
EXPERIMENT = 'title="t"\nscenes=["a.txt"]\nrenderers=["python"]\nprocesses=1\nframes=1\n[image]\nwidth=6\nheight=5\n'
SCENE = "CAMERA (0,0,1) (1,0,0) (0,1,0) (0,0,3)\nSPHERE (0,0,-1) 1 (1,0.5,0.2) 0.3 9 (0,0,0) 1.5 1\n"
NAMES = [
    os.fsdecode(b"no \xff Unicode"),
    "line\nof <script>alert(1)<_script> \x1b[2J",
    "é \u2028 😀 \"q\" 'q' %s {x} $HOME & #a?b=c [bold]b[_bold]",
    "-rf",
]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES, ids=ascii)
def test_every_command(name, tmp_path):
    def rayrace(*words, code=0):
        # as in most languages; in that of C, Python prints any bytes
        strict = {**os.environ, "PYTHONIOENCODING": "utf-8:strict"}
        done = subprocess.run([RAYRACE, *words], cwd=tmp_path, env=strict, capture_output=True, timeout=120)
        said = done.stdout + done.stderr
        assert done.returncode == code, said
        assert b"Traceback" not in said, said
        return said

    (tmp_path / "a.txt").write_text(SCENE)
    (tmp_path / f"{name}.txt").write_text(SCENE)
    (tmp_path / f"{name}.toml").write_text(EXPERIMENT)
    (tmp_path / f"{name}.csv").write_text("ox,oy,oz,dx,dy,dz\n0.1,0.2,9,0,0,-1\n")
    run, made = f"./{name}", f"./made {name}"
    rayrace("run", f"./{name}.toml", "--out", run, "--report")
    rayrace("run", f"./{name}.toml", "--resume", run)
    rayrace("status", run)
    assert b"the same data" in rayrace("report", run, "--check")
    for form, ending in (("github", "json"), ("parquet", "parquet"), ("packed", "tar.xz")):
        rayrace("export", run, "--format", form, "-o", f"{made}.{ending}")
    rayrace("compare", run, f"{made}.tar.xz")
    rayrace("report", run, f"{made}.tar.xz", "-o", made)
    for more in (["-o", f"{made}.png"], ["-o", f"{made}.tif"]):
        rayrace("render", f"./{name}.txt", "-r", "python", "--width", "6", "--height", "5", *more)
    rayrace("trace", f"./{name}.txt", f"./{name}.csv", "-r", "python")
    for kind in ("report", "status"):
        assert b"not a run" in rayrace(kind, f"./other {name}", code=2)
