"""Hostile arrays of a renderer, pictures and hits: one that is judged, or a failed result that says what is wrong."""

import io
import json
import pickle
import zipfile

import hostile
import numpy as np
import pytest

from harness.judge import bound, hits, judge
from harness.judge.reference import Reference
from harness.picture import perception
from harness.process import repetition
from harness.renderer.events import Said
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten

WIDTH, HEIGHT, RAYS = 5, 4, 6
IMAGE = Parameters(width=WIDTH, height=HEIGHT)
TRACED = Parameters(kind="rays", width=RAYS, height=1, depth=0)
RIGHT = np.linspace(0, 1, HEIGHT * WIDTH * 3).reshape(HEIGHT, WIDTH, 3)
HITS = np.array([[n + 1.0, 0, 0, n, 0, 0, 1, n % 2] for n in range(RAYS - 1)] + [[0] * 7 + [-1]], float)
MASK = np.zeros((HEIGHT, WIDTH), bool)
PICTURE = Reference("r", RIGHT, MASK, None, np.zeros((2, 0, 3)), ())
MIRROR = "CAMERA (0,0,0) (1,0,0) (0,1,0) 1 LIGHT (9,9,9) (1,1,1) 0 SPHERE (0,0,0) 1 (1,1,1) 1e30 1 (0,0,0) 1e6 1"
BRIGHT = flatten(text.read(MIRROR))  # which a thousand mirrors would make brighter than any number
SAID = Said(output="image.npy", dropped="dropped.npy")
SPECIAL = (0.0, -0.0, 1e308, -1e308, 5e-324, np.nan, np.inf, -np.inf, 1.0)


def npy(array):
    file = io.BytesIO()
    np.lib.format.write_array(file, array)
    return file.getvalue()


def header(said, data=b"", version=(1, 0)):
    """An .npy file that says this of itself."""
    line = said.encode() + b" " * 20 + b"\n"
    size = len(line).to_bytes(2 if version == (1, 0) else 4, "little")
    return b"\x93NUMPY" + bytes(version) + size + line + data


def told(shape, dtype="<f8", order=False):
    return f"{{'descr': {dtype!r}, 'fortran_order': {order}, 'shape': {shape}, }}"


VALID = {
    "image": [
        npy(RIGHT),
        npy(RIGHT.astype(np.float32)),
        npy(np.asfortranarray(RIGHT)),
        npy(np.full_like(RIGHT, 1e308)),
    ],
    "rays": [npy(HITS), npy(HITS.astype(np.float32))],
    "dropped": [npy(RIGHT[..., 0]), npy(RIGHT[..., 0].astype(np.float32))],
}


@pytest.fixture
def given(place):
    """given(kind, content): what comes of a file of this content, and of its verdict; None, or the fault."""

    def given(kind, content):
        (place / "image.npy").write_bytes(content)
        (place / "dropped.npy").write_bytes(content)
        return hostile.outcome(lambda: _judged(place, kind))

    return given


def _judged(out, kind):
    if kind == "dropped":
        array, fault = repetition._load_dropped(out, SAID, IMAGE)
    else:
        array, fault = repetition._load(out, SAID, IMAGE if kind == "image" else TRACED, RAYS)
    if fault:
        assert fault.isprintable() and len(fault) < 2000, fault
        return fault
    with np.errstate(under="ignore", over="raise", invalid="raise"):
        if kind == "image":
            assert array.shape == RIGHT.shape
            if judge.not_finite(array) is None:
                for noise in (None, np.full(RIGHT.shape, 0.1)):
                    json.dumps(judge.errors(array, RIGHT, noise, MASK), allow_nan=False)
            verdict = judge.judge(array, PICTURE, "float64")
        elif kind == "rays":
            verdict = hits.judge(
                array, Reference("r", HITS, np.zeros(RAYS, bool), None, np.zeros((0, 4)), ()), "float64"
            )
        else:
            limit = bound.bound(BRIGHT, 1000, array)
            json.dumps([float(limit.max()), float(bound.radiance(BRIGHT, 1000).max())], allow_nan=False)
            return None
    json.dumps(verdict.record(), allow_nan=False)
    return None


def test_cases(fuzz, given):
    def once(random):
        kind = random.choice(list(VALID))
        content = random.choice(VALID[kind])
        way = random.randint(0, 2)
        if way == 0:  # numbers that are strange, in a file that is sound
            array = np.lib.format.read_array(io.BytesIO(content)).copy()
            for _ in range(random.randint(0, 3)):
                if array.size:
                    array.flat[random.randint(0, array.size - 1)] = random.choice(SPECIAL)
            content = npy(array)
        elif way == 1:  # a header that is strange
            shapes = (
                "()",
                "(0,)",
                "(4, 5, 3)",
                "(-1, 5, 3)",
                "(10**12,)",
                "(True,)",
                "(1000000000000, 8)",
                "(0, 8)",
                "8",
            )
            kinds = ("<f8", ">f8", "|O", "<U9", "|V8", "<f2", "<c16", "|S0", "<M8[ns]", "(9,)<f8", "f8,f8", "x", "<f16")
            line = told(random.choice(shapes), random.choice(kinds), random.choice((True, False, 1, None)))
            content = header(line, bytes(480), random.choice(((1, 0), (2, 0), (3, 0), (9, 9))))
        given(kind, hostile.damaged_bytes(random, content, 2))

    fuzz("arrays", once)


def test_the_corpus_is_good(given):
    for kind, contents in VALID.items():
        for content in contents:
            assert kind == "dropped" or given(kind, content) is None
    assert given("dropped", VALID["dropped"][0]) is None


class Evil:
    """What runs a command when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


def zipped():
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("arr_0.npy", npy(RIGHT))
    return file.getvalue()


BAD = {
    "nothing": b"",
    "NUL bytes": b"\0" * 1000,
    "half a header": npy(RIGHT)[:20],
    "half the numbers": npy(RIGHT)[:-8],
    "10^12 numbers": header(told("(1000000000000,)"), bytes(480)),
    "10^12 pictures": header(told("(1000000000000, 4, 5, 3)"), bytes(480)),
    "2^62 numbers": header(told("(4611686018427387904, 4)"), bytes(480)),
    "fewer than none": header(told("(-4, 5, 3)"), bytes(480)),
    "1e9 dimensions": header(told("(" + "1, " * 3000 + ")"), bytes(480)),
    "one of a gigabyte": header(told("(1,)", "|V1000000000"), bytes(480)),
    "a text of 10^9 letters": header(told("(1,)", "<U1000000000"), bytes(480)),
    "10^12 of nothing": header(told("(1000000000000,)", "|S0"), bytes(480)),
    "10^12 of empty records": header(told("(1000000000000,)", []), bytes(480)),
    "nested dtypes": header(told("(4, 5, 3)", [("a", [("b", [("c", "<f8")])])]), bytes(480)),
    "a nested header": header("(" * 5000, bytes(480)),
    "a header of minus": header("-" * 9000 + "1", bytes(480)),
    "a header of a megabyte": header(told("(4, 5, 3)") + " " * 10**6, bytes(480), (2, 0)),
    "a header of 4 GB": b"\x93NUMPY\x02\x00\xff\xff\xff\xff" + bytes(100),
    "a header that is code": header("__import__('os').getpid()", bytes(480)),
    "another version": header(told("(4, 5, 3)"), bytes(480), (9, 0)),
    "a zip": zipped(),
    "a pickle alone": pickle.dumps(RIGHT),
}


@pytest.mark.parametrize("name", BAD)
@pytest.mark.parametrize("kind", VALID)
def test_bad(given, kind, name):
    assert given(kind, BAD[name])


@pytest.mark.parametrize("wrap", [lambda evil: evil, lambda evil: np.array([evil], dtype=object)])
def test_no_pickle_is_loaded(given, place, wrap):
    mark = place / "mark"
    data = pickle.dumps(wrap(Evil(mark)))
    for content in (data, header(told("(1,)", "|O"), data)):
        for kind in VALID:
            assert given(kind, content)
    assert not mark.exists()


@pytest.mark.parametrize(
    "name", ["../secret.npy", "/secret.npy", "a/../../secret.npy", "link.npy", "", ".", "x\0.npy", "\ud800"]
)
def test_no_name_leaves_the_folder(place, name):
    (place / "out").mkdir()
    (place / "secret.npy").write_bytes(npy(RIGHT))
    (place / "out" / "link.npy").symlink_to(place / "secret.npy")
    assert repetition.read_array(place / "out", name)[0] is None


@pytest.mark.parametrize("special", SPECIAL)
def test_perception_of_strange_numbers(special):
    """What is seen of a picture that is finite, however large."""
    picture = np.random.default_rng(3).random((20, 20, 3))
    picture[3, 4] = special
    if judge.not_finite(picture):
        return
    with hostile.contained(), np.errstate(all="ignore"):
        told = perception.perceive(picture, np.full_like(picture, 0.5), "linear").record()
    json.dumps(told, allow_nan=False)
