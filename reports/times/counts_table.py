"""Tabulates the instructions of a steady frame (the pass "count" of a run): a ray, a pixel, and by which tool."""

from pathlib import Path

from reports.paper import quantity, table
from reports.paper.table import Column
from reports.run.results import Cell, Missing, Results

TITLE = "Instructions"
CAPTION = (
    "Instructions of a frame in user space, by all threads and child processes, counted after everything that was "
    "timed: what processes with more frames took more, divided by those frames. Spread: by what share two such "
    "differences, of three processes, disagree. perf reads the counters of the processor, for the picture that was "
    "timed. Valgrind simulates a processor: threads take turns, and a picture or a build other than what was timed is "
    "named. Counts are not times: an instruction takes less than a cycle or, waiting for memory, hundreds."
)
OF_PERF = "Valgrind counts instructions alone", "perf did not count it, or only a part of the time"


def write(results: Results, out: Path) -> str:
    """Writes instructions-*.csv for each scene; returns the section of the report, "" of a run that counted nothing."""
    if not results.counted:
        return ""
    tables = [(scene, results.of(scene), _columns(results)) for scene in results.scenes]
    return table.section(out, "instructions", TITLE, tables, CAPTION)


def _columns(results: Results) -> list[Column]:
    """The columns that counts of a run can fill."""

    def column(title: str, name: str, value, unit: str = "", **more) -> Column:
        def of(cell: Cell):
            counts = results.counts(cell)
            return counts if isinstance(counts, Missing) else value(counts)

        return Column(title, name, unit, of, **more)

    columns = [
        column("a ray", "instructions_per_ray", _per_ray, show=_whole),
        column(
            "a pixel", "instructions_per_pixel", lambda c: c["instructions"] / (c["width"] * c["height"]), show=_whole
        ),
        column("a frame", "instructions", lambda c: c["instructions"], show=_whole),
        column("spread (%)", "spread", _spread, "1", scale=100),
    ]
    if any((record.get("counts") or {}).get("tool") == "perf" for record in results.counted.values()):
        columns += [
            column("instructions a cycle", "instructions_per_cycle", _share("instructions", "cycles")),
            column("mispredicted branches (%)", "branch_misses", _share("branch_misses", "branches"), "1", scale=100),
            column("cache misses a frame", "cache_misses", _share("cache_misses"), show=_whole),
        ]
    return [*columns, column("counted by", "counted_by", _by)]


def _per_ray(counts: dict):
    return counts["instructions"] / counts["rays"] if counts["rays"] else Missing("it reports no rays")


def _spread(counts: dict):
    return Missing("the differences were not positive") if counts["spread"] is None else counts["spread"]


def _share(name: str, of: str = ""):
    """A function that returns a count, or the ratio of two, or why there is none."""

    def value(counts: dict):
        if name not in counts or (of and not counts.get(of)):
            return Missing(OF_PERF[counts["tool"] == "perf"])
        return counts[name] / counts[of] if of else counts[name]

    return value


def _whole(value) -> str:
    return quantity.text(value) if isinstance(value, Missing) else quantity.plain(value)


def _by(counts: dict) -> str:
    """The tool, and what differs from what was timed."""
    size = f"{counts['width']} × {counts['height']} pixels" if counts["smaller"] else ""
    set_to = [f"{name}={value}" for name, value in counts["environment"].items()]
    return ", ".join(filter(None, [f"{counts['tool']} {counts['version']}", size, *counts["options"], *set_to]))
