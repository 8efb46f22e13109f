"""Loads the scene, builds its tree, compiles the kernel or loads it from the disk cache, renders and saves."""

import hashlib
import os
import sys
from operator import itemgetter
from pathlib import Path

from renderers import worker

sys.modules["scipy"] = None  # Numba imports it where it finds it; nothing here uses it

import llvmlite.binding  # noqa: E402
import numba  # noqa: E402
import numpy as np  # noqa: E402
from numba.core.runtime import rtsys  # noqa: E402

from . import needs  # noqa: E402
from .load import build, work_of_walk  # noqa: E402
from .once import optimise_only  # noqa: E402

if needs.VECTOR:
    from .lanes.render import render_tiles, render_tiles_parallel
    from .lanes.scene import load, scene_of, tiles
else:
    from .load import load, scene_of
    from .render import render_rows, render_rows_parallel, trace_rays, trace_rays_parallel


def cache_folder(job):
    """The folder for the machine code of exactly this kernel.

    Numba's own key sees neither an edit of a module that the entry calls nor a change of options or constants.
    """
    sources = b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.rglob("*.py")))
    versions = sys.version, numba.__version__, llvmlite.__version__, np.__version__
    processor = numba.config.CPU_NAME or llvmlite.binding.get_host_cpu_name()
    key = repr((sources, versions, processor, job.kind, job.variant, job.precision, needs.constants()))
    return os.path.join(job.cache, "numba-" + hashlib.sha256(key.encode()).hexdigest()[:16])


def load_kernel_alone(entry):
    """Makes Numba load a cached kernel without all that it compiles others with, which takes four times as long."""
    cache = entry._cache

    def load_overload(signature, context):
        rtsys.initialize(context)  # whose functions the kernel calls
        return cache._load_overload(signature, context)

    cache.load_overload = load_overload


def run(job):
    parallel = job.variant == "numba-parallel"
    threads = job.threads if parallel else 1
    numba.config.NUMBA_NUM_THREADS = threads  # how many the first parallel call starts
    real = np.dtype(job.precision).type
    work = {} if needs.VECTOR else work_of_walk(job, real)

    with worker.phase("load"):
        x0, y0, x1, y1 = job.region
        loaded = load(job, real, threads)
        if job.kind == "rays":
            entry = trace_rays_parallel if parallel else trace_rays
            questions = [(np.load(job.array("rays")).astype(real),)]
            answers = [np.zeros((len(questions[0][0]), 8))]
        elif needs.VECTOR:
            entry = render_tiles_parallel if parallel else render_tiles
            entry, parts = render_tiles_parallel if parallel else render_tiles, tiles(job)
        else:
            entry, parts = render_rows_parallel if parallel else render_rows, y1 - y0 + 1
        if job.kind == "image":
            passes = (True, False) if job.sampler == "adaptive" else (False,)  # corners of pixels, pixels
            questions = [(job.width, job.height, job.region, job.depth, corners) for corners in passes]
            answers = [np.zeros((y1 - y0, x1 - x0, 3), real), np.zeros((parts, 5), np.int64)]
    if needs.TREE:
        with worker.phase("build"):
            build(loaded, real)
    scene = scene_of(loaded)
    with worker.phase("compile"):
        if not entry.signatures:
            optimise_only((entry.__qualname__,))
            if job.cache:
                numba.config.CACHE_DIR = cache_folder(job)
                entry.enable_caching()
                load_kernel_alone(entry)
        entry(scene, *questions[0], 0, threads, *(answer[:0] for answer in answers))

    if job.kind == "rays":

        def frame():
            entry(scene, *questions[0], 0, threads, *answers)

        worker.render(job, frame)
    else:
        pictures, counts = [answers[0]], answers[1]
        others = counts, *([scene.dropped] if needs.CUTOFF else [])

        def frame(number):
            if number == len(pictures):
                pictures.append(np.zeros_like(pictures[0]))
            scene.sample[:] = job.sample
            counts[:] = 0
            for question in questions:
                entry(scene, *question, 0, threads, pictures[number], counts)
            return pictures[number], *others

        def keep(arrays):
            return [array.copy() for array in arrays]

        answers = worker.render_checked(job, frame, itemgetter(0), keep)

    with worker.phase("save"):
        name = "hits.npy" if job.kind == "rays" else "image.npy"
        np.save(job.output(name), answers[0])
        cut = {}
        if needs.CUTOFF:
            cut["dropped"] = "dropped.npy"
            np.save(job.output(cut["dropped"]), answers[2])
        worker.say("output", file=name, **cut)
        if job.kind == "image":
            primary, reflected, transmitted, shadow, non_finite = answers[1].sum(axis=0)
            worker.say_rays(primary, reflected, shadow, non_finite, transmitted)
    methods = {
        **needs.methods(job),
        **work,
        "threads": threads,
        "threading_layer": numba.threading_layer() if parallel else "none",
        "compile_cache": ("warm" if entry.stats.cache_hits else "cold") if job.cache else "off",
    }
    worker.say("used", features=job.needs, methods=methods)
    worker.say_python_versions(numba=numba.__version__, llvmlite=llvmlite.__version__, numpy=np.__version__)
