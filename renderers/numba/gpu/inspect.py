"""Reports the GPU resources of a job's kernels by compiling them: needs NVIDIA's compilers, but no GPU.

`python -m renderers.numba.gpu.inspect --job=.. .. --targets=sm_75,sm_90`: the flags of a job, and compute capabilities.
Prints an event `kernel` for each kernel and target (README.md in the folder above renderers).
"""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace

from renderers import worker

from .. import needs
from ..main import prepare


def main(arguments):
    job = worker.Job(arguments)
    targets = next(a.removeprefix("--targets=") for a in arguments if a.startswith("--targets=")).split(",")
    os.environ.pop("NUMBA_ENABLE_CUDASIM", None)
    prepare(job)
    if needs.TARGET != "cuda":
        worker.refuse(f"{job.variant} runs on no GPU")
    ptxas = find_ptxas()
    if ptxas is None:
        worker.refuse("no ptxas (pip install 'rayrace[cuda]')")
    kernels = list(kernels_of(job))
    for target in targets:
        for function, arguments_of_it in kernels:
            start = time.monotonic()
            ptx = compile_ptx(function, arguments_of_it, target, None if job.max_registers else (needs.THREADS, 1))
            compiled = time.monotonic()
            facts = assemble(ptxas, ptx, target, job.max_registers)
            worker.say(
                "kernel",
                name=function.__name__,
                target=target,
                **facts,
                occupancy=occupied(target, facts),
                threads_per_block=needs.THREADS,
                float64_instructions=len(re.findall(r"^\s*(?:@%p\d+ )?[a-z.]+\S*\.f64\b", ptx, re.MULTILINE)),
                contracted=len(re.findall(r"^\s*(?:@%p\d+ )?fma\.", ptx, re.MULTILINE)),
                ptx_bytes=len(ptx),
                compile_s=compiled - start,
                assemble_s=time.monotonic() - compiled,
            )


def kernels_of(job):
    """The functions of a job's kernels, each with the arguments that it would be started with, on the host."""
    import numpy as np

    from ..load import build, tables, work
    from . import render
    from .assemble import Layout

    real = np.dtype(job.precision).type
    fields = tables(job, real)
    if needs.TREE:
        build(fields, real)
    layout = Layout(fields, work(job, real, fields))
    given, counts = layout.arguments, np.zeros(5, np.int64)
    if job.kind == "rays":
        yield render.rays_kernel(layout.assemble()), (given, np.zeros((1, 6), real), np.zeros((1, 8), real))
        return
    question = given, job.width, job.height, job.region, np.int32(job.depth)
    if needs.ADAPTIVE:
        yield render.corners_kernel(layout.assemble()), (*question, counts)
    yield render.picture_kernel(layout.assemble()), (*question, np.zeros((1, 1, 3), real), counts)


def compile_ptx(function, arguments, target, bounds):
    from numba import cuda
    from numba.cuda import dispatcher, types
    from numba.cuda.typing.typeof import typeof

    from . import compiler

    if needs.FLOATING_POINT == "strict":
        compiler.forbid_contraction()
    capability = capability_of(target)
    # Numba asks the GPU for its capability when it compiles what a kernel calls.
    dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=capability)
    signature = types.void(*map(typeof, arguments))
    try:
        options = {"device": False, "abi": "numba", "fastmath": needs.FAST, "launch_bounds": bounds}
        ptx, _ = cuda.compile(function, signature, cc=capability, **options)
    except Exception as error:
        compiler.refuse_if_missing(error)
        raise
    return ptx


def capability_of(target):
    """(9, 0) of "sm_90"."""
    digits = target.removeprefix("sm_")
    if not digits.isdigit() or len(digits) < 2:
        worker.refuse(f'target "{target}": expected a compute capability such as sm_75 or sm_90')
    return int(digits[:-1]), int(digits[-1])


def find_ptxas():
    """The ptxas that the extra `cuda` installs, whose version fits the compiler's; else the system's."""
    spec = importlib.util.find_spec("nvidia")
    for home in spec.submodule_search_locations if spec else ():
        for path in sorted(Path(home).glob("*/bin/ptxas")):
            return str(path)
    homes = [os.environ[name] for name in ("CUDA_HOME", "CUDA_PATH") if os.environ.get(name)]
    for path in [*(Path(home) / "bin" / "ptxas" for home in homes), Path("/usr/local/cuda/bin/ptxas")]:
        if path.is_file():
            return str(path)
    return shutil.which("ptxas")


def assemble(ptxas, ptx, target, limit):
    """Assembles a kernel and returns ptxas's report."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "kernel.ptx"
        source.write_text(ptx)
        command = [ptxas, "-v", f"-arch={target}", str(source), "-o", str(source.with_suffix(".cubin"))]
        if limit:
            command.append(f"-maxrregcount={limit}")
        done = subprocess.run(command, capture_output=True, text=True, errors="replace")
    if done.returncode:
        worker.refuse(f"ptxas, for {target}: {(done.stderr or done.stdout).strip().splitlines()[-1]}")
    # Of functions that the kernel calls, ptxas tells the stack before it tells the kernel's.
    text = done.stderr[done.stderr.index("Compiling entry function") :]

    def number(pattern):
        found = re.search(pattern, text)
        return int(found[1]) if found else 0

    # Of shared and constant memory the code itself tells: ptxas leaves constants out for some targets.
    constants = re.findall(r"^\.(?:visible |extern |weak )*const .*\[(\d+)\]", ptx, re.MULTILINE)
    return {
        "registers": number(r"Used (\d+) registers"),
        "shared_bytes": number(r"(\d+) bytes smem"),
        "local_bytes": number(r"(\d+) bytes stack frame"),
        "constant_bytes": sum(map(int, constants)),
        "spill_store_bytes": number(r"(\d+) bytes spill stores"),
        "spill_load_bytes": number(r"(\d+) bytes spill loads"),
    }


def occupied(target, facts):
    from .occupancy import occupancy

    return occupancy(capability_of(target), needs.THREADS, facts["registers"], facts["shared_bytes"])


if __name__ == "__main__":
    main(sys.argv[1:])
