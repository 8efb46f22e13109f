"""Runs one job: a picture of meshes, or the first hits of a list of rays."""

import os
import sys

from renderers import worker

FEATURES = ("mesh", "ambient", "diffuse", "phong", "shadows", "reflection", "region", "rays")


def main(arguments):
    job = worker.Job(arguments)
    worker.require(job, FEATURES)
    if job.precision != "float32":
        worker.refuse(f'no precision "{job.precision}": Embree has float32 alone')
    for library in ("OPENBLAS", "MKL", "OMP"):  # read when NumPy is imported
        os.environ[library + "_NUM_THREADS"] = "1"
    with worker.importing():
        from importlib.metadata import version

        import numpy as np

        from .scene import Scene
        from .trace import first_hits, trace
    np.seterr(all="ignore")  # NUM-5 and CNT-2 say what becomes of what is not finite
    x0, y0, x1, y1 = job.region
    with worker.phase("load"):
        scene = Scene(job)
        if job.kind == "rays":
            rays = np.load(job.array("rays")).astype(np.float32).T
        else:
            picture = np.zeros((3, (y1 - y0) * (x1 - x0)), np.float32)
    with worker.phase("build"):
        scene.build()
    if job.kind == "rays":
        answer = worker.render(job, lambda: first_hits(scene, rays), scene.parts)
    else:
        counts = worker.render(job, lambda: trace(scene, job, picture), scene.parts)
        answer = picture.T.reshape(y1 - y0, x1 - x0, 3)
    with worker.phase("save"):
        name = "hits.npy" if job.kind == "rays" else "image.npy"
        np.save(job.output(name), answer)
        worker.say("output", file=name)
        if job.kind == "image":
            worker.say_rays(picture.shape[1], *counts, np.count_nonzero(~np.isfinite(picture).all(axis=0)))
    methods = {"precision": "float32", "threads": 1, "walk": "chain", "accel": "bvh"}
    worker.say("used", features=job.needs, methods=methods)
    worker.say_python_versions(embreex=version("embreex"), numpy=np.__version__)


if __name__ == "__main__":
    main(sys.argv[1:])
