"""Renders the tiles of a picture: regions, one by one, on the hosts of an executor.

The folder of tiles lies beside the picture until all tiles exist:

    spec.json       `picture`: its description, which must be equal wherever and whenever a tile is rendered; the paths
                    of scene and renderer, and the number of threads
    batches.json    [{tiles: [number, ..], timeout: seconds for each}, ..]: the tasks, numbered by their place
    jobs.jsonl      a line for each task that an executor has accepted: {batch, job, executor}
    N.npy           tile N, which exists whole or not at all: linear RGB, shape (height, width, 3)
    N.json          facts of its rendering
    refused-B.txt   why task B ended before all of its tiles were done
    logs/           of the executor
"""

import contextlib
import json
import os
import re
import shutil
import socket
from dataclasses import asdict, dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from harness.errors import UserError
from harness.machine import environment, fingerprint
from harness.picture.grid import Grid
from harness.process import repetition
from harness.race import row
from harness.renderer import builder, job, registry
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.scene import load
from harness.scene.flatten import flatten
from harness.scene.needs import needs as needs_of
from harness.single import single
from harness.store import lines, store

FORMAT = 1
# Names of all files that rayrace writes there, beside logs/. No other file is ever removed.
OWN = re.compile(r"((spec|batches)\.json|refused-\d+\.txt|\d+(-.+-\d+)?\.(npy|json))(\.part)?|jobs\.jsonl|lock")
BLANK = {"spec.json.part", "lock", "logs"}  # what a folder may contain before it has a spec
AGAIN = "remove {}, and the same command renders the tile again"


def describe(entry: Entry, arrays: dict[str, np.ndarray], parameters: Parameters, side: int) -> dict:
    """The description of a picture in tiles, for JSON. Tiles with equal descriptions fit together. side: pixels."""
    asked = {name: value for name, value in asdict(parameters).items() if name not in ("threads", "region")}
    told = {
        "scene": job.fingerprint(arrays),
        "variant": entry.name,
        "renderer": entry.renderer.version,
        "packages": environment.packages(),
        "parameters": {**asked, "region": parameters.bounds()},
        "tiles": side,
    }
    return json.loads(json.dumps(told))


def changes(before: dict, now: dict) -> str:
    """The differences of two descriptions as text; "" if there are none."""
    found = fingerprint.changes(before, now, tuple(now))
    return ", ".join(f"{name} was {json.dumps(old)}, is {json.dumps(new)}" for name, old, new in found)


class Folder:
    """The folder of the tiles of a picture."""

    def __init__(self, path: Path):
        self.path = Path(path)

    def is_begun(self) -> bool:
        """Whether it is a folder of tiles. UserError if it is another folder."""
        if (self.path / "spec.json").is_file():
            return True
        if self.path.exists() and not {path.name for path in self.path.iterdir()} <= BLANK:
            raise UserError(f"{self.path}: not a folder of tiles", remedy="remove it, or give -o another name")
        return False

    def begin(self, scene: Path, folder: Path, threads: int | str, picture: dict) -> None:
        """Writes spec.json. scene: its file; folder: of the renderer; picture: from `describe`."""
        where = {"scene": str(scene.resolve()), "renderer": str(folder), "threads": threads}
        text = json.dumps({"format": FORMAT, **where, "picture": picture}, indent=1)
        store.write_whole(self.path / "spec.json", text + "\n")

    def forget(self) -> "Folder":
        """Removes the files of another picture, and returns the empty folder. Call it only if there are no tiles."""
        for path in self.path.iterdir():
            if OWN.fullmatch(path.name) and path.name not in BLANK:
                path.unlink()
        return Folder(self.path)

    @cached_property
    def spec(self) -> dict:
        """The content of spec.json. UserError if it is damaged, or of another version."""
        path, remedy = self.path / "spec.json", f"remove {self.path} to start again"
        try:
            found = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            raise UserError(f"{path}: {error}", remedy=remedy) from None
        if found.get("format") != FORMAT:
            raise UserError(f"{path}: expected format {FORMAT}", remedy=remedy)
        return found

    @cached_property
    def grid(self) -> Grid:
        """How the picture is cut into tiles."""
        picture = self.spec["picture"]
        return Grid(tuple(picture["parameters"]["region"]), picture["tiles"])

    def has(self, number: int) -> bool:
        return (self.path / f"{number}.npy").is_file()

    def there(self) -> set[int]:
        """The numbers of the finished tiles."""
        names = (name.removesuffix(".npy") for name in os.listdir(self.path) if name.endswith(".npy"))
        return {int(name) for name in names if name.isdecimal()}

    def keep(self, number: int, array: np.ndarray, facts: dict) -> None:
        """Stores a tile. Two tasks may render the same one: each writes files of its own, and the last ones stay."""
        mine = self.path / f"{number}-{socket.gethostname()}-{os.getpid()}"
        for suffix, write in (
            (".json", lambda path: store.write_whole(path, json.dumps(facts) + "\n")),
            (".npy", lambda path: store.save_whole(path, array)),
        ):
            part = mine.with_name(mine.name + suffix)
            write(part)
            os.replace(part, self.path / f"{number}{suffix}")

    def facts(self, number: int) -> dict:
        """The facts of a tile. UserError if they are damaged."""
        path = self.path / f"{number}.json"
        try:
            return json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise UserError(f"{path}: {error}", remedy=AGAIN.format(f"{number}.npy")) from None

    def tile(self, number: int) -> np.ndarray:
        """A tile (height, width, 3), mapped from its file into memory. UserError if it is damaged."""
        path = self.path / f"{number}.npy"
        try:
            found = np.load(path, mmap_mode="r", allow_pickle=False)
        except ValueError as error:
            raise UserError(f"{path}: {error}", remedy=AGAIN.format("it")) from None
        if found.shape != self.grid.shape(number):
            why = f"has shape {found.shape}, expected {self.grid.shape(number)}"
            raise UserError(f"{path}: {why}", remedy=AGAIN.format("it"))
        return found

    def crop(self, x0: int, y0: int, x1: int, y1: int) -> np.ndarray:
        """Pixels of the picture, (y1 - y0, x1 - x0, 3), counted from the corner of its region. All tiles must exist."""
        side, found = self.grid.side, None
        for top in range(y0 // side * side, y1, side):
            for left in range(x0 // side * side, x1, side):
                tile = self.tile(top // side * self.grid.columns + left // side)
                if found is None:
                    found = np.empty((y1 - y0, x1 - x0, 3), tile.dtype)
                ys = slice(max(y0, top), min(y1, top + side))
                xs = slice(max(x0, left), min(x1, left + side))
                part = tile[ys.start - top : ys.stop - top, xs.start - left : xs.stop - left]
                found[ys.start - y0 : ys.stop - y0, xs.start - x0 : xs.stop - x0] = part
        return found

    def batches(self) -> list[dict]:
        """The content of batches.json; [] if there is none."""
        try:
            return json.loads((self.path / "batches.json").read_text(encoding="utf-8"))
        except FileNotFoundError:
            return []

    def add(self, groups: list[list[int]], timeout: float) -> range:
        """Adds a batch for each group of tiles; returns their numbers. timeout: s for each tile."""
        before = self.batches()
        after = [*before, *({"tiles": group, "timeout": timeout} for group in groups)]
        store.write_whole(self.path / "batches.json", json.dumps(after) + "\n")
        return range(len(before), len(after))

    def submitted(self, batch: int, name: str, executor: str) -> None:
        """Records that an executor has accepted a batch as the job `name`."""
        lines.append(self.path / "jobs.jsonl", {"batch": batch, "job": name, "executor": executor})

    def jobs(self, executor: str) -> dict[int, str]:
        """The job of each batch that this executor has accepted."""
        told = lines.read(self.path / "jobs.jsonl")
        return {line["batch"]: line["job"] for line in told if line["executor"] == executor}

    def refuse(self, batch: int, why: str) -> None:
        """Records why the task of a batch ended."""
        store.write_whole(self.path / f"refused-{batch}.txt", why + "\n")

    def refused(self, batch: int) -> str | None:
        """The reason that the task of a batch recorded; None if there is none."""
        try:
            return (self.path / f"refused-{batch}.txt").read_text(encoding="utf-8").strip()
        except FileNotFoundError:
            return None

    def remove(self) -> None:
        """Removes it, spec.json last, so that it is still a folder of tiles after a kill. Other files stay."""
        for path in self.path.iterdir():
            if path.name == "logs":  # ending jobs may still write there
                shutil.rmtree(path, ignore_errors=True)
            elif OWN.fullmatch(path.name) and path.name != "spec.json":
                path.unlink(missing_ok=True)
        (self.path / "spec.json").unlink(missing_ok=True)
        with contextlib.suppress(OSError):  # not empty: it has files that rayrace did not write
            self.path.rmdir()


def work(folder: str, number: int) -> None:
    """Renders the missing tiles of batch `number`, as the task of an executor; records in the folder why it failed."""
    place = Folder(Path(folder))
    if not place.is_begun() or number >= len(place.batches()):
        print(f"{folder}: the picture is finished, or was started again")
        return
    batch = place.batches()[number]
    try:
        for tile in batch["tiles"]:
            if not place.has(tile):
                _render(place, tile, batch["timeout"])
    except UserError as error:
        place.refuse(number, f"{socket.gethostname()}: {error}")
    except Exception as error:
        place.refuse(number, f"{socket.gethostname()}: {type(error).__name__}: {error}")
        raise


@dataclass(frozen=True)
class _Ready:
    """The inputs of a renderer for all tiles; only the region differs."""

    entry: Entry
    arrays: dict[str, np.ndarray]
    parameters: Parameters
    needs: tuple[str, ...]


@lru_cache(maxsize=1)
def _ready(text: str) -> _Ready:
    """The inputs, from the text of spec.json. UserError if scene, renderer or packages on this host differ from it."""
    spec = json.loads(text)
    picture = spec["picture"]
    entry = registry.find(picture["variant"], registry.entries((Path(spec["renderer"]),)))
    threads = entry.threads() if spec["threads"] == "default" else spec["threads"]
    told = {**picture["parameters"], "region": tuple(picture["parameters"]["region"])}
    parameters = Parameters(**told, threads=threads)
    scene = load(Path(spec["scene"]))
    arrays = flatten(scene, parameters.arithmetic)
    differs = changes(picture, describe(entry, arrays, parameters, picture["tiles"]))
    if differs:
        raise UserError(f"this host would render another picture: {differs}")
    return _Ready(entry, arrays, parameters, needs_of(scene, parameters))


def _render(place: Folder, number: int, timeout: float) -> None:
    ready = _ready((place.path / "spec.json").read_text(encoding="utf-8"))
    region, entry = place.grid.region(number), ready.entry
    parameters = replace(ready.parameters, region=region)
    result = repetition.run(entry, ready.arrays, parameters, ready.needs, timeout, cache=single.kernels(entry))
    if result.status != "ok":
        raise UserError(f"{entry.name}: {result.status} at --region {','.join(map(str, region))}: {result.reason}")
    if changed := entry.renderer.changed():  # either version may have made the tile
        raise UserError(f"{entry.name} was edited during rendering: {', '.join(changed)}")
    facts = {
        "dtype": str(result.array.dtype),
        "render_s": sum(result.said.frames_s),
        "wall_s": result.outcome.wall_s,
        "rays": result.said.rays,
        "bound": single.cut_off(ready.arrays, parameters, result),
        "device": result.said.device,
        "unranked": row.unranked(entry, result.said),
        "host": socket.gethostname(),
        "processor": builder.processor(),
    }
    place.keep(number, result.array, facts)
