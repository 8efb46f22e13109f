"""Git repositories of tests."""

import subprocess


def git(folder, *words):
    """What git says in a folder; commits are by nobody."""
    who = "-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false"
    return subprocess.run(["git", "-C", folder, *who, *words], check=True, capture_output=True, text=True).stdout
