"""The real command line, for tests."""

import subprocess
import sys
from pathlib import Path


def rayrace(*words, code=0, timeout=300):
    """Run it; the CompletedProcess. It must end with `code`, and may show no traceback."""
    program = Path(sys.executable).with_name("rayrace")
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, timeout=timeout)
    assert done.returncode == code, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    return done
