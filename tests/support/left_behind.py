"""Marked folders as a process leaves them that is killed."""

import signal
import subprocess
import sys

MAKE = """
import os, pathlib, signal, sys
from harness.system import ownership
folder = pathlib.Path(sys.argv[1])
folder.mkdir(mode=0o700)
with ownership.marked(folder, sys.argv[2]):
    (folder / "files").mkdir()
    (folder / "files" / "a").write_text("left")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def left_behind(folder, name=""):
    """Make the folder in a process that is then killed; its path. name: as in ownership.marked."""
    assert subprocess.run([sys.executable, "-c", MAKE, str(folder), name]).returncode == -signal.SIGKILL
    return folder
