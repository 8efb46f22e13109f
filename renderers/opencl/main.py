"""Reads a job, refuses what is not here, and renders it on a device of OpenCL or of CUDA."""

import os
import sys
import tempfile

from renderers import worker

threads = {}  # of a processor, for as long as the process lives


def main(arguments):
    job = worker.Job(arguments)
    by_cuda = job.variant.startswith("cuda")
    if not by_cuda and threads.setdefault("all", job.threads) != job.threads:
        raise worker.Apart("PoCL has its threads from the start")
    # What the libraries keep of compiled kernels belongs into the job's cache, or nowhere.
    folder = job.cache or tempfile.gettempdir()
    os.environ |= {"POCL_CACHE_DIR": folder, "CUDA_CACHE_PATH": folder, "PYOPENCL_NO_CACHE": "1"}
    os.environ["POCL_MAX_PTHREAD_COUNT"] = str(job.threads)
    with worker.importing():
        from . import method

        method.check(job)
        try:
            if by_cuda:
                from .cuda.session import Session
            else:
                from .session import Session
        except ImportError as error:
            worker.refuse(f"{error} (pip install 'rayrace[{'cuda' if by_cuda else 'opencl'}]')")
        from .run import run
    run(job, Session)


if __name__ == "__main__":
    worker.serve(main, sys.argv[1:])
