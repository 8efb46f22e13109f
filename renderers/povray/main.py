"""Runs one job with POV-Ray: translates it, starts `povray` once a frame, reads the picture back."""

import re
import subprocess
import sys
import threading
import time

from renderers import worker

from .export import FILE, require, write

PRECISIONS = ("float64",)  # of the geometry; NOTES.md lists exceptions
PICTURE = "picture.exr"
TICK = 0.02  # s between looks at POV-Ray's peak memory
STARTS = 5  # of one frame: POV-Ray gives up if a thread of its own is not there in 3 s, as on a busy machine
TOO_SLOW = "Timed out waiting for worker thread startup"  # nothing has been read or traced by then


def main():
    job = worker.Job(sys.argv[1:])
    require(job)
    if job.precision not in PRECISIONS:
        worker.refuse(f'no precision "{job.precision}": ' + " or ".join(PRECISIONS))
    with worker.importing():
        import numpy as np

        from . import exr
        from .scene import flags, samples
    write(job)
    words = [*flags(job), f"+WT{job.threads}", "+FE", "-D", "-P", f"+I{FILE}", f"+O{PICTURE}"]
    with worker.phase("render"):
        peaks = []
        for index in range(job.frames + 1):
            start, said = run(words, job.out, peaks)
            end, traced = time.monotonic(), trace_time(said)
            worker.say("frame", index=index, start=start, end=end, parts=None if traced is None else {"trace": traced})
    with worker.phase("save"):
        picture = exr.read(job.output(PICTURE))
        n = samples(job)
        x0, y0, x1, y1 = job.region
        blocks = picture[y0 * n : y1 * n, x0 * n : x1 * n].reshape(y1 - y0, n, x1 - x0, n, 3)
        np.save(job.output("image.npy"), blocks.mean(axis=(1, 3), dtype=np.float64))  # SAM-3
    peak = max(peaks, default=None)
    worker.say("memory", peak_bytes=peak, render_peak_bytes=peak, method="VmHWM of povray, read every 20 ms")
    worker.say("output", file="image.npy")
    worker.say("used", features=job.needs, methods={"precision": job.precision, "threads": job.threads})
    worker.say_python_versions(numpy=np.__version__, povray=version(said), povray_flags=" ".join(words))
    sys.stderr.write(said)  # its own statistics, for people


def run(words, folder, peaks):
    """Renders one frame. Exits with POV-Ray's reason if it fails.

    Returns when the process started that rendered it, by the monotonic clock, and its output. Adds its peak memory in
    bytes to `peaks`.
    """
    for _ in range(STARTS):
        start = time.monotonic()
        status, said = _start(words, folder, peaks)
        if not status:
            return start, said
        if TOO_SLOW not in said:
            break
    found = re.search(r"\b\w+ [Ee]rror\b.*(?:\n .*)?", said)
    last = said.strip().rpartition("\n")[2]
    reason = found[0] if found else f"exit status {status}: {last or 'it says nothing'}"
    worker.say("error", reason=f"povray: {' '.join(reason.split())}")
    sys.stderr.write(said)
    sys.exit(1)


def _start(words, folder, peaks):
    """Returns the exit status and the output of one process."""
    process = subprocess.Popen(
        ["povray", *words], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )
    over = threading.Event()
    watcher = threading.Thread(target=watch, args=(process.pid, over, peaks))
    watcher.start()
    said = process.communicate()[1].decode("utf-8", errors="replace")
    over.set()
    watcher.join()
    return process.returncode, said


def watch(pid, over, peaks):
    """Reads the peak repeatedly, since it disappears with the process."""
    peak = 0
    while not over.is_set():
        try:
            with open(f"/proc/{pid}/status", encoding="ascii", errors="replace") as status:
                found = re.search(r"VmHWM:\s*(\d+) kB", status.read())
        except OSError:  # no such system, or the process has ended
            break
        peak = max(peak, int(found[1]) * 1024) if found else peak
        over.wait(TICK)
    if peak:
        peaks.append(peak)


def trace_time(said):
    """Returns the seconds in which POV-Ray traced, by its own clock; None if it does not tell."""
    found = re.search(r"Trace Time:.*\(([\d.]+) seconds\)", said)
    return float(found[1]) if found else None


def version(said):
    found = re.search(r"POV-Ray (?:[Vv]ersion )?([\d.]+\S*)", said)
    return found[1] if found else "unavailable: it does not tell"


if __name__ == "__main__":
    main()
