"""Packs a run into one file, NAME.tar.xz, small enough to commit or send, without loss.

What store.py describes is in it but for files that are empty. An array of numbers, PATH.npy, is stored as
PATH.npy.planes: its header, then the first bytes of all numbers, their second bytes and so on (HDF5 and Blosc call this
shuffling). Pictures that differ in their last bits are alike in most planes, and xz finds what repeats.
"""

import io
import lzma
import re
import shutil
import tarfile
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from harness.errors import UserError
from harness.store import store

SUFFIX, PLANES = ".tar.xz", ".planes"
MEMBER = re.compile(
    r"jobs\.jsonl|(parts/[\w-][\w.-]*/)?(run\.json|end\.json|repetitions\.jsonl|(pictures|series|logs)/[\w.-]+)"
)
TEXTS = "run.json", "end.json", "repetitions.jsonl", "jobs.jsonl"  # of a run, or a part of one
LARGEST = 4 << 30  # bytes of what is unpacked: a small file of a stranger can hold any number of zeros
RATIO, ANY = 1000, 1 << 28  # times its size, that a run of more bytes than ANY may unpack to: of real ones it is 20
PIECE = 1 << 20  # bytes, or numbers, of what is unpacked that are in memory at once
WIDEST = 64  # bytes of a number
REACH = 1 << 26  # bytes: how far back xz looks for what repeats, some ten pictures


def is_packed(run: Path) -> bool:
    return run.name.endswith(SUFFIX) and not run.is_dir()


def name(run: Path) -> str:
    """The name of a run: that of its folder, or of its file without .tar.xz."""
    return run.resolve().name.removesuffix(SUFFIX)


def pack(folder: Path, file: Path, pictures: bool = True) -> None:
    """Write the run in `folder` to `file`, the same bytes for the same run; without `pictures` only what they came to.

    UserError if it is no run.
    """
    store.read(folder, list(store.hosts(folder)))
    places = [folder, *sorted(path.parent for path in folder.glob("parts/*/run.json"))]
    texts = [path for place in places for name in TEXTS if (path := place / name).exists()]
    rows = [path.read_text(encoding="utf-8") for path in texts if path.name == "repetitions.jsonl"]
    mentioned = re.findall(r'"(?:pictures/)?([\w.-]+\.npy)"', "".join(rows))
    order = {found: number for number, found in reversed(list(enumerate(mentioned)))}
    arrays = [path for place in places for path in (place / "pictures").glob("*.npy")] if pictures else []
    arrays.sort(key=lambda path: (order.get(path.name, len(order)), str(path)))
    others = [path for place in places for part in ("series", "logs") for path in sorted((place / part).glob("*"))]
    others = [path for path in others if path.stat().st_size]
    filters = [{"id": lzma.FILTER_LZMA2, "preset": 6, "dict_size": REACH}]

    def write(out) -> None:
        with lzma.open(out, "wb", filters=filters) as packed, tarfile.open(fileobj=packed, mode="w|") as tar:
            for path in (*texts, *others, *arrays):
                data, inside = path.read_bytes(), path.relative_to(folder).as_posix()
                if path.suffix == ".npy":
                    data, inside = _planes(data), inside + PLANES
                member = tarfile.TarInfo(inside)
                member.size = len(data)
                tar.addfile(member, io.BytesIO(data))

    store.write_part(file, write, own=False)


@contextmanager
def opened(run: Path) -> Iterator[Path]:
    """The folder of a run, for as long as it is needed: `run` itself, or where a packed run is unpacked.

    UserError if the file is damaged, too large, or holds what a run does not.
    """
    if not is_packed(run):
        yield run
        return
    with tempfile.TemporaryDirectory() as around:
        folder = Path(around) / name(run)
        _unpack(run, folder)
        yield folder


def _unpack(file: Path, folder: Path) -> None:
    left = min(LARGEST, max(ANY, RATIO * file.stat().st_size)) if file.exists() else 0
    for part in ("pictures", "series", "logs"):
        (folder / part).mkdir(parents=True)
    try:
        with lzma.open(file) as packed, tarfile.open(fileobj=packed, mode="r|") as tar:
            for member in tar:
                left -= member.size
                if not member.isreg() or not MEMBER.fullmatch(member.name):
                    raise UserError(f"{file}: no packed run: it holds {member.name!r}")
                if left < 0:
                    raise UserError(
                        f"{file}: more than {LARGEST >> 30} GiB when unpacked, or than {RATIO} times its size"
                    )
                path = folder / member.name
                path.parent.mkdir(parents=True, exist_ok=True)
                with open(path, "wb") as file_inside:
                    shutil.copyfileobj(tar.extractfile(member), file_inside, PIECE)
                if path.suffix == PLANES:
                    _numbers(path, path.with_suffix(""))
                    path.unlink()
    except (OSError, EOFError, lzma.LZMAError, tarfile.TarError, ValueError, OverflowError) as error:
        raise UserError(
            f"{file}: not a packed run: {error}", remedy="make one with: rayrace export RUN --format packed -o FILE"
        ) from None


def _planes(npy: bytes) -> bytes:
    """The planes of an .npy file."""
    file = io.BytesIO(npy)
    size = _head(file)
    numbers = np.frombuffer(npy, np.uint8, offset=file.tell()).reshape(-1, size)
    return npy[: file.tell()] + numbers.T.tobytes()


def _numbers(planes: Path, npy: Path) -> None:
    """Make the .npy file of its planes, a piece at a time: a small file can be packed of any number."""
    with open(planes, "rb") as file, open(npy, "wb") as out:
        size = _head(file)
        start = file.tell()
        count, rest = divmod(planes.stat().st_size - start, size)
        if rest:
            raise ValueError("planes that are not of one length")
        file.seek(0)
        out.write(file.read(start))
        for first in range(0, count, PIECE):
            some = np.empty((min(PIECE, count - first), size), np.uint8)
            for plane in range(size):
                file.seek(start + plane * count + first)
                some[:, plane] = np.frombuffer(file.read(len(some)), np.uint8)
            out.write(some.tobytes())


def _head(file: BinaryIO) -> int:
    """Read the header of an .npy file: the bytes of one of its numbers. ValueError if it is none."""
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    try:
        _, _, dtype = read(file)
    except Exception as error:  # of many kinds: it is parsed as Python
        raise ValueError(f"no header of an array: {error}") from None
    if dtype.hasobject:
        raise ValueError("an array of objects")
    if not 0 < dtype.itemsize <= WIDEST:
        raise ValueError(f"an array of {dtype}")
    return dtype.itemsize
