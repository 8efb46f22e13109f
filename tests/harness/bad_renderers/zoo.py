"""Paints the background of a scene while it attacks the machine, the harness or the clock: the variant says how.

What multiplies or grows is bounded here too, should the harness fail to stop it.
"""

import json
import os
import resource

import zoo_disk
import zoo_files
import zoo_memory
import zoo_processes
import zoo_time
from main import FRAMES, flags, good


def clean():
    """Good, and says in what state it runs, which must not depend on who ran before."""
    limits = [resource.getrlimit(kind) for kind in (resource.RLIMIT_NOFILE, resource.RLIMIT_NPROC)]
    state = {"nice": os.nice(0), "cores": sorted(os.sched_getaffinity(0)), "limits": limits, "umask": os.umask(0o22)}
    good(extra=[json.dumps({"event": "versions", **state})])


MISDEEDS = {"zoo-good": clean}
for kind in (zoo_time, zoo_memory, zoo_disk, zoo_files, zoo_processes):
    MISDEEDS |= kind.MISDEEDS

if __name__ == "__main__":
    assert FRAMES == 2
    MISDEEDS[flags["variant"]]()
