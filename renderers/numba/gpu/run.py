"""Loads the scene, builds its tree, uploads both, compiles the kernel, renders on the GPU, and saves the picture."""

import sys
import time
from collections import Counter

from renderers import worker

sys.modules["scipy"] = None  # Numba imports it where it finds it; nothing here uses it

import numba  # noqa: E402
import numpy as np  # noqa: E402
from numba import cuda  # noqa: E402

from .. import needs  # noqa: E402
from ..load import build, samples, tables, work, work_of_walk  # noqa: E402
from . import compiler, device, render  # noqa: E402
from .assemble import Layout  # noqa: E402
from .occupancy import occupancy  # noqa: E402

BOUNDS = needs.THREADS, 1  # threads of a block, and blocks that must fit: without the second, ptxas spills registers
# In the simulator, kernels read arrays in tuples faster as they are.
upload = np.ascontiguousarray if needs.SIMULATED else cuda.to_device
download = np.asarray if needs.SIMULATED else lambda array: array.copy_to_host()


class Launch:
    """A kernel with its arguments, and the grid of blocks that it is started in.

    shape: (h, w, ..) of what it makes. shared: whether fewer threads than that has parts may share them.
    """

    def __init__(self, job, function, shape, shared, *arguments):
        self.block = job.block_width, job.block_height
        across, down = -(-shape[1] // job.block_width), -(-shape[0] // job.block_height)
        if shared and needs.STRIDED:
            blocks = -(-job.total_threads // needs.THREADS) if job.total_threads else across * down
            across = min(across, blocks)
            down = min(down, needs.GRID_ROWS, max(1, blocks // across))
        self.grid = across, down
        self.arguments = arguments
        # ptxas takes no cap on registers beside bounds.
        options = {"max_registers": job.max_registers} if job.max_registers else {"launch_bounds": BOUNDS}
        options |= {"fastmath": needs.FAST, "lto": False}
        self.kernel = cuda.jit(function, **({} if needs.SIMULATED else options))

    def start(self, grid=None):
        self.kernel[grid or self.grid, self.block](*self.arguments)

    def resources(self):
        """The resources of a thread and a block of the compiled kernel, for `used.methods`."""
        if needs.SIMULATED:
            return dict.fromkeys(("registers", "occupancy"))
        (compiled,) = self.kernel.overloads.values()
        registers, shared = compiled.regs_per_thread, compiled.shared_mem_per_block
        here = cuda.get_current_device().compute_capability
        return {
            "registers": registers,
            "local_bytes": compiled.local_mem_per_thread,
            "shared_bytes": shared,
            "constant_bytes": compiled.const_mem_size,
            "occupancy": occupancy(tuple(here), needs.THREADS, registers, shared),
        }


def check_local_memory(layout):
    """Refuse a job whose work memory, for all threads that the GPU can hold at once, is more than it has."""
    if needs.SIMULATED:
        return
    here = cuda.get_current_device()
    threads = here.MULTIPROCESSOR_COUNT * here.MAX_THREADS_PER_MULTIPROCESSOR
    free = cuda.current_context().get_memory_info().free
    if threads * layout.local_bytes > free:
        worker.refuse(
            f"work memory of {layout.local_bytes} bytes for each of {threads} threads is more than"
            f" the {free} bytes that the GPU has free"
        )


def run(job):
    if not needs.SIMULATED and needs.FLOATING_POINT == "strict":
        compiler.forbid_contraction()
    real = np.dtype(job.precision).type
    walked = work_of_walk(job, real)
    x0, y0, x1, y1 = job.region
    shape = y1 - y0, x1 - x0, 3

    with worker.phase("load"):
        fields = tables(job, real)
        rays = np.load(job.array("rays")).astype(real) if job.kind == "rays" else None
        device.begin(job.gpu_wait)  # which is no part of what follows
    if needs.TREE:
        with worker.phase("build"):
            build(fields, real)
    with worker.phase("upload"):
        layout = Layout(fields, work(job, real, fields))
        check_local_memory(layout)
        assemble = layout.assemble()
        worker.say_device(**device.describe())
        values = [upload(value) if isinstance(value, np.ndarray) else value for value in layout.arguments]
        given = type(layout.arguments)(*values)
        counts = cuda.to_device(np.zeros(5, np.int64))
        if job.kind == "rays":
            answer = cuda.to_device(np.zeros((len(rays), 8), real))
            wide = max(1, -(-len(rays) // job.block_height))
            arguments = given, cuda.to_device(rays), answer
            launches = [Launch(job, render.rays_kernel(assemble), (1, wide), False, *arguments)]
        else:
            answer = cuda.to_device(np.zeros(shape, real))
            question = given, job.width, job.height, job.region, np.int32(job.depth)
            launches = []
            if job.sampler == "adaptive":
                corners = shape[0] + 1, shape[1] + 1
                launches.append(Launch(job, render.corners_kernel(assemble), corners, False, *question, counts))
            launches.append(Launch(job, render.picture_kernel(assemble), shape, True, *question, answer, counts))
        host = cuda.pinned_array(answer.shape, answer.dtype)
    with worker.phase("compile"):
        try:
            for launch in () if needs.SIMULATED else launches:
                launch.start(grid=(1, 1))  # compiles it, and loads it into the GPU
        except Exception as error:
            compiler.refuse_if_missing(error)
            raise
        cuda.synchronize()

    begin, end = cuda.event(), cuda.event()
    spent = Counter()

    def frame():
        counts.copy_to_device(np.zeros(5, np.int64))
        before = time.monotonic()
        begin.record()
        for launch in launches:
            launch.start()
        end.record()
        cuda.synchronize()  # as gpu_wait says; an event is waited for in another way
        after = time.monotonic()
        answer.copy_to_host(host)
        spent["kernel"] += after - before if needs.SIMULATED else begin.elapsed_time(end) / 1000
        spent["download"] += time.monotonic() - after

    def parts():
        taken = dict(spent)
        spent.clear()
        return taken

    worker.render(job, frame, parts)

    with worker.phase("download"):
        total = counts.copy_to_host()
        dropped = download(given.dropped) if needs.CUTOFF else None
    with worker.phase("save"):
        name = "hits.npy" if job.kind == "rays" else "image.npy"
        np.save(job.output(name), host.astype(np.float64) if job.kind == "rays" else host)
        cut = {}
        if needs.CUTOFF:
            cut["dropped"] = "dropped.npy"
            np.save(job.output(cut["dropped"]), dropped)
        worker.say("output", file=name, **cut)
        if job.kind == "image":
            primary, reflected, transmitted, shadow, non_finite = total
            if not needs.ADAPTIVE:
                primary = shape[0] * shape[1] * samples(job)["samples"]
            worker.say_rays(primary, reflected, shadow, non_finite, transmitted)
    methods = {
        **needs.methods(job),
        **walked,
        "scene_memory": needs.MEMORY,
        "streamed": needs.STREAMED,
        "block": f"{job.block_width}x{job.block_height}",
        "blocks": launches[-1].grid[0] * launches[-1].grid[1],
        "total_threads": launches[-1].grid[0] * launches[-1].grid[1] * needs.THREADS,
        "max_registers": job.max_registers,
        "gpu_wait": job.gpu_wait,
        "local_bytes": layout.local_bytes,
        "shared_bytes": layout.shared_bytes,
        "constant_bytes": layout.constant_bytes,
        **launches[-1].resources(),
        "compile_cache": "off",
    }
    worker.say("used", features=job.needs, methods=methods)
    versions = {} if needs.SIMULATED else {"numba_cuda": numba_cuda_version()}
    worker.say_python_versions(numba=numba.__version__, numpy=np.__version__, **versions)


def numba_cuda_version():
    import numba_cuda

    return numba_cuda.__version__
