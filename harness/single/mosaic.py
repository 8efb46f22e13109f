"""Renders a picture in tiles by an executor, and assembles it (tiles.py)."""

import json
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from harness import executors, setting, toml
from harness.errors import UserError
from harness.experiment import cluster
from harness.picture import picture
from harness.picture.grid import Grid
from harness.process import repetition
from harness.renderer import registry
from harness.renderer.parameters import Parameters
from harness.scene import load, warnings
from harness.scene.flatten import flatten
from harness.scene.needs import needs as needs_of
from harness.single import single, tiles
from harness.single.following import Following, Tell
from harness.system import lock, output

NOT_JUDGED = "not measured; pictures in tiles are not compared with a reference"
SHARED = "corners on the edge of two tiles are counted in both (SAM-5)"


@dataclass(frozen=True)
class Way:
    """The executor of the tiles. table: cluster.Slurm, cluster.Dask or None. cells: tiles in a job, at most."""

    name: str
    table: object
    cells: int


def way(name: str, settings: tuple[str, ...], address: str) -> Way:
    """The Way for --executor, --slurm and --dask. UserError for options that contradict each other."""
    if settings and name != "slurm":
        raise UserError("--slurm: only with --executor slurm")
    if (name == "dask") != bool(address):
        raise UserError("--executor dask and --dask ADDRESS (of the scheduler) go together")
    if name == "slurm":
        tables = {}
        for each in settings:
            setting.put(tables, each, "--slurm", "partition=long or time='2 h'")
        table = toml.validated(cluster.Slurm, tables, Path("--slurm"))
        return Way(name, table, table.cells)
    if name == "dask":
        table = cluster.Dask(scheduler=address)
        return Way(name, table, table.cells)
    return Way(name or "local", None, 1)


def render(scene, variant, out, image, side, way: Way, timeout, folders, as_json) -> None:
    """Renders `scene` to the picture `out` in tiles of at most side x side pixels, and prints its facts.

    timeout: s for each tile. SystemExit(1) if tiles are missing in the end; the same command then renders those alone.
    """
    if out.suffix not in picture.ANY_SIZE:
        raise UserError(f"{out}: with --tiles the picture must be {' or '.join(picture.ANY_SIZE)}")
    picture.check_suffix(out)
    read = load(scene)
    parameters = image.parameters(1, 0)
    needs = needs_of(read, parameters)
    grid = Grid(parameters.bounds(), side)
    tile = replace(parameters, region=grid.region(0))
    entry = single.pick(variant, registry.entries(folders), tile, needs)
    reason = repetition.unsupported(entry, tile, needs)
    if reason:
        raise UserError(f"{entry.name} is unsupported: {reason}")
    if way.name == "local" and entry.unavailable:  # other hosts may have what this one lacks
        raise UserError(f"{entry.name} is unavailable: {entry.unavailable}")
    now = tiles.describe(entry, flatten(read, parameters.arithmetic), parameters, side)
    doubts = warnings(read, [parameters])
    del read

    place = tiles.Folder(out.with_name(out.name + ".tiles"))
    executor = executors.find(way.name, way.table, place.path / "logs")
    begun = time.monotonic()
    with _alone(place):
        if place.is_begun() and (differs := tiles.changes(place.spec["picture"], now)):
            if place.there():
                why = f"{place.path} has tiles of another picture: {differs}"
                raise UserError(why, remedy="remove it to start again")
            place = place.forget()
        place.begin(scene, entry.renderer.folder, image.threads, now)
        kept = len(place.there())
        if kept:
            print(f"{kept} of {grid.count} tiles are already in {place.path}", file=sys.stderr)
        following = Following(place, executor, way.name, way.cells, timeout)
        if way.name != "local":
            jobs = f"{following.due} to be submitted, {len(following.live)} submitted before"
            print(f"{following.missing} tiles to be rendered by jobs: {jobs}", file=sys.stderr)
        try:
            with progress() as tell:
                following.run(tell)
            _stop_unless_whole(following)
            found = facts(out, place, entry.name, kept)
            picture.write(out, grid.height, grid.width, found["dtype"], place.crop)
        except KeyboardInterrupt:
            _say_stopped(following)
            raise
        following.wait()
        place.remove()
    found["warnings"] = single.warn(doubts)
    found["took_s"] = time.monotonic() - begun
    print(json.dumps(found)) if as_json else tell_people(found, parameters)


@contextmanager
def _alone(place: tiles.Folder) -> Iterator[None]:
    """Locks the folder while tiles are submitted and assembled, so that two commands do not do the same work."""
    place.is_begun()
    output.make_folder(place.path)
    with ExitStack() as stack:
        try:
            stack.enter_context(lock.of_file(place.path / "lock"))
        except lock.Busy:
            raise UserError(f"{place.path}: another rayrace is at work on it") from None
        except lock.NoLocks:  # tiles that are rendered twice are still right
            pass
        yield


@contextmanager
def progress() -> Iterator[Tell]:
    """Yields a function to call for each new tile: it moves a bar on a terminal, or prints a line."""
    if not sys.stderr.isatty():
        yield lambda done, count, told: print(f"[{done}/{count}] {told}", file=sys.stderr, flush=True)
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("tiles", total=None)
        yield lambda done, count, told: bar.update(task, completed=done, total=count, description=escape(told))


def _say_stopped(following: Following) -> None:
    place = following.place.path
    print(f"stopped; finished tiles stay in {place}; the same command goes on", file=sys.stderr)
    jobs = [following.names[batch] for batch in following.live]
    if jobs and following.name != "local":
        shown = ", ".join([*jobs[:5], *(["..."] if len(jobs) > 5 else [])])
        print(f"{len(jobs)} jobs of --executor {following.name} go on: {shown}", file=sys.stderr)


def _stop_unless_whole(following: Following) -> None:
    if not following.missing:
        return
    for reason, count in following.reasons.most_common():
        print(f"{count} {'job' if count == 1 else 'jobs'}: {reason}", file=sys.stderr)
    left = f"{following.missing} of {following.count} tiles are missing"
    logs = "" if following.name == "local" else f"; output of the jobs is in {following.place.path / 'logs'}"
    raise SystemExit(f"error: {left}; the same command renders those alone{logs}")


def facts(out: Path, place: tiles.Folder, name: str, kept: int) -> dict:
    """The facts of a complete picture for JSON. kept: number of tiles from an earlier command. UserError if the tiles
    have different types."""
    grid = place.grid
    found = [place.facts(tile) for tile in range(grid.count)]
    kinds = {told["dtype"] for told in found}
    if len(kinds) > 1:
        why = f"{name} returned tiles of {' and of '.join(sorted(kinds))}"
        raise UserError(f"{place.path}: {why}", remedy="render it without --tiles")
    counts = [told["rays"] for told in found]
    rays = None if None in counts else {kind: sum(each.get(kind, 0) for each in counts) for kind in counts[0]}
    areas = [rows * columns for rows, columns, _ in map(grid.shape, range(grid.count))]
    limits = [told["bound"] for told in found]
    mean = None
    if None not in limits:
        mean = sum(limit["mean"] * area for limit, area in zip(limits, areas, strict=True)) / sum(areas)
    is_adaptive = place.spec["picture"]["parameters"]["sampler"] == "adaptive"
    return {
        "picture": str(out),
        "renderer": name,
        "width": grid.width,
        "height": grid.height,
        "dtype": kinds.pop(),
        "tiles": grid.count,
        "kept": kept,
        "render_s": sum(told["render_s"] for told in found),
        "wall_s": sum(told["wall_s"] for told in found),
        "rays": rays,
        "rays_note": SHARED if rays and is_adaptive and grid.count > 1 else None,
        "bound": None if mean is None else {"max": max(limit["max"] for limit in limits), "mean": mean},
        "agreement": {"unavailable": NOT_JUDGED},
        "error": {"unavailable": NOT_JUDGED},
        "device": found[0]["device"],
        "unranked": found[0]["unranked"],
        "hosts": sorted({told["host"] for told in found}),
        "processors": len({told["processor"] for told in found}),
    }


def tell_people(found: dict, parameters: Parameters) -> None:
    """Prints the facts of a picture for people."""
    counts, hosts = found["rays"], found["hosts"]
    traced = single.traced(counts) + (" of the tiles" if found["rays_note"] else "")
    kept = f", {found['kept']} of them from an earlier command" if found["kept"] else ""
    places = hosts[0] if len(hosts) == 1 else f"{len(hosts)} hosts"
    size = f"{Path(found['picture']).stat().st_size / 1e6:,.4g} MB"
    print(
        f"{found['picture']}: {found['width']} x {found['height']}, {size}, {found['renderer']}, "
        f"{parameters.precision}: {found['tiles']} tiles{kept}, {found['render_s']:.4g} s of rendering on {places}, "
        f"{found['took_s']:.3g} s in all, {traced}"
    )
    single.tell_doubts(found)
    if found["processors"] > 1:
        print("note: rendered by hosts with different processors: last digits may differ", file=sys.stderr)
    print(f"error and agreement unavailable: {NOT_JUDGED}")
