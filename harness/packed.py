"""A run in one file, NAME.tar.xz: small enough to be committed or sent, and nothing of it lost.

What store.py describes is in it but for files that are empty. An array of numbers, PATH.npy, is stored as
PATH.npy.planes: its header, then the first bytes of all numbers, their second bytes and so on (HDF5 and Blosc call this
shuffling). Pictures that differ in their last bits are alike in most planes, and xz finds what repeats.
"""

import io
import lzma
import re
import tarfile
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from harness import store
from harness.errors import UserError

SUFFIX, PLANES = ".tar.xz", ".planes"
MEMBER = re.compile(r"(run\.json|repetitions\.jsonl|(pictures|series|logs)/[\w.-]+)")
LARGEST = 4 << 30  # bytes of what is unpacked: a small file of a stranger can hold any number of zeros
REACH = 1 << 26  # bytes: how far back xz looks for what repeats, some ten pictures


def is_packed(run: Path) -> bool:
    return run.name.endswith(SUFFIX) and not run.is_dir()


def name(run: Path) -> str:
    """What a run is called: the name of its folder, or of its file without .tar.xz."""
    return run.resolve().name.removesuffix(SUFFIX)


def pack(folder: Path, file: Path, pictures: bool = True) -> None:
    """Write the run in `folder` to `file`, the same bytes for the same run; without `pictures` only what they came to.

    UserError if it is no run.
    """
    store.read(folder)
    texts = [folder / "run.json", folder / "repetitions.jsonl"]
    mentioned = re.findall(r'"(?:pictures/)?([\w.-]+\.npy)"', texts[1].read_text(encoding="utf-8"))
    place = {found: number for number, found in reversed(list(enumerate(mentioned)))}
    arrays = sorted((folder / "pictures").glob("*.npy"), key=lambda path: (place.get(path.name, len(place)), path.name))
    arrays = arrays if pictures else []
    others = sorted(path for part in ("series", "logs") for path in (folder / part).glob("*") if path.stat().st_size)
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

    store.write_part(file, write)


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
    left = LARGEST
    for part in ("pictures", "series", "logs"):
        (folder / part).mkdir(parents=True)
    try:
        with lzma.open(file) as packed, tarfile.open(fileobj=packed, mode="r|") as tar:
            for member in tar:
                left -= member.size
                if not member.isreg() or not MEMBER.fullmatch(member.name):
                    raise UserError(f"{file}: no packed run: it holds {member.name!r}")
                if left < 0:
                    raise UserError(f"{file}: more than {LARGEST >> 30} GiB when unpacked")
                data = tar.extractfile(member).read()
                path = folder / member.name
                if path.suffix == PLANES:
                    path, data = path.with_suffix(""), _numbers(data)
                path.write_bytes(data)
    except (OSError, EOFError, lzma.LZMAError, tarfile.TarError, ValueError) as error:
        raise UserError(
            f"{file}: not a packed run: {error}", remedy="make one with: rayrace export RUN --format packed -o FILE"
        ) from None


def _planes(npy: bytes) -> bytes:
    head, numbers = _parts(npy)
    return head + numbers.T.tobytes()


def _numbers(planes: bytes) -> bytes:
    head, found = _parts(planes)
    return head + found.reshape(found.shape[::-1]).T.tobytes()


def _parts(npy: bytes) -> tuple[bytes, np.ndarray]:
    """The header of an .npy file, and its bytes by numbers, (count, bytes of one). ValueError if it is none."""
    file = io.BytesIO(npy)
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    _, _, dtype = read(file)
    if dtype.hasobject:
        raise ValueError("an array of objects")
    return npy[: file.tell()], np.frombuffer(npy, np.uint8, offset=file.tell()).reshape(-1, dtype.itemsize)
