"""The zoo: renderers that misbehave, and the row that each must become. What they do: bad_renderers/zoo*.py."""

import shutil
from pathlib import Path

PROGRAMS = Path(__file__).parents[1] / "harness" / "bad_renderers"
TIMEOUT = 2.0  # s, for those that would go on for ever
AMPLE = 60.0  # s, for the others: they end by themselves or are ended for a limit, late where other tests run too
LIMITS = {"memory": "300 MB", "disk": "4 MB", "output": "2 MB", "processes": 60}
GOOD = "zoo-good"
PATIENT = ("zoo-stop-launcher",)  # takes process.STUCK longer than its time

_LATE, _CONTRACT, _OUTSIDE = "killed after ", "is no event of the contract", "outside the life of the process"
_NO_FILE, _MANY = 'returned no file "image.npy"', " processes at once, the limit is 60"
_DISK, _OUTPUT = " to disk, the limit is 4 MB", "MB, the limit is 2 MB"

# Variant: status of its row (or what it may be), part of the reason; of a good one, its warnings or why it is unranked.
ZOO = {
    "zoo-hang": ("timeout", _LATE),
    "zoo-hang-done": ("timeout", _LATE),
    "zoo-deaf": ("timeout", _LATE),
    "zoo-stop": ("timeout", ", in which it was stopped by a signal"),
    "zoo-time-before": ("failed", _OUTSIDE),
    "zoo-time-after": ("failed", _OUTSIDE),
    "zoo-time-negative": ("failed", _CONTRACT),
    "zoo-time-overlap": ("failed", "before the end of the one that was said first"),
    "zoo-time-backwards": ("failed", "before the end of the one that was said first"),
    "zoo-time-sum": ("failed", _OUTSIDE),
    "zoo-time-epoch": ("failed", _OUTSIDE),
    "zoo-time-milliseconds": ("failed", _OUTSIDE),
    "zoo-time-nan": ("failed", _CONTRACT),
    "zoo-time-none": ("failed", "frame 0 is too short for 1 renders"),
    "zoo-time-outside": ("failed", "frame 0 lies outside the phase render"),
    "zoo-time-renders": ("failed", "frame 1 is too short for 1000000000000 renders"),
    "zoo-time-little": ("ok", "its marks contradict its phases: its frames cover 0.0001 s of "),
    "zoo-frames-many": ("failed", "reported frames [0, 1, 2, 3"),
    "zoo-phases-many": ("failed", _CONTRACT),
    "zoo-words-many": ("failed", _CONTRACT),
    "zoo-memory": ("killed", " of memory, the limit is 300 MB"),
    "zoo-memory-children": ("killed", " of memory, the limit is 300 MB"),
    "zoo-memory-file": ("killed", " of memory, the limit is 300 MB"),
    "zoo-memory-files": ("killed", " of memory, the limit is 300 MB"),
    "zoo-memory-shared": ("ok", ""),
    "zoo-memory-spike": ("killed failed", " of memory, the limit is 300 MB"),
    "zoo-disk-out": ("failed", _DISK),
    "zoo-disk-cache": ("failed", _DISK),
    "zoo-disk-temporary": ("failed", _DISK),
    "zoo-disk-folder": ("failed", _DISK),
    "zoo-disk-file": ("failed", "File too large"),
    "zoo-disk-signal": ("failed", "wrote a file that is larger than the limit of disk"),
    "zoo-disk-million": ("failed", _DISK),
    "zoo-disk-nested": ("ok", ""),
    "zoo-disk-forbidden": ("ok", ""),
    "zoo-disk-left": ("ok", ""),
    "zoo-output": ("failed", _OUTPUT),
    "zoo-output-error": ("failed", _OUTPUT),
    "zoo-output-line": ("failed", _OUTPUT),
    "zoo-output-grown": ("failed", "printed 3 MB, the limit is 2 MB"),
    "zoo-output-closed": ("failed", "reported frames []"),
    "zoo-output-silent": ("timeout", _LATE),
    "zoo-job-changed": ("failed", "changed its job: background.npy"),
    "zoo-job-backdated": ("failed", "changed its job: background.npy"),
    "zoo-job-parameters": ("failed", "changed its job: job.json"),
    "zoo-job-added": ("failed", "changed its job: more.npy"),
    "zoo-job-removed": ("failed", "changed its job: air.npy, ambient.npy"),
    "zoo-stdout-removed": ("failed", "removed or replaced the file of its stdout"),
    "zoo-stdout-pipe": ("failed", "removed or replaced the file of its stdout"),
    "zoo-stderr-folder": ("failed", "removed or replaced the file of its stderr"),
    "zoo-all-removed": ("failed", "removed or replaced the file of its stdout"),
    "zoo-all-link": ("failed", "removed or replaced the file of its stdout"),
    "zoo-picture-none": ("failed", "printed no output event"),
    "zoo-picture-pipe": ("failed", _NO_FILE),
    "zoo-picture-link": ("failed", _NO_FILE),
    "zoo-picture-folder": ("failed", _NO_FILE),
    "zoo-picture-device": ("failed", _NO_FILE),
    "zoo-picture-claim": ("failed", "is no array"),
    "zoo-out-closed": ("ok failed", _NO_FILE),  # root may read it
    "zoo-out-removed": ("failed", _NO_FILE),
    "zoo-out-link": ("failed", _NO_FILE),
    "zoo-child": ("ok", ""),
    "zoo-child-orphan": ("ok", ""),
    "zoo-child-session": ("ok", ""),
    "zoo-child-daemon": ("ok", ""),
    "zoo-child-stopped": ("ok", ""),
    "zoo-child-many": ("ok", ""),
    "zoo-fork-exit": ("failed", "reported frames []"),
    "zoo-bomb": ("failed", _MANY),
    "zoo-bomb-sessions": ("failed", _MANY),
    "zoo-bomb-rolling": ("failed", _MANY),
    "zoo-kill-launcher": ("failed", "the launcher died"),
    "zoo-kill-group": ("killed", "by SIGKILL"),
    "zoo-kill-measurer": ("failed", "its measurer was killed by SIGKILL"),
    "zoo-stop-launcher": ("timeout", _LATE),
    "zoo-false-launcher": ("failed", "the launcher died"),
    "zoo-core": ("failed", "ended by SIGABRT"),
    "zoo-lowered": ("ok", ""),
}


def timeout(variant: str) -> float:
    """In s."""
    return TIMEOUT if ZOO.get(variant, "")[:1] == ("timeout",) else AMPLE


def wrong(variant: str, record: dict) -> str | None:
    """None, or what of the row is not as it must be."""
    statuses, part = ZOO[variant]
    good = record["status"] == "ok"
    told = "\n".join([*record["warnings"], record["unranked"] or ""]) if good else record["reason"]
    if record["status"] not in statuses.split() or bool(record["reason"]) == good or len(record["reason"]) > 1000:
        return f"{record['status']}: {record['reason']}"
    if part not in told and not (good and statuses != "ok"):
        return told
    return None


def folder(place: Path) -> Path:
    """A new renderer of all that is in the zoo, and of the good one."""
    place.mkdir()
    for file in PROGRAMS.glob("*.py"):
        shutil.copy(file, place)
    tables = [
        f'[[variant]]\nname = "{name}"\ncommand = ["{{python}}", "-S", "{{folder}}/zoo.py"]\n' for name in (GOOD, *ZOO)
    ]
    head = f'contract = 1\nname = "{place.name}"\ntechnology = "Python, misused"\ndescription = "a zoo"\n'
    (place / "renderer.toml").write_text(head + 'features = ["region"]\n' + "".join(tables))
    return place


def running(mark: str) -> list[int]:
    """Processes that live with `mark` in their environment."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            state = (place / "stat").read_text().rpartition(")")[2].split()[0]
            if state not in "ZX" and mark.encode() in (place / "environ").read_bytes():
                found.append(int(place.name))
        except OSError:
            continue
    return found
