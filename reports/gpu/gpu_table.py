"""Tabulates GPU cells: parts of a frame, launch shape and resources of the kernel, observations of the device."""

from pathlib import Path

from reports.accuracy import accuracy_columns
from reports.paper import quantity, table
from reports.paper.table import Column
from reports.run import gpu
from reports.run.results import Cell, Missing, Results

TIMES = (
    "kernel: by CUDA events; download: the picture to the host; frame: a steady one, which includes both; upload: the "
    "scene to the device, once per process. End to end: upload + a steady frame, as if for one picture, without "
    "starting the process and compiling. Median over processes, with its 95 % interval, of each process's median over "
    "its steady frames."
)
LAUNCH = (
    "Memory kind: where the kernel keeps the scene. Occupancy: the threads that a multiprocessor can hold at once with "
    "these registers and this shared memory, over those that the device allows; it is computed, not measured. Local "
    "memory belongs to one thread and receives spilled registers."
)
DEVICE = (
    "From NVML, median over processes, with its 95 % interval, of the repeated-load pass, else of the timed one, as "
    "the column says. Power and energy are the whole device's, idle power included; the column after the energy says "
    "over which time, within the phase render. A value is unavailable where rendering is too short for the sensors."
)


def _time(title: str, name: str, reason: str) -> Column:
    return Column(title, name, "s", lambda cell: cell.median(name, reason))


NO_PARTS = "no steady frames that report their parts"
NO_UPLOAD = "it has no phase upload"
TIME_COLUMNS = [
    _time("upload", "upload_s", NO_UPLOAD),
    _time("kernel", "kernel_s", NO_PARTS),
    _time("download", "download_s", NO_PARTS),
    _time("frame", "steady_s", "no steady frames"),
    _time("end to end", "end_to_end_s", f"{NO_UPLOAD}, or no steady frames"),
    *accuracy_columns.ERRORS,
]


def launch_columns(results: Results) -> list[Column]:
    def method(title, name, unit="", show=_count):
        show = quantity.size if unit == "byte" else show
        return Column(title, name, unit, lambda cell: _method(results, cell, name), show)

    records = [gpu.record(results, cell) for scene in gpu.scenes(results) for cell in gpu.cells(results, scene)]
    methods = [record["used"].get("methods") or {} for record in records if record]
    spills = sorted({name for names in methods for name in names if name.startswith("spill")})
    return [
        method("memory kind", "scene_memory"),
        method("block", "block"),
        method("threads", "total_threads", "1"),
        method("registers", "registers", "1"),
        method("shared memory", "shared_bytes", "byte"),
        method("local memory", "local_bytes", "byte"),
        method("constant memory", "constant_bytes", "byte"),
        *(method(name.replace("_", " "), name) for name in spills),
        method("occupancy (%)", "occupancy", "1", lambda v: v if isinstance(v, str) else f"{100 * v:.0f}"),
    ]


def _method(results: Results, cell: Cell, name: str):
    used = gpu.method(results, cell, name)
    return used if isinstance(used, Missing | str) else float(used)


def _count(value) -> str:
    return value if isinstance(value, str) else f"{value:.0f}"


def device_columns(results: Results) -> list[Column]:
    def seen(title, name, unit):
        return Column(title, name, unit, lambda cell: gpu.observed(results, cell, name))

    return [
        Column("pass", "pass", "", lambda cell: "load" if cell.loaded else "timed"),
        seen("GPU use (%)", "utilisation_percent", "%"),
        seen("power (W)", "power_w", "W"),
        seen("energy (J)", "energy_j", "J"),
        seen("over", "energy_s", "s"),
        seen("energy per million rays (J)", "joules_per_mray", "J"),
        seen("memory of the process", "process_memory_bytes", "byte"),
        seen("temperature (°C)", "temperature_c", "°C"),
        Column("slowed down by", "throttled", "", lambda cell: _throttled(results, cell)),
    ]


def _throttled(results: Results, cell: Cell) -> str | Missing:
    """Returns why the device ran slower than it could, over all observed repetitions."""
    readings = [(results.records[index]["gpu"] or {}).get("throttled") for index in gpu.observed_rows(cell).index]
    lists = [reasons for reasons in readings if isinstance(reasons, list)]
    if lists:
        return ", ".join(sorted({reason for reasons in lists for reason in reasons})) or "nothing"
    return gpu.observed(results, cell, "throttled")


def write(results: Results, out: Path) -> str:
    """Writes gpu-times-*.csv, gpu-launch-*.csv, gpu-device-*.csv per scene; returns the section, "" without a GPU."""
    by_scene = [(scene, gpu.cells(results, scene)) for scene in gpu.scenes(results)]
    if not by_scene:
        return ""
    return "\n\n".join(
        table.section(out, stem, title, [(scene, cells, columns) for scene, cells in by_scene], caption)
        for stem, title, columns, caption in (
            ("gpu-times", "GPU: parts of a frame", TIME_COLUMNS, TIMES),
            ("gpu-launch", "GPU: the kernel", launch_columns(results), LAUNCH),
            ("gpu-device", "GPU: the device at work", device_columns(results), DEVICE),
        )
    )
