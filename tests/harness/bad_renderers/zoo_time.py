"""Hangs, and lies about time."""

import json
import os
import signal
import time

from main import STARTED, background, flags, good, hang, npy, save, say, stubborn


def hang_in_good():
    good()
    hang()


def stop_itself():
    os.kill(os.getpid(), signal.SIGSTOP)
    hang()


def tell(*frames, render=None, renders=1):
    """Frames with the stamps given, in a phase that holds them; then the picture."""
    ends = [stamp for frame in frames for stamp in frame]
    for index, (start, end) in enumerate(frames):
        say("frame", index=index, start=start, end=end, renders=renders if index else 1)
    start, end = render or (min(ends), max(ends))
    say("phase", name="render", start=start, end=end)
    save(npy(background(), picture_shape()))
    say("output", file="image.npy")


def picture_shape():
    x0, y0, x1, y1 = map(int, flags["region"].split(","))
    return y1 - y0, x1 - x0, 3


def lie(*offsets, **more):
    """Frames at so many seconds after the start."""
    time.sleep(0.05)
    tell(*((STARTED + a, STARTED + b) for a, b in offsets), **more)


def little_of_it():
    time.sleep(0.3)
    now = time.monotonic()
    tell((now - 1e-4, now - 5e-5), (now - 5e-5, now), render=(STARTED, now))


MISDEEDS = {
    "zoo-hang": hang,
    "zoo-hang-done": hang_in_good,
    "zoo-deaf": stubborn,
    "zoo-stop": stop_itself,
    "zoo-time-before": lambda: lie((-10, -9), (-9, -8)),
    "zoo-time-after": lambda: lie((0.01, 0.02), (0.02, 100)),
    "zoo-time-negative": lambda: lie((0.02, 0.01), (0.02, 0.03)),
    "zoo-time-overlap": lambda: lie((0.0, 0.03), (0.01, 0.04)),
    "zoo-time-backwards": lambda: lie((0.03, 0.04), (0.01, 0.02)),
    "zoo-time-sum": lambda: lie((0.0, 5.0), (0.0, 5.0)),
    "zoo-time-epoch": lambda: tell((time.time(), time.time() + 0.01), (time.time() + 0.01, time.time() + 0.02)),
    "zoo-time-milliseconds": lambda: tell((STARTED * 1e3, STARTED * 1e3 + 5), (STARTED * 1e3 + 5, STARTED * 1e3 + 9)),
    "zoo-time-nan": lambda: lie((float("nan"), float("nan")), (0.0, 0.01)),
    "zoo-time-none": lambda: lie((0.01, 0.01), (0.01, 0.01)),
    "zoo-time-outside": lambda: lie((0.0, 0.01), (0.02, 0.03), render=(STARTED + 0.015, STARTED + 0.04)),
    "zoo-time-renders": lambda: lie((0.0, 0.01), (0.01, 0.04), renders=10**12),
    "zoo-time-little": little_of_it,
    "zoo-frames-many": lambda: good(frames=range(10000)),
    "zoo-phases-many": lambda: [say("phase", name="load", start=STARTED, end=STARTED) for _ in range(2000)] and good(),
    "zoo-words-many": lambda: good(extra=[json.dumps({"event": "versions", "all": "x" * 10**6})]),
}
