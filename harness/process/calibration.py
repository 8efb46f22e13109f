"""Measures the peaks of the machine just before a repetition (peak.cpp): the roof over its times."""

import hashlib
import json
import subprocess
from functools import cache
from pathlib import Path

from harness.renderer import builder

SOURCE = Path(__file__).with_name("peak.cpp")
SECONDS = 0.02  # for each of five kinds of work, so 0.1 s to 0.2 s for all
TIMEOUT = 60.0  # s
# Nothing becomes a vector that is not written as one, or the peak of single numbers would be no such peak.
COMMAND = (
    *("{compiler}", "-std=c++20", "-O3", "-march=native", "-ffp-contract=fast", "-fno-tree-vectorize"),
    *("-fno-tree-slp-vectorize", "-pthread", "{folder}/peak.cpp", "-o", "{build}/peak"),
)


def peaks(threads: int) -> dict:
    """Rates of one thread, and of `threads` if that is more: {"one": {..}, "all": {..}}, or {"unavailable": reason}.

    Each has threads, float32 and float64 (floating-point operations per second of vectors, a fused multiply-add counted
    as two), scalar_float32 and scalar_float64 (of one number at a time), bytes (per second to and from memory, STREAM's
    triad), and vector_bytes, the width of a vector.
    """
    try:
        rates = _measure(1)
        return {"one": rates, "all": _measure(threads) if threads > 1 else rates}
    except PermissionError as error:
        return {"unavailable": f"calibration: {builder.noexec(_program().parent) or error}"}
    except (builder.BuildError, OSError, subprocess.SubprocessError, ValueError) as error:
        return {"unavailable": f"calibration: {error}"}


def _measure(threads: int) -> dict:
    command = [str(_program()), str(threads), str(SECONDS)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=True)
    return json.loads(done.stdout)


@cache
def _program() -> Path:
    content = hashlib.sha256(SOURCE.read_bytes()).hexdigest()
    return builder.make("peak", content, SOURCE.parent, "c++", COMMAND).folder / "peak"
