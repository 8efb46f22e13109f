"""CPU time, for bounds that are meant for a common processor and are tested on whatever there is.

A core of a virtual machine may be half of a core whose other half is busy with something else: the same work then takes
twice the CPU time. So the time of some work is told in that of a fixed loop, measured before it and after it.
"""

import time

COMMON = 0.2  # s of the loop with CPython 3.11 on a core of some 3.5 GHz that it has to itself


def seconds(work):
    """The result of work(), and its CPU time in s, as if on a common processor if this one is slower just now."""
    before = _loop()
    result, took = _timed(work)
    loop = (before + _loop()) / 2
    return result, took * min(1, COMMON / loop)


def _loop():
    return _timed(lambda: sum(i * i for i in range(3_000_000)))[1]


def _timed(work):
    start = time.process_time()
    result = work()
    return result, time.process_time() - start
