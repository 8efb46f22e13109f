"""Text files that a user names: what is read, and what is refused, with its place and what to do."""

import os
import re
import threading
from contextlib import suppress

import pytest

from harness import textfile
from harness.errors import UserError

LETTERS = "CAMERA é 場景\n# ü\n"


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_text(end, mark, tmp_path):
    (tmp_path / "a.txt").write_bytes(mark + LETTERS.replace("\n", end).encode())
    assert textfile.read(tmp_path / "a.txt") == LETTERS


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            "a\n# Größe\n".encode("cp1252"),
            'a.txt:2:5: not a text file (UTF-8): byte 0xf6 here is no UTF-8; in Windows-1252 it is "ö"',
        ),
        (
            "\ufeffé\n".encode() + b"x\x93y",
            'a.txt:2:2: not a text file (UTF-8): byte 0x93 here is no UTF-8; in Windows-1252 it is "“"',
        ),
        (b"a\r\nb\r\n\x81", "a.txt:3:1: not a text file (UTF-8): byte 0x81 here; save it as text in UTF-8"),
        ("é".encode()[:1], "a.txt:1:1: not a text file (UTF-8): byte 0xc3"),
        (LETTERS.encode("utf-16"), "a.txt:1: not a text file (UTF-8): it is in UTF-16; save it"),
        (b"\xfe\xff" + LETTERS.encode("utf-16-be"), "a.txt:1: not a text file (UTF-8): it is in UTF-16; save it"),
        (LETTERS.encode("utf-32"), "a.txt:1: not a text file (UTF-8): it is in UTF-32; save it"),
        (
            LETTERS.encode("utf-16-le"),
            "a.txt:1:2: not a text file (UTF-8): it seems to be in UTF-16, without a byte order mark",
        ),
        (b"CAMERA\nCAMERA\n\0", "a.txt:3:1: not a text file (UTF-8): it has a NUL byte here"),
        (b"x" * 101, "a.txt: the file has more than 0 MB; divide it"),
    ],
)
def test_other_encodings(content, message, tmp_path):
    (tmp_path / "a.txt").write_bytes(content)
    with pytest.raises(UserError, match=re.escape(message)):
        textfile.read(tmp_path / "a.txt", 100)


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "a.txt")
    with pytest.raises(UserError, match=r"a.txt: expected a file, found a pipe; write what comes from it to a file"):
        textfile.read(tmp_path / "a.txt")

    def write():
        with suppress(BrokenPipeError):
            (tmp_path / "a.txt").write_text("CAMERA")

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    with pytest.raises(UserError, match="found a pipe"):
        while writer.is_alive():
            textfile.read(tmp_path / "a.txt")


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/null", "/dev/tty"])
def test_a_device_is_not_read(device, tmp_path):
    (tmp_path / "a.txt").symlink_to(device)
    with pytest.raises(UserError, match=r"expected a file, found a device|cannot be read"):
        textfile.read(tmp_path / "a.txt")


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (["render"], "scene.txt"),
        (["render"], "scene.nff"),
        (["needs"], "scene.txt"),
        (["run"], "e.toml"),
        (["trace", "good.txt"], "rays.csv"),
        (["trace"], "scene.txt"),
    ],
)
@pytest.mark.parametrize("kind", ["pipe", "device", "endless"])
def test_commands(kind, words, name, rayrace, write, tmp_path):
    """Of what has no end, or never begins, a command says so at once."""
    write("good.txt", "CAMERA (0,0,0) (1,0,0) (0,1,0) 2\n")
    write("good.csv", "ox,oy,oz,dx,dy,dz\n0,0,0,0,0,1\n")
    if kind == "pipe":
        os.mkfifo(tmp_path / name)
    elif kind == "device":
        (tmp_path / name).symlink_to("/dev/zero")
    else:
        with open(tmp_path / name, "wb") as file:
            file.truncate(1 << 40)  # a hole
    rest = ["good.csv"] * (words == ["trace"])
    done = rayrace(*words, name, *rest, cwd=tmp_path, timeout=60)
    found = {"pipe": "found a pipe", "device": "found a device", "endless": "the file has more than"}[kind]
    assert done.returncode == 2 and f"{name}: " in done.stderr and found in done.stderr
