"""Writes results/reference/kernels.json, what kernels take of GPUs that are not here: python docs/kernels.py [FILE].

NVIDIA's compilers make them (`pip install -e '.[cuda]'`), some minutes on two cores. docs/tables.py makes the table of
docs/on-a-gpu.md from the file, which names the versions of all that has a part in the machine code.
"""

import json
import platform
import sys
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path

from harness import scene
from harness.contract import compile_report
from harness.contract.compile_report import Case
from harness.renderer import registry
from harness.renderer.parameters import Parameters

ROOT = Path(__file__).parents[1]
FILE = ROOT / "results" / "reference" / "kernels.json"
TARGETS = "sm_75", "sm_90", "sm_100"
PRECISIONS = "float32", "float64"
COMPILERS = (
    *("numba", "llvmlite", "numba-cuda", "cuda-bindings"),
    *("nvidia-nvvm", "nvidia-cuda-nvcc", "nvidia-cuda-nvrtc"),  # of numba-cuda the first two, of cuda-cpp the last
)
KEPT = (
    *("variant", "case", "precision", "target", "name", "block", "registers", "spill_store_bytes", "spill_load_bytes"),
    *("local_bytes", "shared_bytes", "constant_bytes", "occupancy", "float64_instructions"),
)
# By the name in the table: a file in experiments/scenes and the parameters that are not usual.
CASES = {
    "mirrors (the comparison)": ("comparison.txt", {"depth": 10}),
    "mirrors with shadows": ("comparison.txt", {"depth": 10, "shadows": True}),
    "a mesh": ("gallery/mesh.txt", {"depth": 6, "shadows": True}),
    "CSG solids": ("gallery/csg.txt", {"depth": 6, "shadows": True}),
    "glossy mirrors": ("gallery/glossy.txt", {"depth": 4, "shadows": True, "glossy_rays": 4}),
    "glass through a lens": (
        "gallery/mirrors-and-glass.txt",
        {"depth": 8, "shadows": True, "lens_radius": 0.1, "focal_distance": 6.0},
    ),
}


def versions() -> dict[str, str]:
    """Versions of all that turns the sources into machine code. PackageNotFoundError without one of them."""
    return {"python": platform.python_version(), **{name: metadata.version(name) for name in COMPILERS}}


def cases(names: Iterable[str] = CASES, precisions: Iterable[str] = PRECISIONS) -> list[Case]:
    found = []
    for name in names:
        path, more = CASES[name]
        loaded = scene.load(ROOT / "experiments" / "scenes" / path)
        found += [Case(name, loaded, Parameters(width=512, height=512, precision=one, **more)) for one in precisions]
    return found


def kernels(wanted: list[Case], targets: tuple[str, ...] = TARGETS) -> list[dict]:
    """A row for each kernel. RuntimeError with the reason if one cannot be compiled."""
    rows = list(compile_report.examine(compile_report.find(registry.entries()), wanted, targets))
    for row in rows:
        if row["status"] != "ok":
            raise RuntimeError(f"{row['variant']}, {row['case']}, {row['precision']}: {row['reason']}")
    return [{name: row[name] for name in KEPT} for row in rows]


if __name__ == "__main__":
    to = Path(sys.argv[1]) if len(sys.argv) > 1 else FILE
    rows = ",\n".join(json.dumps(row) for row in kernels(cases()))
    to.write_text(f'{{"versions": {json.dumps(versions())},\n"kernels": [\n{rows}\n]}}\n', encoding="utf-8")
