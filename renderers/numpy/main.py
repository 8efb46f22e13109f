"""Runs one job: a picture, or the first hits of a list of rays."""

import os
import sys
from operator import itemgetter

from renderers import worker

FEATURES = [
    *("sphere", "box", "polygon", "ellipsoid", "mesh", "csg"),
    *("ambient", "diffuse", "phong", "shadows", "soft", "reflection", "glossy"),
    *(
        "transmission",
        "attenuation",
        "media",
        "contact",
        "supersampling",
        "sobol",
        "adaptive",
        "lens",
        "cutoff",
        "region",
        "rays",
    ),
]
METHODS = {
    "precision": ("float64", "float32"),
    "walk": ("least",),
    "accel": ("auto", "none"),
    "sphere": ("robust", "textbook", "stable", "wide"),
    "triangle": ("watertight",),
    "slab": ("branch",),
    "csg": ("intervals",),
    "merge": ("tolerant",),
    "offset": ("bounded", "relative", "fixed", "none"),
    "fresnel": ("clamped",),
    "phong": ("clamped",),
    "renormalise": ("on",),
    "floating_point": ("strict",),
    "glossy_weight": ("plain", "study"),
}
USED_WITH = {  # methods by the features, of which one makes a job depend on them
    "sphere": ("sphere", "ellipsoid"),
    "offset": ("reflection", "transmission", "shadows"),
}


def main(arguments):
    job = worker.Job(arguments)
    worker.require(job, FEATURES)
    for method, choices in METHODS.items():
        choice = getattr(job, method)
        if choice not in choices:
            worker.refuse(f'no {method} "{choice}": ' + " or ".join(choices))
    for library in ("OPENBLAS", "MKL", "OMP"):  # read when NumPy is imported
        if os.environ.setdefault(library + "_NUM_THREADS", str(job.threads)) != str(job.threads):
            raise worker.Apart("NumPy was imported for another number of threads")
    with worker.importing():
        import numpy as np

        from .camera import Camera
        from .sample import render
        from .scene import Scene
        from .trace import first_hits
    np.seterr(all="ignore")  # NUM-5 and CNT-2 say what becomes of what is not finite
    with worker.phase("load"):
        scene = Scene(job, job.precision)
        if job.kind == "image":
            camera = Camera(np.load(job.array("camera")), job, job.precision)
        else:
            rays = np.load(job.array("rays")).T.astype(job.precision)
    if job.kind == "image":
        answer, counts, dropped = worker.render_checked(job, lambda _: render(scene, camera, job), itemgetter(0))
    else:
        answer = worker.render(job, lambda: first_hits(scene, rays))
    output = {"file": "image.npy" if job.kind == "image" else "hits.npy"}
    with worker.phase("save"):
        np.save(job.output(output["file"]), answer)
        if job.kind == "image":
            if scene.cuts:
                output["dropped"] = "dropped.npy"
                np.save(job.output(output["dropped"]), dropped)
            worker.say_rays(
                counts.primary, counts.reflected, counts.shadow, counts.non_finite, transmitted=counts.transmitted
            )
    worker.say("output", **output)
    methods = {"precision": job.precision, "threads": 1, "floating_point": job.floating_point}
    methods |= {"walk": "wavefront", "accel": "none"}
    methods |= {
        method: getattr(job, method) for method, with_any in USED_WITH.items() if set(with_any) & set(job.needs)
    }
    if scene.cuts:
        methods["cutoff"] = job.cutoff
    worker.say("used", features=job.needs, methods=methods)
    worker.say_python_versions(numpy=np.__version__)


if __name__ == "__main__":
    worker.serve(main, sys.argv[1:])
