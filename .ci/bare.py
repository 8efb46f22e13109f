"""Makes a folder that, as PATH, is that of a machine with nothing but some packages of Debian and what these need.

python3 .ci/bare.py FOLDER PACKAGE...
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

NEEDED = "apt-cache depends --recurse --installed --no-recommends --no-suggests --no-conflicts --no-breaks"
NEEDED += " --no-replaces --no-enhances"


def lines(*command: str) -> list[str]:
    """Returns what the command prints, line by line."""
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()


def packages(names: list[str]) -> set[str]:
    """Returns `names`, what they need, and what every Debian has, as far as it is installed."""
    form = "${db:Status-Status} ${Package} ${Priority} ${Essential}\n"
    rows = [line.split() for line in lines("dpkg-query", "-W", "-f", form) if line.startswith("installed ")]
    everywhere = [name for _, name, *rest in rows if "required" in rest or "yes" in rest]
    return {name for _, name, *_ in rows} & set(lines(*NEEDED.split(), *names, *everywhere))


def programs(names: set[str]) -> set[str]:
    """Returns the programs of packages: their files without links."""
    files = [Path(line) for line in lines("dpkg", "-L", *sorted(names)) if line.startswith("/")]
    return {os.path.realpath(file) for file in files if file.parent.name in ("bin", "sbin")}


def main(folder: Path, *names: str) -> None:
    if not shutil.which("dpkg-query"):
        sys.exit("no dpkg-query here: .ci/run needs Debian, or a system like it, to tell which programs a package has")
    folder.mkdir()
    kept = programs(packages(list(names)))
    for place in os.environ["PATH"].split(os.pathsep):
        for name in os.listdir(place) if os.path.isdir(place) else ():
            program = Path(place) / name
            if os.path.realpath(program) in kept and os.access(program, os.X_OK) and not os.path.lexists(folder / name):
                (folder / name).symlink_to(program)
    # Python takes the folder of a link for its own. It may also be none of Debian's.
    python = folder / "python3"
    python.unlink(missing_ok=True)
    python.write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    python.chmod(0o755)


main(Path(sys.argv[1]), *sys.argv[2:])
