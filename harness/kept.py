"""Pictures that runs share: each made once, kept by the content of all that made it."""

import json
import os
import zipfile
from pathlib import Path

import numpy as np

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
            os.utime(path)
            return json.loads(str(arrays.pop("facts"))), arrays
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None

    def put(self, key: str, facts: dict, arrays: dict[str, np.ndarray]) -> None:
        """Keep what JSON can hold, and arrays."""
        if self.folder is None:
            return
        self.folder.mkdir(parents=True, exist_ok=True)
        part = self.folder / f"{key}-{os.getpid()}.npz"  # several runs may be about the same
        np.savez(part, facts=np.array(json.dumps(facts)), **arrays)
        os.replace(part, self.folder / f"{key}.npz")
        self._prune()

    def _prune(self) -> None:
        found = []
        for path in self.folder.glob("*.npz"):
            try:
                state = path.stat()
            except OSError:  # another run has just pruned it
                continue
            found.append((state.st_mtime, state.st_size, path))
        total = sum(size for _, size, _ in found)
        for _, size, path in sorted(found):
            if total <= LIMIT:
                return
            path.unlink(missing_ok=True)
            total -= size
