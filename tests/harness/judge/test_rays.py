import io

import numpy as np
import pytest

from harness.errors import UserError
from harness.judge import rays

HEADER = "ox,oy,oz,dx,dy,dz\n"


def test_read(write):
    file = write("rays.csv", "\ufeff" + HEADER.replace(",", ", ") + "0,1,2,0,-0.75,0.5\r\n\n-1e30, .5 ,+3,0.5,0,0\n")
    assert np.array_equal(rays.read(file), [[0, 1, 2, 0, -0.75, 0.5], [-1e30, 0.5, 3, 0.5, 0, 0]])


def test_directions_of_any_length_keep_their_digits(write):
    direction = np.array([0.123456789, -0.987654321, 0.5])
    scaled = [direction * 2.0**power for power in (-900, -1, 0, 7, 1000)]
    lines = ["0,0,0," + ",".join(f"{value:.17g}" for value in row) + "\n" for row in scaled]
    file = write("rays.csv", HEADER + "".join(lines))
    assert np.array_equal(rays.read(file)[:, 3:], [direction] * 5)


def test_only_a_header_is_no_rays(write):
    assert rays.read(write("rays.csv", HEADER)).shape == (0, 6)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", ":1: expected the header ox,oy,oz,dx,dy,dz"),
        ("0,0,0,0,0,1\n", ":1: expected the header"),
        (HEADER + "0,0,-2e30,0,0,1\n", ":2: the origin is farther than 1e+30 from (0,0,0)"),
        ("dx,dy,dz,ox,oy,oz\n", ":1: expected the header"),
        (HEADER + "0,0,0,0,1\n", ":2: expected 6 numbers, found 5"),
        (HEADER + "0,0,0,0,0,1\n0,0,0,0,0,1,\n", ":3: expected 6 numbers, found 7"),
        (HEADER + "\n\n0,0,x,0,0,1\n", ':4: oz: expected a finite number, found "x"'),
        (HEADER + "0,0,0,nan,0,1\n", ':2: dx: expected a finite number, found "nan"'),
        (HEADER + "0,-inf,0,0,0,1\n", ':2: oy: expected a finite number, found "-inf"'),
        (HEADER + "0,0,0,0,,1\n", ':2: dy: expected a finite number, found ""'),
        (HEADER + "0,0,0,0,0,1e999\n", ':2: dz: expected a finite number, found "1e999"'),
        (HEADER + "0,0,0,0,-0,0\n", ":2: the direction has length 0"),
    ],
)
def test_faults(text, message, write):
    file = write("rays.csv", text)
    with pytest.raises(UserError) as fault:
        rays.read(file)
    assert str(fault.value).startswith(f"{file}{message}")


def test_not_text(tmp_path):
    (tmp_path / "rays.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UserError, match="not a text file"):
        rays.read(tmp_path / "rays.csv")


def test_write_keeps_every_bit():
    rng = np.random.default_rng(3)
    hits = np.hstack([rng.normal(0, 1e3, (20, 7)), np.arange(20.0)[:, None]])
    hits[5] = [np.inf, 0, 0, 0, 0, 0, 0, -1]
    file = io.StringIO()
    rays.write(file, hits)
    header, *lines = file.getvalue().splitlines()
    assert header == "hit,t,px,py,pz,nx,ny,nz,object"
    assert lines[5] == "0,,,,,,,,"
    for number, line in enumerate(lines):
        if number != 5:
            assert [float(word) for word in line.split(",")] == [1, *hits[number]]
            assert line.endswith(f",{number}")
