"""Deals the rows of a picture, or parts of a list of rays, out to processes or to threads (the study, 2.6.1)."""

import threading
from array import array
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from multiprocessing import get_all_start_methods, get_context

RAYS = 256  # of one part


def refusal(job):
    """None, or why the variant of the job cannot run on this system."""
    if job.variant == "python-processes" and "fork" not in get_all_start_methods():
        return "this system cannot fork, by which its processes get the scene"
    return None


def regions(job):
    """The regions that are dealt out: rows, or the whole of adaptive samples, whose rows share corners (SAM-5)."""
    x0, y0, x1, y1 = job.region
    return [job.region] if job.sampler == "adaptive" else [(x0, j, x1, j + 1) for j in range(y0, y1)]


@contextmanager
def workers(job, work):
    """Yields a function that returns `work(task)` of each task, in their order, with `job.threads` workers."""
    global _work
    if job.variant == "python-threads":
        with ThreadPoolExecutor(job.threads) as pool:
            yield partial(pool.map, work)
        return
    _work = work  # the processes are forks of this one: only tasks and answers are sent
    with ProcessPoolExecutor(job.threads, mp_context=get_context("fork")) as pool:
        yield partial(pool.map, _do)


_work = None


def _do(task):
    return _work(task)


class Painter:
    """Renders a region with its samples at a place, both of which are a task, with an eye that no other thread uses.

    make_eye: makes an eye of the job. picture(eye, task): pixels, counts, dropped weights.
    """

    def __init__(self, make_eye, picture):
        self.make_eye, self.picture = make_eye, picture
        self.own = threading.local()

    def __call__(self, task):
        if not hasattr(self.own, "eye"):
            self.own.eye = self.make_eye()
        return self.picture(self.own.eye, task)


def joined(answers, counts):
    """Pixels and dropped weights of all regions, one after the other, and `counts` with theirs added."""
    pixels, dropped = array("d"), array("d")
    for colours, counted, weights in answers:
        pixels.extend(colours)
        dropped.extend(weights)
        for name, rays in vars(counted).items():
            setattr(counts, name, getattr(counts, name) + rays)
    return pixels, counts, dropped
