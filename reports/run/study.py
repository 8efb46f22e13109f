"""Holds the study's own numbers, by our names of variants and by what was rendered, "one pixel" or "all".

Source: the study, tables 2.1, 4.1, 4.2 and section 4.2.1. Each number is (mean, ±, measurements); the study does not
say what its ± is.
"""

from pathlib import Path

from harness.statistics.statistics import Estimate
from reports.run.results import Cell, Missing

MACHINE = {  # table 2.1; the cores from section 4.2.2
    "operating system": "Microsoft Windows 10 Home",
    "processor": "Intel(R) Core(TM) i7-6700HQ CPU @ 2.60GHz, 2592 Mhz",
    "cores": "8 logical",
    "memory": "8.0 GB DDR3",
    "disk": "TOSHIBA MQ02ABD100H",
    "GPU": "NVIDIA GeForce GTX 950M",
}

TIMES_S = {  # table 4.1
    "python": {"one pixel": (0.0365, 0.0005, 10), "all": (14800, 100, 5)},
    "numba": {"one pixel": (0.0051, 0.0002, 10), "all": (149, 1, 10)},
    "cpp": {"one pixel": (0.000149, 0.000006, 10), "all": (11.22, 0.03, 10)},
    "numba-parallel": {"one pixel": (0.0041, 0.0001, 10), "all": (95.6, 0.4, 10)},
    "cpp-threads": {"one pixel": (0.000140, 0.000008, 10), "all": (3.22, 0.02, 10)},
    "numba-cuda": {"one pixel": (0.0075, 0.0003, 10), "all": (10.112, 0.002, 10)},
}

COMPILE_S = {  # section 4.2.1: "about", without a ±
    "numba": {"all": (30, None, 1)},
    "numba-parallel": {"all": (35, None, 1)},
    "numba-cuda": {"all": (15, None, 1)},
}

RSS_MB = {  # table 4.2; none of CUDA
    "python": {"all": (73, 2, 10)},
    "numba": {"all": (202.1, 0.5, 10)},
    "cpp": {"all": (8.3, 0.1, 10)},
    "numba-parallel": {"all": (200.2, 0.6, 10)},
    "cpp-threads": {"all": (8.61, 0.05, 10)},
}

VMS_MB = {  # table 4.2; psutil on Windows: committed memory, not address space
    "python": {"all": (54.3, 0.7, 10)},
    "numba": {"all": (178.0, 0.3, 10)},
    "cpp": {"all": (4.8, 0.2, 10)},
    "numba-parallel": {"all": (182.2, 0.4, 10)},
    "cpp-threads": {"all": (4.93, 0.06, 10)},
}

NUMBERED = {  # its tables and figures of results: what each shows, and the experiment that repeats it
    "table 2.1": ("the machine", "comparison"),
    "figure 2.5": ("a scene by local light", "gallery"),
    "figure 2.6": ("colours added in linear RGB and in sRGB", "gallery"),
    "figure 2.7": ("time against the total number of threads of a GPU", "launch-threads"),
    "figure 2.8": ("time against the block size of a GPU", "launch-blocks"),
    "figure 2.9": ("wrong pictures of shared memory", "launch-faults"),
    "figure 2.11": ("local light alone, and global light", "gallery"),
    "figure 3.1": ("edges without supersampling and with it", "gallery"),
    "figure 3.2": ("a mesh", "gallery"),
    "figure 3.3": ("Boolean operations", "gallery"),
    "figure 3.4": ("depth of field", "gallery"),
    "figure 3.5": ("hard and soft shadows", "gallery"),
    "figure 3.6": ("perfect and glossy mirrors", "gallery"),
    "table 4.1": ("times", "comparison"),
    "figure 4.1": ("the pictures", "comparison"),
    "figure 4.2": ("use of the processor", "comparison"),
    "table 4.2": ("memory", "comparison"),
    "figure 4.3": ("use of the GPU", "comparison"),
}
ON_A_GPU = ("figure 2.7", "figure 2.8", "figure 2.9", "figure 4.3")

VARIABLES = {"width": 512, "height": 512, "depth": 10, "shadows": 0, "precision": "float64"}


def case(cell: Cell) -> str | None:
    """Returns the case of the study that a cell repeats, "one pixel" or "all"; None if scene or variables differ."""
    if Path(cell.scene).stem != "comparison" or {"objects", "lights"} & set(cell.swept):
        return None
    if any(cell.parameters[key] != value for key, value in VARIABLES.items()):
        return None
    return {1: "one pixel", 512 * 512: "all"}.get(cell.pixels)


def heading(cells: list[Cell], what: str, number: str) -> str:
    """Returns a heading, with the number of the study's figure or table where a cell repeats a case of the study."""
    return f"{what} (the study's {number})" if any(map(case, cells)) else what


def find(numbers: dict, cell: Cell) -> Estimate | Missing:
    """Returns the study's number for the case and variant of a cell, with the ends of its ± as low and high."""
    what = case(cell)
    if what is None:
        return Missing("the study has another scene or size")
    entry = numbers.get(cell.variant, {}).get(what)
    if entry is None:
        return Missing("not in the study")
    mean, half, measurements = entry
    if half is None:
        return Estimate(mean, None, None, measurements, "the study says about")
    return Estimate(mean, mean - half, mean + half, measurements, "low and high are the study's ±")


def show(value: Estimate) -> str:
    """Formats a value as the study prints it."""
    if value.low is None:
        return f"about {value.value:g}"
    pair = value.value, (value.high - value.low) / 2
    places = max(len(f"{number:f}".rstrip("0").partition(".")[2]) for number in pair)
    return f"{pair[0]:.{places}f} ± {pair[1]:.{places}f}"
