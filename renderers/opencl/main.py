"""Reads a job, refuses what is not here, and renders it on an OpenCL device."""

import os
import sys
import tempfile

from renderers import worker

threads = {}  # of a processor, for as long as the process lives


def main(arguments):
    job = worker.Job(arguments)
    if threads.setdefault("all", job.threads) != job.threads:
        raise worker.Apart("PoCL has its threads from the start")
    # What the libraries keep of compiled kernels belongs into the job's cache, or nowhere.
    folder = job.cache or tempfile.gettempdir()
    os.environ |= {"POCL_CACHE_DIR": folder, "CUDA_CACHE_PATH": folder, "PYOPENCL_NO_CACHE": "1"}
    os.environ["POCL_MAX_PTHREAD_COUNT"] = str(job.threads)
    with worker.importing():
        from . import method

        method.check(job)
        try:
            from .run import run
        except ImportError as error:
            worker.refuse(f"{error} (pip install 'rayrace[opencl]')")
    run(job)


if __name__ == "__main__":
    worker.serve(main, sys.argv[1:])
