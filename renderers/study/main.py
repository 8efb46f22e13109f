"""Runs one job: a picture of spheres."""

import os
import sys

from renderers import worker

FEATURES = ("sphere", "ambient", "diffuse", "phong", "shadows", "reflection", "region")
LARGEST_TABLE = 2**31  # bytes (WLK-2)
FRAMES_OF_A_RAY = 2  # of the interpreter, at most: in object mode a call passes through a dispatcher


def tables(job, np):
    """The arrays of the scene as `render` of trace.py reads them."""
    names = ("spheres", "lights", "camera", "ambient", "background")
    spheres, lights, camera, ambient, background = (np.load(job.array(name)) for name in names)
    materials, air = np.load(job.array("materials")), np.load(job.array("air"))
    of_sphere = materials[np.load(job.array("sphere_ids"))[:, 1]]
    n, mu = np.sqrt(of_sphere[:, 8] * of_sphere[:, 9]), of_sphere[:, 9]  # REF-1
    n_of_air, mu_of_air = np.sqrt(air[0] * air[1]), air[1]
    optics = np.column_stack([n_of_air / n, mu_of_air / mu, n / n_of_air, mu / mu_of_air])
    x0, y0, _, _ = job.region
    frame = np.array([job.width, job.height, x0, y0, *job.sample, job.depth, job.shadows, job.epsilon], float)
    surfaces = np.hstack([of_sphere[:, :5], optics])
    return spheres, surfaces, np.ascontiguousarray(lights[:, :6]), np.array([ambient, background]), camera, frame


def main(arguments):
    job = worker.Job(arguments)
    worker.require(job, FEATURES)
    if job.kind != "image":
        worker.refuse("makes pictures only")
    if job.precision != "float64":
        worker.refuse(f'no precision "{job.precision}": float64')
    by_table = job.variant == "study-python-table"
    methods = {"precision": "float64", "floating_point": "strict", "accel": "none", "threads": 1}
    methods["walk"] = "table" if by_table else "recursion"
    compiled, versions, library, made = job.variant.startswith("study-numba"), {}, None, False
    with worker.importing():
        import numpy as np

        from . import target, trace

        versions["numpy"] = np.__version__
        if job.variant == "study-numba-aot":
            from . import ahead

            library = ahead.library(job.cache)
            made = os.path.exists(library)  # then nothing here needs Numba
            methods["compile_cache"] = "warm" if made else "cold"
        if compiled and not made:
            import numba

            versions["numba"] = numba.__version__
    if by_table:
        rows = 2 ** (job.depth + 1) - 1
        methods |= {"walk_rows": rows, "walk_bytes": rows * trace.COLUMNS * 8}
        if methods["walk_bytes"] > LARGEST_TABLE:
            worker.refuse(f"a table of 2^{job.depth + 1} - 1 rows takes more than {LARGEST_TABLE} bytes")
    else:
        sys.setrecursionlimit(max(sys.getrecursionlimit(), FRAMES_OF_A_RAY * job.depth + 1000))
    if job.variant == "study-numba-parallel":
        if job.threads > numba.config.NUMBA_NUM_THREADS:
            worker.refuse(f"at most {numba.config.NUMBA_NUM_THREADS} threads here, by NUMBA_NUM_THREADS or cores")
        numba.set_num_threads(job.threads)
        methods["threads"] = job.threads

    def define():
        return trace.define(*target.decorators(job.variant), by_table, "tuples" in job.variant)

    with worker.phase("load"):
        x0, y0, x1, y1 = job.region
        picture, rays = np.zeros((y1 - y0, x1 - x0, 3)), np.zeros((y1 - y0, x1 - x0, 2))
        scene = tables(job, np)
        render = None if compiled else define()
    if compiled:
        with worker.phase("compile"):
            if library and not made:
                ahead.compile_library(library, define())
            render = ahead.load(library) if library else define()
            render(picture[:0], rays[:0], *scene)  # no row of pixels: the types are what a whole picture has

    def frame():
        picture[:], rays[:] = 0.0, 0.0
        render(picture, rays, *scene)

    worker.render(job, frame)
    with worker.phase("save"):
        np.save(job.output("image.npy"), picture)
        worker.say("output", file="image.npy")
        broken = picture[..., 0].size - np.isfinite(picture).all(axis=-1).sum()
        worker.say_rays(picture[..., 0].size, rays[..., 0].sum(), rays[..., 1].sum(), broken)
    worker.say("used", features=job.needs, methods=methods)
    worker.say_python_versions(**versions)


if __name__ == "__main__":
    main(sys.argv[1:])
