"""Packs a run into one file, NAME.tar.xz, small enough to commit or send, without loss.

It has the files that store.py describes, except empty ones. An array of numbers, PATH.npy, is stored as
PATH.npy.planes: its header, then the first bytes of all numbers, their second bytes and so on (HDF5 and Blosc call this
shuffling). Pictures that differ in their last bits are alike in most planes, and xz finds what repeats.
"""

import errno
import io
import lzma
import os
import re
import shutil
import tarfile
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import BinaryIO

import numpy as np

from harness.errors import UserError
from harness.process.scratch import scratch
from harness.store import arrays, confined, store
from harness.system import output

SUFFIX, PLANES = ".tar.xz", ".planes"
MEMBER = re.compile(
    r"jobs\.jsonl|(parts/[\w-][\w.-]*/)?(run\.json|end\.json|repetitions\.jsonl|(pictures|series|logs)/[\w.-]+)"
)
TRUTHS, EVENTS = (".truth.npy", ".standard_error.npy"), ".stdout"
TEXTS = "run.json", "end.json", "repetitions.jsonl", "jobs.jsonl"  # of a run, or a part of one
LARGEST = 4 << 30  # bytes when unpacked: a small file of a stranger can unpack to any number of zeros
RATIO, ANY = 100, 1 << 26  # a run may unpack to ANY bytes, or RATIO times its size; real ones have a ratio of 20
# Files in it, of which 50,000 take 6 s to unpack; in one of any size; packed bytes of each further one. Real: 3000.
MEMBERS, OF_ANY, BYTES = 20_000, 2000, 20
HEADERS = 1 << 16  # bytes between two files: headers, of which real ones have 512 to 2048
PIECE = 1 << 20  # bytes, or numbers, in memory at once when unpacking
WIDEST = 64  # bytes of a number
NO_ROOM = errno.ENOSPC, errno.EDQUOT, errno.EROFS  # of the folder for temporary files
REACH = 1 << 26  # bytes: how far back xz looks for repetitions, about ten pictures
MEMORY = REACH + (1 << 24)  # bytes that xz may take to unpack


def is_packed(run: Path) -> bool:
    return run.name.endswith(SUFFIX) and not run.is_dir()


def name(run: Path) -> str:
    """The name of a run: that of its folder, or of its file without .tar.xz."""
    return run.resolve().name.removesuffix(SUFFIX)


def pack(folder: Path, file: Path, pictures: bool = True, truths: bool = True) -> None:
    """Writes the run in `folder` to `file`, the same bytes for the same run.

    pictures: False leaves out all arrays, and the events that renderers printed, which the rows hold. truths: False
    leaves out truths and their noise, whose digits do not repeat.
    UserError if `folder` is no run.
    """
    store.read(folder, list(store.hosts(folder)))
    places = [folder, *sorted(path.parent for path in folder.glob("parts/*/run.json"))]
    texts = [path for place in places for name in TEXTS if (path := place / name).exists()]
    rows = [path.read_text(encoding="utf-8") for path in texts if path.name == "repetitions.jsonl"]
    mentioned = re.findall(r'"(?:pictures/)?([\w.-]+\.npy)"', "".join(rows))
    order = {file_name: number for number, file_name in reversed(list(enumerate(mentioned)))}
    npy = [path for place in places for path in (place / "pictures").glob("*.npy") if pictures]
    npy = [path for path in npy if truths or not path.name.endswith(TRUTHS)]
    npy.sort(key=lambda path: (order.get(path.name, len(order)), str(path)))
    others = [path for place in places for part in ("series", "logs") for path in sorted((place / part).glob("*"))]
    others = [path for path in others if path.stat().st_size and (pictures or path.suffix != EVENTS)]
    if len(texts) + len(others) + len(npy) > MEMBERS:
        raise UserError(f"{folder}: more than {MEMBERS:,} files, which a packed run can have", remedy="--no-pictures")
    filters = [{"id": lzma.FILTER_LZMA2, "preset": 6, "dict_size": REACH}]

    def write(out) -> None:
        with lzma.open(out, "wb", filters=filters) as packed, tarfile.open(fileobj=packed, mode="w|") as tar:
            for path in (*texts, *others, *npy):
                data, inside = path.read_bytes(), path.relative_to(folder).as_posix()
                if path.suffix == ".npy":
                    data, inside = _planes(data), inside + PLANES
                member = tarfile.TarInfo(inside)
                member.size = len(data)
                tar.addfile(member, io.BytesIO(data))

    output.write(file, write, own=False)


@contextmanager
def opened(run: Path) -> Iterator[Path]:
    """The folder of a run: `run` itself, or a temporary folder with the packed run, until the block ends.

    UserError if the file is damaged, too large, or contains anything that a run does not.
    """
    if not is_packed(run):
        yield run
        return
    with scratch() as around:
        folder = around / name(run)
        _unpack(run, folder)
        yield folder


class _Unpacked:
    """Unpacks an xz file piece by piece, as many bytes as `allowed`: ValueError beyond them."""

    def __init__(self, file: BinaryIO):
        self.file, self.xz = file, lzma.LZMADecompressor(lzma.FORMAT_XZ, MEMORY)
        self.allowed = 0

    def read(self, size: int) -> bytes:
        """Returns up to `size` bytes, b"" at the end."""
        unpacked = b""
        while not (unpacked or self.xz.eof):
            data = self.file.read(PIECE) if self.xz.needs_input else b""
            if self.xz.needs_input and not data:
                raise EOFError("it ends too early")
            unpacked = self.xz.decompress(data, size)
        self.allowed -= len(unpacked)
        if self.allowed < 0:
            raise ValueError(f"a header of more than {HEADERS >> 10} kB")
        return unpacked


def _unpack(file: Path, folder: Path) -> None:
    for part in ("pictures", "series", "logs"):
        (folder / part).mkdir(parents=True)
    try:
        with confined.opened(file) as source:
            size = os.fstat(source.fileno()).st_size
            left, most = min(LARGEST, max(ANY, RATIO * size)), min(MEMBERS, OF_ANY + size // BYTES)
            stream = _Unpacked(source)
            stream.allowed = HEADERS + tarfile.RECORDSIZE
            with tarfile.open(fileobj=stream, mode="r|") as tar:
                for number in count(1):
                    stream.allowed = HEADERS + tarfile.RECORDSIZE
                    if (member := tar.next()) is None:
                        return
                    tar.members = []  # it would keep them all
                    left -= member.size
                    if not member.isreg() or member.issparse() or not MEMBER.fullmatch(member.name):
                        raise UserError(f"{file}: not a packed run: it contains {member.name!r}")
                    if number > most:
                        raise UserError(f"{file}: more than {most:,} files, too many for {size:,} packed bytes")
                    if left < 0:
                        why = f"{LARGEST >> 30} GiB, and more than {ANY >> 20} MiB and {RATIO} times its size"
                        raise UserError(f"{file}: too large when unpacked: more than {why}")
                    stream.allowed += member.size
                    _write(tar, member, folder)
    except OSError as error:
        if error.errno not in NO_ROOM:
            raise _not_packed(file, error) from None
        why = f"{file}: it cannot be unpacked in {folder.parent}: {error.strerror}"
        raise UserError(why, remedy="make room there, or set TMPDIR to another folder") from None
    except (EOFError, lzma.LZMAError, tarfile.TarError, ValueError, OverflowError) as error:
        raise _not_packed(file, error) from None


def _not_packed(file: Path, error: Exception) -> UserError:
    remedy = "make one with: rayrace export RUN --format packed -o FILE"
    return UserError(f"{file}: not a packed run: {error}", remedy=remedy)


def _write(tar: tarfile.TarFile, member: tarfile.TarInfo, folder: Path) -> None:
    """Writes a file of a packed run into the temporary folder of it."""
    path = folder / member.name
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "wb") as file:
        shutil.copyfileobj(tar.extractfile(member), file, PIECE)
    if path.suffix == PLANES:
        _numbers(path, path.with_suffix(""))
        path.unlink()


def _planes(npy: bytes) -> bytes:
    """The content of the .planes file for the content of an .npy file."""
    file = io.BytesIO(npy)
    size = _head(file)
    numbers = np.frombuffer(npy, np.uint8, offset=file.tell()).reshape(-1, size)
    return npy[: file.tell()] + numbers.T.tobytes()


def _numbers(planes: Path, npy: Path) -> None:
    """Writes the .npy file of a .planes file, piece by piece, as a small packed file can hold any number of numbers."""
    with open(planes, "rb") as file, open(npy, "wb") as out:
        size = _head(file)
        start = file.tell()
        count, rest = divmod(planes.stat().st_size - start, size)
        if rest:
            raise ValueError("planes of different lengths")
        file.seek(0)
        out.write(file.read(start))
        for first in range(0, count, PIECE):
            some = np.empty((min(PIECE, count - first), size), np.uint8)
            for plane in range(size):
                file.seek(start + plane * count + first)
                some[:, plane] = np.frombuffer(file.read(len(some)), np.uint8)
            out.write(some.tobytes())


def _head(file: BinaryIO) -> int:
    """Reads the header of an .npy file; returns the bytes of one number. ValueError if there is no valid header."""
    _, _, dtype = arrays.header(file)
    if dtype.hasobject:
        raise ValueError("an array of objects")
    if not 0 < dtype.itemsize <= WIDEST:
        raise ValueError(f"an array of {dtype}")
    return dtype.itemsize
