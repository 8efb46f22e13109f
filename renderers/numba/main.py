"""Reads a job, sets what the kernel needs for it as constants, and only then imports the kernel."""

import sys

from renderers import worker

from . import needs

FEATURES = (
    *("sphere", "box", "polygon", "ellipsoid", "mesh", "csg"),
    *("ambient", "diffuse", "phong", "shadows", "soft"),
    *("reflection", "transmission", "glossy", "attenuation", "media"),
    *("supersampling", "adaptive", "lens", "region", "rays"),
)
METHODS = {
    "precision": ("float64", "float32"),
    "walk": ("least", "recursion", "table", "stack", "chain"),
    "accel": ("auto", "none", "bvh"),
    "glossy_weight": ("plain", "study"),
}


def main(arguments):
    job = worker.Job(arguments)
    worker.require(job, FEATURES)
    for name, known in METHODS.items():
        if getattr(job, name) not in known:
            worker.refuse(f"does not support {name} {getattr(job, name)}")
    one_child = "transmission" not in job.needs and ("glossy" not in job.needs or job.glossy_rays == 1)
    if job.walk == "chain" and not one_child:
        worker.refuse("walk chain: a ray of this scene can have several children")
    walk = job.walk
    if walk == "least" or job.kind == "rays":
        walk = "chain" if one_child else "stack"
    with worker.importing():
        from .count import count_shapes, largest_part

        needs.take(
            job.needs,
            walk=walk,
            tree=job.accel == "bvh" or (job.accel == "auto" and count_shapes(job) >= needs.MANY),
            jittered=job.sampler == "jittered",
            study_weight=job.glossy_weight == "study",
            limited=largest_part(job) > needs.CROSSINGS,
        )
        from .run import run
    run(job)


if __name__ == "__main__":
    main(sys.argv[1:])
