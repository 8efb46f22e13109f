"""Renders as the renderer `numpy` does, and cheats: the variant says how (tests/support/cheats.py).

A cheat is a function of `later`: what it does for later frames, and what it says of them.
"""

import functools
import os
import sys
import threading
import time
import zlib

from renderers import worker

with worker.importing():
    import numpy as np

    from renderers.numpy.camera import Camera
    from renderers.numpy.sample import render
    from renderers.numpy.scene import Scene

FEATURES = ["sphere", "ambient", "diffuse", "phong", "shadows", "reflection", "region"]
LONG = 400  # renders: work that is worth hiding
now = time.monotonic
job = worker.Job(sys.argv[1:])
counted = []  # the counts of rays of the first render


def paint(sample=None, times=1, **changed):
    """The true picture with its samples at a place, made so many times; or with other parameters of the job."""
    own = dict(vars(job))
    vars(job).update(changed, sample=sample or job.sample)
    painted, eye = scene, camera
    if changed:
        painted, eye = Scene(job, job.precision), Camera(np.load(job.array("camera")), job, job.precision)
    for _ in range(times):
        picture, counts, _ = render(painted, eye, job)
        counted.append(counts)
    vars(job).update(own)
    return picture


@functools.cache
def memoised():
    """The picture, as one that remembers it and forgets that samples move."""
    return paint()


def checksum(picture):
    return f"{zlib.crc32(np.ascontiguousarray(picture)):08x}"


def say(index, start, end, *pictures, checksums=None):
    """Say a frame of these renders."""
    told = {"checksums": checksums or "".join(map(checksum, pictures))} if job.dialog else {}
    worker.say("frame", index=index, start=start, end=max(end, start + 6e-9), renders=len(pictures), **told)


def ask():
    return worker._key_of_places(job) if job.dialog else None


def place(key, index, number=0):
    return worker.place(key, index, number, job.sample) if key else job.sample


def frames(later, first=paint, before=lambda index, sample: None, span=lambda start, end: (start, end)):
    """Frame 0 is `first()`, each later one `later(index, sample, picture of frame 0)`; returns that of frame 0.

    before(index, sample): is called outside of its time. span: what is said of that, of the true start and end.
    """
    start = now()
    picture = first()
    say(0, start, now(), picture)
    key = ask() if job.frames else None
    for index in range(1, job.frames + 1):
        sample = place(key, index)
        before(index, sample)
        start = now()
        made = later(index, sample, picture)
        say(index, *span(start, now()), made)
    return picture


def by_hand(said, first=paint):
    """`frames` whose later ones `said(index, key, picture of frame 0)` says itself."""
    start = now()
    picture = first()
    say(0, start, now(), picture)
    key = ask() if job.frames else None
    for index in range(1, job.frames + 1):
        said(index, key, picture)
    return picture


def true():
    return frames(lambda index, sample, _: paint(sample))


def copies():
    return frames(lambda index, sample, picture: picture.copy())


def memo():
    return frames(lambda *_: memoised().copy(), memoised)


def ninth():
    whole = None

    def later(index, sample, picture):
        nonlocal whole
        whole = picture.copy() if whole is None else whole
        x0, y0, x1, y1 = job.region
        rows = max(1, (y1 - y0) // 9)
        top = y0 + rows * (index % 9)
        whole[top - y0 : top - y0 + rows] = paint(sample, region=(x0, top, x1, top + rows))
        return whole.copy()

    return frames(later)


def other_rows():
    """Renders every second row, and draws it twice."""

    def later(index, sample, _):
        picture = paint(sample)
        picture[1::2] = picture[: len(picture) // 2 * 2 : 2]
        return picture

    return frames(later)


def from_file(path):
    """A picture of an earlier process."""

    def first():
        if not os.path.exists(path):
            with open(path, "wb") as file:
                np.save(file, paint(times=LONG))
        return np.load(path)

    return frames(lambda *_: first(), first)


def touched():
    """Works while it loads, and makes its cache look as if it had compiled."""
    with worker.phase("load"):
        picture = paint(times=LONG)
    open(os.path.join(job.cache, str(time.time_ns())), "w").close()
    return frames(lambda *_: picture.copy(), picture.copy)


def set_up():
    with worker.phase("load"):
        picture = paint(times=LONG)
    return frames(lambda *_: picture.copy(), picture.copy)


def in_save():
    """Frames of 6 ns: the picture is made when all are said."""
    empty = np.zeros((job.region[3] - job.region[1], job.region[2] - job.region[0], 3))
    job.late = True
    return by_hand(lambda index, *_: say(index, now(), 0, empty), lambda: empty)


def helper():
    """A child goes on rendering while later frames are said."""

    def later(index, sample, picture):
        if os.fork() == 0:
            os.setsid()
            if os.fork() == 0:
                paint(sample, LONG)
            os._exit(0)
        return picture.copy()

    return frames(later)


def between():
    made = {}
    return frames(lambda index, *_: made[index], before=lambda index, sample: made.update({index: paint(sample)}))


def prerendered():
    """Asks where all samples will be, and makes all pictures within frame 0."""
    start = now()
    key = ask() if job.frames else None
    made = [paint(place(key, index)) if index else paint() for index in range(job.frames + 1)]
    say(0, start, now(), made[0])
    for index in range(1, job.frames + 1):
        start = now()
        say(index, start, now() + 1e-4, made[index].copy())
    return made[0]


def going_on():
    """A thread is not done with a frame when that is said to be over; its checksum waits for it."""

    def said(index, key, _):
        made = {}
        thread = threading.Thread(target=lambda: made.update(picture=paint(place(key, index))))
        start = now()
        thread.start()
        thread.join()
        say(index, start, start + 1e-4, made["picture"])

    return by_hand(said)


def late_start():
    def said(index, key, _):
        made = paint(place(key, index))
        say(index, now(), now() + 2e-5, made)

    return by_hand(said)


def backdated():
    """Later frames begin before their places were known, so that nothing seems to lie between."""
    start = now()
    picture = paint()
    end = now()
    say(0, start, end, picture)
    key = ask() if job.frames else None
    for index in range(1, job.frames + 1):
        made = paint(place(key, index))
        say(index, end, end + 1e-4, made)
        end += 1e-4
    return picture


def rewriting():
    """Takes back what it said, when it was told the places."""

    def said(index, key, picture):
        if index == 1:
            os.ftruncate(1, 0)
            os.lseek(1, 0, os.SEEK_SET)
            say(0, now() - 1e-3, now(), picture)
        say(index, now(), now() + 1e-4, picture)

    return by_hand(said)


def noisy():
    """No two of its pictures alone have the same bytes."""
    if job.frames:
        return copies()
    return frames(None, lambda: paint() + os.getpid() * 1e-15)


def failing():
    """Fails where one picture alone is asked for."""
    if job.frames == 0:
        worker.say("error", reason="no picture alone")
        sys.exit(1)
    return copies()


def silent():
    dialog, job.dialog = job.dialog, ""
    picture = copies()
    job.dialog = dialog
    return picture


def unasked():
    start = now()
    picture = paint()
    for index in range(job.frames + 1):
        say(index, start, now(), picture)
        start = now()
        time.sleep(1e-4)
    return picture


def unmoved():
    """Knows of no places, in no job."""
    job.sample = 0.5, 0.5
    return frames(lambda *_: memoised().copy(), memoised)


def halved(start, end):
    return start, start + (end - start) / 2


CHEATS = {
    "true": true,
    "copies": copies,
    "memo": memo,
    "ninth": ninth,
    "other-rows": other_rows,
    "cached": lambda: from_file(os.path.join(job.cache, "picture.npy")),
    "shm": lambda: from_file(f"/dev/shm/rayrace-cheat-{os.getuid()}-{zlib.crc32(job.cache.encode()):08x}"),
    "touched": touched,
    "set-up": set_up,
    "in-save": in_save,
    "helper": helper,
    "between": between,
    "prerendered": prerendered,
    "less-deep": lambda: frames(lambda index, sample, _: paint(sample, depth=0)),
    "unlit": lambda: frames(lambda index, sample, _: paint(sample, shadows=False)),
    "single": lambda: frames(lambda index, sample, _: paint(sample).astype(np.float32).astype(float)),
    "half": lambda: frames(lambda index, sample, _: paint(sample).astype(np.float16).astype(float)),
    "going-on": going_on,
    "halved": lambda: frames(lambda index, sample, _: paint(sample), span=halved),
    "late-start": late_start,
    "backdated": backdated,
    "false-checksum": lambda: by_hand(
        lambda index, _, one: say(index, now(), now() + 1e-4, one, checksums=f"{index:08x}")
    ),
    "first-checksum": lambda: by_hand(lambda index, key, one: say(index, now(), now() + 1e-4, one)),
    "silent": silent,
    "unasked": unasked,
    "own-places": lambda: frames(lambda index, *_: paint(place((1, 2), index))),
    "centred": lambda: frames(lambda *_: paint()),
    "unmoved": unmoved,
    "recognising": lambda: unmoved() if job.frames == 0 else copies(),
    "failing": failing,
    "noisy": noisy,
    "rewriting": rewriting,
    "last-of-batch": lambda: by_hand(
        lambda index, key, _: say(index, now(), now() + 1e-3, *[paint(place(key, index, 63))] * 64)
    ),
    "short": lambda: by_hand(lambda index, key, picture: say(index, now(), now() + 1e-7, picture)),
}

if __name__ == "__main__":
    np.seterr(all="ignore")
    worker.require(job, FEATURES)
    with worker.phase("load"):
        scene, camera = Scene(job, job.precision), Camera(np.load(job.array("camera")), job, job.precision)
    shown = CHEATS[job.variant.partition("-")[2]]()
    with worker.phase("render"):
        pass
    if hasattr(job, "late"):
        shown = paint(times=LONG)
    with worker.phase("save"):
        np.save(job.output("image.npy"), shown)
        if counted:
            counts = counted[0]
            worker.say_rays(counts.primary, counts.reflected, counts.shadow, counts.non_finite, counts.transmitted)
    worker.say("output", file="image.npy")
