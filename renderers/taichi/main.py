"""Runs one job: a picture of spheres."""

import os
import sys
from contextlib import redirect_stdout

from renderers import worker

FEATURES = ("sphere", "ambient", "diffuse", "phong", "shadows", "reflection", "region")
PRECISIONS = ("float64", "float32")


def surfaces(job, np):
    """A row for each sphere, its columns as in kernel.py."""
    materials, air = np.load(job.array("materials")), np.load(job.array("air"))
    of_sphere = materials[np.load(job.array("sphere_ids"))[:, 1]]
    n, mu = np.sqrt(of_sphere[:, 8] * of_sphere[:, 9]), of_sphere[:, 9]  # REF-1
    n_of_air, mu_of_air = np.sqrt(air[0] * air[1]), air[1]
    return np.column_stack([of_sphere[:, :5], n_of_air / n, mu_of_air / mu, n / n_of_air, mu / mu_of_air])


def main(arguments):
    job = worker.Job(arguments)
    worker.require(job, FEATURES)
    if job.kind != "image":
        worker.refuse("makes pictures only")
    if job.precision not in PRECISIONS:
        worker.refuse(f'no precision "{job.precision}": ' + " or ".join(PRECISIONS))
    os.environ["ENABLE_TAICHI_HEADER_PRINT"] = "0"
    with worker.importing():
        import numpy as np
        import taichi as ti

        from .kernel import kernel
    with worker.phase("load"):
        with redirect_stdout(sys.stderr):  # it prints there what is no event
            ti.init(
                arch=ti.cpu,
                default_fp=getattr(ti, job.precision),
                fast_math=False,  # NUM-3
                cpu_max_num_threads=job.threads,
                offline_cache=False,  # it saves 0.1 s of the compile phase, and would lie in the user's home
            )
        x0, y0, x1, y1 = job.region
        arrays = [np.load(job.array("spheres")), surfaces(job, np), np.load(job.array("lights"))]
        arrays.append(np.stack([np.load(job.array("ambient")), np.load(job.array("background"))]))
        arrays.append(np.load(job.array("camera")))
        arrays = [array.astype(job.precision) for array in arrays]
        parameters = (x0, y0, job.width, job.height, *job.sample, job.depth, job.epsilon)
        picture = np.zeros((y1 - y0, x1 - x0, 3), job.precision)
        counts = np.zeros((y1 - y0, x1 - x0, 2), np.int32)
    with worker.phase("compile"):
        render = kernel(job.needs)
        render(picture[:0], counts[:0], *arrays, *parameters)
    worker.render(job, lambda: render(picture, counts, *arrays, *parameters))
    with worker.phase("save"):
        np.save(job.output("image.npy"), picture)
        worker.say("output", file="image.npy")
        reflected, feelers = counts.sum(axis=(0, 1))
        broken = picture.shape[0] * picture.shape[1] - np.isfinite(picture).all(axis=-1).sum()
        worker.say_rays(picture.shape[0] * picture.shape[1], reflected, feelers, broken)
    methods = {"precision": job.precision, "threads": job.threads, "floating_point": "strict", "walk": "chain"}
    worker.say("used", features=job.needs, methods=methods | {"accel": "none", "compile_cache": "off"})
    worker.say_python_versions(taichi=".".join(map(str, ti.__version__)), numpy=np.__version__)


if __name__ == "__main__":
    main(sys.argv[1:])
