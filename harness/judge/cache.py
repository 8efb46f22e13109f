"""A cache of references and truths that runs share, keyed by the content of everything that made them.

What is in it decides which picture is right, so a renderer may neither read nor change it. Each file ends in a checksum
(HMAC) by a key of the user, which lies in another folder; of a file that was changed nothing is taken. Renderers cannot
read files in the two folders where the system can keep them from it (process.hide).
"""

import contextlib
import hmac
import io
import json
import os
import re
import secrets
import stat
import time
from functools import cache
from pathlib import Path

import numpy as np

from harness.renderer.builder import state_folder
from harness.system import output

# A key, and the part of a file that is being written; the second form is of versions before this one.
OWN = re.compile(r"[0-9a-f]{16}(\.npz(\.[0-9a-f]{16}\.part)?|-[0-9a-f]{32}\.npz)")
CHECKSUM, KEY = 32, 32  # bytes
LIMIT = 2 * 2**30  # bytes; beyond it the files that were not asked for the longest go


class Kept:
    """Arrays by key in a folder; nothing is kept without one."""

    def __init__(self, folder: Path | None):
        self.folder = folder
        if folder is not None:
            with contextlib.suppress(OSError):
                folder.mkdir(parents=True, exist_ok=True)

    def get(self, key: str) -> tuple[dict, dict[str, np.ndarray]] | None:
        """The facts and arrays of `key`; None if they are not there, or not whole."""
        if self.folder is None:
            return None
        path = self.folder / f"{key}.npz"
        try:
            content = memoryview(path.read_bytes())
            content, checksum = content[:-CHECKSUM], content[-CHECKSUM:]
            if not hmac.compare_digest(checksum, _checksum(key, content)):
                return None
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            with contextlib.suppress(OSError):  # nobody may write there
                os.utime(path)
            return json.loads(str(arrays.pop("facts"))), arrays
        except Exception:  # of many kinds: what was damaged can be anything
            return None

    def put(self, key: str, facts: dict, arrays: dict[str, np.ndarray]) -> None:
        """Keep what JSON can hold, and arrays, where that can be done: what is not kept is made again."""
        if self.folder is None:
            return
        with contextlib.suppress(OSError):
            self.folder.mkdir(parents=True, exist_ok=True)
            file = io.BytesIO()
            np.savez(file, facts=np.array(json.dumps(facts)), **arrays)
            content = file.getbuffer()
            content = b"".join([content, _checksum(key, content)])
            # Several runs may be about the same, on several hosts.
            output.data(self.folder / f"{key}.npz", content, own=False, shared=True)
            self._prune()

    def _prune(self) -> None:
        files, now = [], time.time()
        for path in self.folder.iterdir():
            try:
                state = path.lstat()
            except OSError:  # another run has just pruned it
                continue
            if not (OWN.fullmatch(path.name) and stat.S_ISREG(state.st_mode)):
                continue
            # A time to come is of a clock that was wrong, and says nothing.
            files.append((state.st_mtime if state.st_mtime < now + 3600 else 0.0, state.st_size, path))
        total = sum(size for _, size, _ in files)
        for _, size, path in sorted(files):
            if total <= LIMIT:
                return
            path.unlink(missing_ok=True)
            total -= size


def _checksum(key: str, content) -> bytes:
    return hmac.digest(_secret(), b"".join([key.encode(), b"\0", content]), "sha256")


@cache
def _secret() -> bytes:
    """The key of this user, made once; where none can be kept, one of this process, which takes no file of another."""
    own = secrets.token_bytes(KEY)
    try:
        folder = state_folder()
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        path = folder / "references.key"
        if not path.exists():
            part = folder / f"references.key.{secrets.token_hex(8)}.part"
            output.data(part, own, own=False, sync=True)
            os.chmod(part, 0o600)
            with contextlib.suppress(FileExistsError):  # another process was quicker
                os.link(part, path)
            part.unlink()
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        with open(descriptor, "rb") as file:
            state = os.fstat(descriptor)
            if stat.S_ISREG(state.st_mode) and state.st_uid == os.getuid() and state.st_size == KEY:
                return file.read(KEY)
    except (OSError, RuntimeError, KeyError):  # no home, or nothing can be written there
        pass
    return own
