"""Runs one job: a picture of spheres without shadows, by the library that naive.cpp is built into."""

import sys

from renderers import worker

FEATURES = ("sphere", "ambient", "diffuse", "phong", "reflection", "region")


def tables(job, np):
    """The tables that `render` of naive.cpp reads."""
    materials, air = np.load(job.array("materials")), np.load(job.array("air"))
    of_sphere = materials[np.load(job.array("sphere_ids"))[:, 1]]
    n, mu = np.sqrt(of_sphere[:, 8] * of_sphere[:, 9]), of_sphere[:, 9]  # REF-1
    spheres = np.column_stack(
        [np.load(job.array("spheres")), of_sphere[:, :5], np.sqrt(air[0] * air[1]) / n, air[1] / mu]
    )
    colours = np.concatenate([np.load(job.array("ambient")), np.load(job.array("background"))])
    lights, camera = np.load(job.array("lights"))[:, :6], np.load(job.array("camera"))
    return [np.ascontiguousarray(table, np.float64) for table in (spheres, lights, colours, camera)]


def main(arguments):
    job = worker.Job(arguments)
    worker.require(job, FEATURES)
    if job.kind != "image":
        worker.refuse("makes pictures only")
    library = next(word.partition("=")[2] for word in arguments if word.startswith("--library="))
    with worker.importing():
        import ctypes

        import numpy as np
    with worker.phase("load"):
        spheres, lights, colours, camera = tables(job, np)
        x0, y0, x1, y1 = job.region
        region, picture = np.array(job.region, np.int32), np.zeros((y1 - y0, x1 - x0, 3), job.precision)
        entry = getattr(ctypes.CDLL(library), f"render_{job.precision}")
        entry.restype = ctypes.c_long
        at = [ctypes.c_void_p(table.ctypes.data) for table in (spheres, lights, colours, camera, region, picture)]
        given = [at[0], len(spheres), at[1], len(lights), at[2], at[3], at[4], job.width, job.height]
        given += [*map(ctypes.c_double, job.sample), job.depth, at[5]]
        counts = {}

    def frame():
        counts["reflected"] = entry(*given)

    worker.render(job, frame)
    with worker.phase("save"):
        np.save(job.output("image.npy"), picture)
        worker.say("output", file="image.npy")
        pixels = picture.shape[0] * picture.shape[1]
        worker.say_rays(pixels, counts["reflected"], 0, pixels - np.isfinite(picture).all(axis=-1).sum())
    methods = {"precision": job.precision, "threads": 1, "floating_point": job.floating_point, "walk": "recursion"}
    worker.say("used", features=job.needs, methods=methods | {"accel": "none"})
    worker.say_python_versions(numpy=np.__version__)


if __name__ == "__main__":
    main(sys.argv[1:])
