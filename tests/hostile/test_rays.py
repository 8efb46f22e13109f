"""Hostile lists of rays: rays of finite numbers, or an error at their line."""

import hostile
import numpy as np
import pytest

from harness.errors import UserError
from harness.judge.rays import read

HEAD = "ox,oy,oz,dx,dy,dz\n"
VALID = [HEAD + "0,0,0,0,0,1\n1.5,-2,3e-5,0.1,0.2,-0.3\n" * 3, HEAD, HEAD + '"0","0","0","1e-300","0","0"\r\n']
PIECES = [",", "\n", "0,0,0,0,0,1\n", "ox", '"', '""', "1e308", ";", "\r"]


@pytest.fixture
def tried(place):
    def tried(content):
        (place / "rays.csv").write_bytes(content if isinstance(content, bytes) else content.encode())
        found = hostile.outcome(lambda: read(place / "rays.csv"), "rays.csv")
        if not isinstance(found, UserError):
            assert np.isfinite(found).all() and found.shape[1:] == (6,)
            largest = np.abs(found[:, 3:]).max(axis=1, initial=0)
            assert ((largest >= 0.5) & (largest < 1)).all()
        return found

    return tried


def test_cases(fuzz, tried):
    fuzz("RAYS.csv", lambda random: tried(hostile.mutated(random, VALID, PIECES)))


ROW = "0,0,0,0,0,1\n"
GOOD = {
    "a byte order mark": b"\xef\xbb\xbf" + (HEAD + ROW).encode(),
    "lines of Windows": (HEAD + ROW).replace("\n", "\r\n"),
    "empty lines": HEAD + "\n\n" + ROW + "\n",
    "denormals": HEAD + "0,0,0,5e-324,0,5e-324\n",
    "the largest": HEAD + "1e30,0,0,1.7e308,-1.7e308,1e308\n",
    "no end": HEAD + ROW.strip(),
}
BAD = {
    "nothing": (b"", ":1: expected the header"),
    "NUL bytes": (b"\0" * 1000, ":1: "),
    "UTF-16": ((HEAD + ROW).encode("utf-16"), "not a text file"),
    "half a letter": ((HEAD + ROW).encode() + b"\xc3", "not a text file"),
    "a field of a megabyte": (HEAD + "1" * 10**6, ":2: "),
    "a quote that is not closed": (HEAD + '"0,0,0,0,0,1\n' * 20_000, ": "),
    "100,000 columns": (HEAD + "0," * 10**5, ":2: expected 6 numbers, found 100001"),
    "a number of 4000 digits": (HEAD + f"{'1' * 4000},0,0,0,0,1\n", ":2: ox: expected a finite number"),
    "1e999": (HEAD + "1e999,0,0,0,0,1\n", ":2: ox: expected a finite number"),
    "no number": (HEAD + ROW + "0,0,0,nan,0,1\n", ":3: dx: expected a finite number"),
    "infinity": (HEAD + "0,0,0,-inf,0,1\n", ":2: dx: expected a finite number"),
    "no direction": (HEAD + "0,0,0,0,-0,0\n", ":2: the direction has length 0"),
    "escapes for a terminal": (HEAD + "\x1b[2J,0,0,0,0,1\n", ":2: ox: expected a finite number"),
}


@pytest.mark.parametrize("name", GOOD)
def test_strange_and_good(tried, name):
    found = tried(GOOD[name])
    assert not isinstance(found, UserError) and len(found) == 1, found


@pytest.mark.parametrize("name", BAD)
def test_bad(tried, name):
    content, match = BAD[name]
    found = tried(content)
    assert isinstance(found, UserError)
    hostile.refused(lambda: (_ for _ in ()).throw(found), "rays.csv", match=match)
