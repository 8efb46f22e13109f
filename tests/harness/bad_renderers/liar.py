"""Takes SECONDS of a processor to render 32 x 32 pixels, and says when: truly, or falsely. The variant says how.

The work is real, and is that of a renderer in one thing: it grows with the pixels. Standard library only.
"""

import hashlib
import os
import time
from threading import Thread

from main import BATCHES, FRAMES, GOOD_RAYS, HEIGHT, STARTED, WIDTH, background, fail, flags, npy, save, say

SECONDS = 0.25
OFTEN = SECONDS * WIDTH * HEIGHT / 32**2
now = time.monotonic


def work(seconds=OFTEN):
    """Uses so many seconds of one processor, however long that takes; other threads may run meanwhile."""
    until = time.thread_time() + seconds
    while time.thread_time() < until:
        hashlib.pbkdf2_hmac("sha256", b"", b"", 300)


def together(threads):
    workers = [Thread(target=work, args=(OFTEN / 2,)) for _ in range(threads)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()


class Said:
    """Phases and frames, one after the other."""

    def __init__(self):
        self.last, self.index = STARTED, 0

    def phase(self, name):
        self.last, start = now(), self.last
        say("phase", name=name, start=start, end=self.last)

    def frame(self, do=lambda: None, renders=1):
        start = now()
        for _ in range(renders):
            do()
        end = max(now(), start + 1e-6)
        while now() < end:
            pass
        say("frame", index=self.index, start=start, end=end, renders=renders)
        self.index += 1

    def end(self, render=True):
        if render:
            self.phase("render")
        save(npy(background(), (HEIGHT, WIDTH, 3)))


def frames(said, do=lambda: None, between=lambda: None):
    for _ in range(FRAMES):
        between()
        said.frame(do)


# What is right.


def true(said):
    frames(said, work)
    said.end()


def idle(said):
    """As one that waits for its GPU."""
    frames(said, lambda: time.sleep(OFTEN))
    said.end()


def compiled(said):
    work(0.3)
    said.phase("import")
    work(0.3)
    said.phase("compile")
    work(0.2)
    said.phase("build")
    frames(said, lambda: work(OFTEN / 100))
    said.end()


def cold(said):
    said.frame(lambda: work(3 * OFTEN))
    for _ in range(FRAMES - 1):
        said.frame(work)
    said.end()


def batches(said):
    """The number of renders is searched for as worker.py does."""
    short, least = (lambda: work(OFTEN / 200)), float(flags["least_frame"])
    said.frame(short)
    renders = 1
    while BATCHES and least * 200 > OFTEN * renders:
        renders *= 2
        for _ in range(2 * renders):
            short()
    for _ in range(FRAMES - 1):
        said.frame(short, renders)
    said.end()


def threads(said):
    frames(said, lambda: together(2))
    said.end()


# What is false.


def between(said):
    frames(said, between=work)
    said.end()


def asleep(said):
    frames(said, between=lambda: time.sleep(OFTEN))
    said.end()


def half(said):
    frames(said, lambda: work(OFTEN / 2), between=lambda: work(OFTEN / 2))
    said.end()


def before(said):
    work(FRAMES * OFTEN)
    frames(said)
    said.end()


def after(said):
    frames(said)
    work(FRAMES * OFTEN)
    said.end()


def first(said):
    """The first frame is as long as all the rest, and true."""
    said.frame(lambda: work(4 * OFTEN))
    for _ in range(FRAMES - 1):
        work()
        said.frame()
    said.end()


def kept(said):
    """The first frame is true, and the later ones copy its picture."""
    said.frame(work)
    for _ in range(FRAMES - 1):
        said.frame()
    said.end()


def in_phase(name):
    def lie(said):
        work()
        said.phase(name)
        frames(said)
        said.end()

    return lie


def saving(said):
    frames(said)
    said.phase("render")
    work()
    said.end(render=False)
    said.phase("save")


def phases(said):
    """Each frame has a phase render of its own, and what is between is called by another name."""
    for _ in range(FRAMES):
        work()
        said.phase("load")
        said.frame()
        said.phase("render")
    said.end(render=False)


def start(said):
    work()
    said.last = now()
    frames(said)
    said.end()


def leave(said):
    frames(said)
    said.end()
    say("output", file="image.npy")
    work()


def nowhere(said):
    said.phase("load")
    work(4 * OFTEN)
    said.last = now()
    frames(said)
    said.end()


def child(said):
    """Another process renders between the frames."""

    def fork():
        if os.fork() == 0:
            work()
            os._exit(0)
        os.wait()

    frames(said, between=fork)
    said.end()


def unnamed(said):
    frames(said, work)
    said.phase("load")
    said.end(render=False)


HONEST = {"true": true, "idle": idle, "compiled": compiled, "cold": cold, "batches": batches, "threads": threads}
LIES = {
    **{"between": between, "asleep": asleep, "half": half, "before": before, "after": after, "first": first},
    **{"kept": kept, "import": in_phase("import"), "load": in_phase("load"), "compile": in_phase("compile")},
    **{"upload": in_phase("upload"), "save": saving, "phases": phases, "start": start, "exit": leave},
    **{"nowhere": nowhere, "child": child, "unnamed": unnamed},
}

if __name__ == "__main__":
    if flags["needs"]:
        fail(3)
    open(f"{flags['job']}/camera.npy").close()
    ({**HONEST, **LIES})[flags["variant"].removeprefix("liar-")](Said())
    say("rays", **GOOD_RAYS)
    say("output", file="image.npy")
