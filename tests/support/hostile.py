"""Hostile input: where it comes from, and what may come of it.

Of any input one of two things may come, within 5 s of CPU time and 1 GB: a result, or a UserError that says where and
can be printed. Every other exception is a bug.

Cases are made by functions of a random.Random, so that who draws is another's business: Hypothesis, which makes what
fails small, or atheris, which looks for code that it has not seen yet (guided.py).
"""

import copy
import math
import os
import random
import re
import resource
import signal
import tempfile
import time
from contextlib import contextmanager, suppress
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from harness.errors import UserError

CASES = int(os.environ.get("RAYRACE_FUZZ_CASES", "1000"))
SEED = int(os.environ.get("RAYRACE_FUZZ_SEED", "20"))
FIRST = 1000  # cases that Hypothesis draws
BUDGET, LEAST = 20.0, 100  # s by day for the cases of a kind, of which so many are tried in any case
SECONDS, WALL, MEMORY = 5, 120, 1 << 30  # of a case: of CPU time, until a sleeper is woken; bytes of address space
LONGEST = 25_000  # characters of an error

NUMBERS = (
    *("0", "-0", "-1", "1", "3", "1e308", "-1e308", "5e-324", "1e999", "nan", "inf", "-Infinity", "1e30", "1e-31"),
    *("999999999", "1000000000000", "9223372036854775808", "0x10", "1_000", "٣", "0.1.2", "1" * 5000, "true", "null"),
)
TEXTS = (
    "", '"', "'", "\\", "\0", "\ufeff", "\u2028", "\udcff", "\ud800", "\r", "\x1b[2J", "\x85", "é", "#", ",", "=", ".",
    "../../../etc/passwd", "/etc/passwd", "/dev/zero", "..", "nul", "a" * 3000, "(" * 60, "[" * 60, "{" * 60, "]", "}",
    "<script>alert(1)</script>", "%s%n", "{0.__class__}", "${HOME}", "1;2", "!!python/object", "\n\n", "\t", " " * 200,
)  # fmt: skip
_TOKEN = re.compile(r'"[^"\n]*"|[A-Za-z_]\w*|[-+]?[\d.]+(?:[eE][-+]?\d+)?|\s+|.', re.DOTALL)


class Hang(BaseException):
    """No case may catch it."""


class Enough(BaseException):
    """The time of a kind is over: no failure, which Hypothesis would make small."""


@contextmanager
def contained(seconds=SECONDS):
    """Hang if what is done takes too long; MemoryError if it takes too much."""

    def ring(*_):
        raise Hang(f"more than {seconds} s of CPU time, or {WALL} s of any")

    before = [signal.signal(number, ring) for number in (signal.SIGPROF, signal.SIGALRM)]
    limits = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (_address_space() + MEMORY, limits[1]))
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.setitimer(signal.ITIMER_REAL, WALL)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)
        resource.setrlimit(resource.RLIMIT_AS, limits)
        for number, handler in zip((signal.SIGPROF, signal.SIGALRM), before, strict=True):
            signal.signal(number, handler)


def _address_space():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[0]) * resource.getpagesize()


@contextmanager
def scratch():
    """A folder where a file is written quickly many times over: in memory, where there is such a place."""
    with tempfile.TemporaryDirectory(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None) as folder:
        yield Path(folder)


def outcome(run, *names):
    """What `run()` returns, or the UserError that it raises, which must name one of `names`, that is: say where."""
    with contained():
        try:
            return run()
        except UserError as error:
            fault = error
    text = str(fault)
    assert any(name in text for name in names), f"it does not say where: {text[:500]}"
    assert not re.search("allocate|MemoryError|out of memory", text), f"found out too late: {text[:500]}"
    assert len(text) <= LONGEST and text.count("\n") <= 30, f"nobody reads so much: {text[:500]}"
    assert all(letter.isprintable() or letter == "\n" for letter in text), f"not fit for a terminal: {text[:500]!r}"
    return fault


def refused(run, *names, match=""):
    """The text of the UserError that must come."""
    found = outcome(run, *names)
    assert isinstance(found, UserError), f"taken as good: {found!r:.500}"
    assert re.search(match, str(found)), str(found)
    return str(found)


def fuzz(kind, try_one, tell):
    """Let try_one(random) go through CASES cases; tell: pytest's record_property. The seed is printed.

    The first are drawn by Hypothesis, which makes what fails small; the others are only drawn, which is quicker. By day
    there are as many as BUDGET has time for; their number is told.
    """
    print(f"{kind}: {CASES} cases, RAYRACE_FUZZ_SEED={SEED}")
    done, failed = 0, False
    end = time.monotonic() + (BUDGET if CASES <= FIRST else math.inf)

    @seed(SEED)
    @settings(
        max_examples=min(FIRST, CASES),
        deadline=None,
        database=None,
        phases=[Phase.generate, Phase.shrink],
        suppress_health_check=list(HealthCheck),
        print_blob=True,
    )
    @given(st.randoms(use_true_random=False))
    def first(random):
        nonlocal done, failed
        try:
            try_one(random)
        except BaseException:
            failed = True  # from here on it is made small, whatever the time
            raise
        done += 1
        if done >= LEAST and not failed and time.monotonic() > end:
            raise Enough

    with suppress(Enough):
        first()
    for number in range(FIRST, CASES):
        try:
            try_one(random.Random(f"{SEED} {kind} {number}"))
        except BaseException as error:
            error.add_note(f'it is random.Random("{SEED} {kind} {number}")')
            raise
        done += 1
    tell("hostile", (kind, done, SEED))


def mutated(random, valid, pieces=()):
    """Bytes of one of the texts `valid` with some tokens lost, doubled, moved or replaced, and perhaps damaged bytes.

    pieces: tokens of the language.
    """
    words = list(_TOKEN.findall(random.choice(valid)))
    for _ in range(random.randint(0, 3)):
        start = random.randint(0, len(words))
        end = min(start + random.choice((0, 1, 1, 2, 5, 20)), len(words))
        way = random.randint(0, 6)
        if way == 0:
            new = []
        elif way == 1:
            new = words[start:end] * random.choice((2, 3, 50))
        elif way == 2 and len(words) > 1:
            other = random.randint(0, len(words) - 1)
            new = words[other : other + random.choice((1, 3, 10))]
        elif way == 3:
            new = [random.choice(NUMBERS)]
        elif way == 4:
            new = [random.choice(TEXTS)]
        elif way == 5 and pieces:
            new = [random.choice(pieces), " "]
        else:  # a number where a number is
            start = next((n for n in range(start, len(words)) if words[n][:1].isdigit()), start)
            end, new = start + 1, [random.choice(NUMBERS)]
        words[start:end] = new
    return damaged(random, "".join(words))


def damaged(random, text):
    """A text as bytes, perhaps in another encoding, cut off, or with some bytes changed."""
    if random.randint(0, 9) == 0:
        way = random.randint(0, 3)
        if way == 0:
            return text.encode("utf-16", "surrogatepass")
        text = ("\ufeff" + text, text.replace("\n", "\r\n"), text.replace("\n", "\r"))[way - 1]
    return damaged_bytes(random, text.encode("utf-8", "surrogatepass"), 4)


def damaged_bytes(random, data, seldom=1):
    """Bytes, of which, but for `seldom` - 1 of `seldom` times, some are changed, lost, doubled or new."""
    data = bytearray(data)
    if random.randint(0, seldom - 1):
        return bytes(data)
    for _ in range(random.randint(1, 3)):
        start = random.randint(0, len(data))
        end = min(start + random.choice((0, 1, 4, 100)), len(data))
        way = random.randint(0, 4)
        if way == 0:
            data[start:end] = []
        elif way == 1:
            data[start:end] = data[start:end] * 2
        elif way == 2:
            data[start:end] = bytes(random.randint(0, 255) for _ in range(random.choice((1, 2, 8))))
        elif way == 3:
            data[start:end] = random.choice((b"\0", b"\xff", b"\x80", b"\xff\xff\xff\x7f", b"\n"))
        else:
            del data[start:]
    return bytes(data)


VALUES = (
    *(None, True, False, 0, 1, -1, 2**63, 10**30, 0.5, -0.5, 1e308, 5e-324, math.nan, math.inf, 10**12),
    *("", "x", "ok", "unavailable: x", "0,0,4,4", "pictures/x.npy", *TEXTS),
    *([], {}, [[]], [None], [1, 2], ["x"], {"unavailable": "x"}, {"unavailable": None}, {"x": {}}, {"": ""}),
)


def bent(random, told):
    """Change a tree of JSON in one to three places: values of other kinds, lost keys, other keys, parts of it moved."""
    for _ in range(random.randint(1, 3)):
        holder, key = _somewhere(random, told)
        if holder is None:
            return told
        way = random.randint(0, 7)
        if way == 0:
            del holder[key]
        elif way == 1 and isinstance(holder, dict):
            holder[random.choice((*TEXTS, "x", "unavailable", *holder))] = holder.pop(key)
        elif way == 2:
            other, name = _somewhere(random, told)
            holder[key] = other[name] if other is not None and not isinstance(other[name], dict | list) else None
        elif way == 3 and isinstance(holder[key], list):
            holder[key] = holder[key] * random.choice((2, 3))
        else:
            holder[key] = copy.deepcopy(random.choice(VALUES))
    return told


def _somewhere(random, told):
    """A list or an object in a tree of JSON, and where in it; the deeper the less likely."""
    found = None, None
    while isinstance(told, list | dict) and told:
        key = random.choice(list(told)) if isinstance(told, dict) else random.randint(0, len(told) - 1)
        found = told, key
        told = told[key]
        if random.randint(0, 3) == 0:
            break
    return found
