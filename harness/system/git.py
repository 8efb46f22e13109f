"""Asks git about the repository that a folder lies in, whatever repository the environment names."""

import os
import subprocess
from pathlib import Path

# Of git-rev-parse(1), --local-env-vars: with them git answers for another repository, as in a hook of one.
LOCAL = (
    *("GIT_DIR", "GIT_WORK_TREE", "GIT_COMMON_DIR", "GIT_INDEX_FILE", "GIT_OBJECT_DIRECTORY", "GIT_NAMESPACE"),
    *("GIT_ALTERNATE_OBJECT_DIRECTORIES", "GIT_PREFIX", "GIT_SHALLOW_FILE", "GIT_GRAFT_FILE", "GIT_CONFIG"),
    *("GIT_CONFIG_PARAMETERS", "GIT_CONFIG_COUNT", "GIT_NO_REPLACE_OBJECTS", "GIT_REPLACE_REF_BASE"),
    *("GIT_INTERNAL_SUPER_PREFIX", "GIT_IMPLICIT_WORK_TREE"),
)


class Distrusted(Exception):
    """Git does not answer, as another user owns the repository; the text says so, and what to do."""


def ask(folder: Path, *words: str) -> str | None:
    """Returns what git says in a folder; None if it fails, or is not there. Distrusted if it refuses to look."""
    command = ["git", "-C", str(folder), *words]
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=60, env=environment())
    except (OSError, subprocess.TimeoutExpired):
        return None
    if "dubious ownership" in done.stderr:
        place = done.stderr.partition("'")[2].partition("'")[0] or str(folder)
        remedy = f"git config --global --add safe.directory {place}"
        raise Distrusted(f"git does not trust {place}, which another user owns: {remedy}")
    return done.stdout.strip() if done.returncode == 0 else None


def environment() -> dict[str, str]:
    """The environment of this process, for a git that finds its repository itself and speaks English."""
    return {name: value for name, value in os.environ.items() if name not in LOCAL} | {"LC_ALL": "C"}
