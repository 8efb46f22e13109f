"""Runs one job: a picture, or the first hits of a list of rays."""

from renderers import worker

FEATURES = [
    *("sphere", "box", "polygon", "ellipsoid"),
    *("ambient", "diffuse", "phong", "shadows", "reflection", "region", "rays"),
]
PRECISIONS = "float64", "float32"


def main():
    import os
    import sys

    job = worker.Job(sys.argv[1:])
    worker.require(job, FEATURES)
    if job.precision not in PRECISIONS:
        worker.refuse(f'no precision "{job.precision}": ' + " or ".join(PRECISIONS))
    for library in ("OPENBLAS", "MKL", "OMP"):  # read when NumPy is imported
        os.environ[library + "_NUM_THREADS"] = str(job.threads)
    with worker.importing():
        import numpy as np

        from .camera import Camera
        from .scene import Scene
        from .trace import first_hits, trace
    np.seterr(all="ignore")  # NUM-5 and CNT-2 say what becomes of what is not finite
    with worker.phase("load"):
        scene = Scene(job, job.precision)
        if job.kind == "image":
            camera = Camera(np.load(job.array("camera")), job, job.precision)
        else:
            rays = np.load(job.array("rays")).T.astype(job.precision)
    if job.kind == "image":
        answer, counts = worker.render(job, lambda: trace(scene, camera, job.depth, job.shadows))
    else:
        answer = worker.render(job, lambda: first_hits(scene, rays))
    file = "image.npy" if job.kind == "image" else "hits.npy"
    with worker.phase("save"):
        np.save(job.output(file), answer)
        if job.kind == "image":
            non_finite = np.count_nonzero(~np.isfinite(answer).all(axis=2))
            worker.say_rays(counts.primary, counts.reflected, counts.shadow, non_finite)
    worker.say("output", file=file)
    methods = {"precision": job.precision, "threads": 1, "contraction": "off"}
    worker.say("used", features=job.needs, methods=methods)
    worker.say_python_versions(numpy=np.__version__)


if __name__ == "__main__":
    main()
