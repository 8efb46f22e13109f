"""A cache of references and truths that runs share, keyed by the content of everything that made them."""

import contextlib
import json
import os
import re
import stat
import time
import uuid
from pathlib import Path

import numpy as np

OWN = re.compile(r"[0-9a-f]{16}(-[0-9a-f]{32})?\.npz")  # a key, and the part of a file that is being written
LIMIT = 2 * 2**30  # bytes; beyond it the files that were not asked for the longest go


class Kept:
    """Arrays by key in a folder; nothing is kept without one."""

    def __init__(self, folder: Path | None):
        self.folder = folder

    def get(self, key: str) -> tuple[dict, dict[str, np.ndarray]] | None:
        """The facts and arrays of `key`; None if they are not there, or not whole."""
        if self.folder is None:
            return None
        path = self.folder / f"{key}.npz"
        try:
            with np.load(path, allow_pickle=False) as file:
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
        part = self.folder / f"{key}-{uuid.uuid4().hex}.npz"  # several runs may be about the same, on several hosts
        with contextlib.suppress(OSError):
            try:
                self.folder.mkdir(parents=True, exist_ok=True)
                np.savez(part, facts=np.array(json.dumps(facts)), **arrays)
                os.replace(part, self.folder / f"{key}.npz")
            finally:
                with contextlib.suppress(OSError):
                    part.unlink(missing_ok=True)
            self._prune()

    def _prune(self) -> None:
        found, now = [], time.time()
        for path in self.folder.glob("*.npz"):
            try:
                state = path.lstat()
            except OSError:  # another run has just pruned it
                continue
            if not (OWN.fullmatch(path.name) and stat.S_ISREG(state.st_mode)):
                continue
            # A time to come is of a clock that was wrong, and says nothing.
            found.append((state.st_mtime if state.st_mtime < now + 3600 else 0.0, state.st_size, path))
        total = sum(size for _, size, _ in found)
        for _, size, path in sorted(found):
            if total <= LIMIT:
                return
            path.unlink(missing_ok=True)
            total -= size
