"""The real command line, for tests."""

import os

from forking import Commands

COMMANDS = Commands(os.environ)


def rayrace(*words, code=0, timeout=300):
    """Run it; the CompletedProcess. It must end with `code`, and may show no traceback."""
    done = COMMANDS.run(words, env=os.environ, timeout=timeout)
    assert done.returncode == code, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    return done
