"""Reads a job, compiles the kernel or loads it from the disk cache, and renders."""

from renderers import worker

with worker.importing():
    import hashlib
    import os
    import sys
    from pathlib import Path

    sys.modules["scipy"] = None  # Numba imports it where it finds it; nothing here uses it
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # or NumPy's idle BLAS threads spin while this imports
    import llvmlite.binding
    import numba
    import numpy as np

    from . import trace
    from .scene import load

FEATURES = (
    *("sphere", "box", "polygon", "ellipsoid"),
    *("ambient", "diffuse", "phong", "shadows", "reflection"),
    *("region", "rays"),
)


def cache_folder(job):
    """Where this very kernel's machine code is kept.

    Numba's own key sees neither an edit of a module that the entry calls nor a change of options.
    """
    sources = b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
    versions = sys.version, numba.__version__, llvmlite.__version__, np.__version__
    key = repr((sources, versions, llvmlite.binding.get_host_cpu_name(), job.variant, job.precision))
    return os.path.join(job.cache, "numba-" + hashlib.sha256(key.encode()).hexdigest()[:16])


def main(arguments):
    job = worker.Job(arguments)
    worker.require(job, FEATURES)
    if job.precision not in ("float64", "float32"):
        worker.refuse("does not support precision " + job.precision)
    parallel = job.variant == "numba-parallel"
    threads = job.threads if parallel else 1
    numba.config.NUMBA_NUM_THREADS = threads  # how many the first parallel call starts
    real = np.dtype(job.precision).type

    with worker.phase("load"):
        scene = load(job, real)
        if job.kind == "rays":
            entry = trace.trace_rays_parallel if parallel else trace.trace_rays
            question = scene, np.load(job.array("rays")).astype(real)
            answers = [np.zeros((len(question[1]), 8))]
        else:
            entry = trace.render_rows_parallel if parallel else trace.render_rows
            question = scene, job.width, job.height, job.region, job.depth, job.shadows
            x0, y0, x1, y1 = job.region
            answers = [np.zeros((y1 - y0, x1 - x0, 3), real), np.zeros((y1 - y0, 3), np.int64)]
    with worker.phase("compile"):
        if job.cache:
            numba.config.CACHE_DIR = cache_folder(job)
            entry.enable_caching()
        entry(*question, 0, threads, *(answer[:0] for answer in answers))

    worker.render(job, lambda: entry(*question, 0, threads, *answers))

    with worker.phase("save"):
        name = "hits.npy" if job.kind == "rays" else "image.npy"
        np.save(job.output(name), answers[0])
        worker.say("output", file=name)
        if job.kind == "image":
            reflected, shadow, non_finite = answers[1].sum(axis=0)
            worker.say_rays(answers[0][..., 0].size, reflected, shadow, non_finite)
    methods = {
        "precision": job.precision,
        "threads": threads,
        "contraction": "off",
        "threading_layer": numba.threading_layer() if parallel else "none",
        "compile_cache": ("warm" if entry.stats.cache_hits else "cold") if job.cache else "off",
    }
    worker.say("used", features=job.needs, methods=methods)
    worker.say_python_versions(numba=numba.__version__, llvmlite=llvmlite.__version__, numpy=np.__version__)


if __name__ == "__main__":
    main(sys.argv[1:])
