"""Reads a job, sets what the kernel needs for it as constants, and only then imports the kernel."""

import os
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
    "scene_memory": ("auto",),
}
CUDA_METHODS = METHODS | {
    "walk": ("least", "table", "stack", "chain"),
    "scene_memory": ("auto", "global", "constant", "shared"),
}
FAULTS = {"numba-cuda-index-fault": "index", "numba-cuda-barrier-fault": "barrier"}


SHARED, CONSTANT = 49152, 65536  # bytes of shared memory that every GPU has for a block, and of constant memory
REGISTERS = 65536  # of a block


def prepare(job):
    """Refuse what cannot be done, and set the kernel's constants for the rest. Before any module of the kernel."""
    worker.require(job, FEATURES)
    cuda = job.variant.startswith("numba-cuda")
    for name, known in (CUDA_METHODS if cuda else METHODS).items():
        if getattr(job, name) not in known:
            worker.refuse(f"does not support {name} {getattr(job, name)}")
    one_child = "transmission" not in job.needs and ("glossy" not in job.needs or job.glossy_rays == 1)
    if job.walk == "chain" and not one_child:
        worker.refuse("walk chain: a ray of this scene can have several children")
    walk = job.walk
    if walk == "least" or job.kind == "rays":
        walk = "chain" if one_child else "stack"

    from .count import bytes_of_scene, count_shapes, largest_part

    memory = "shared" if job.variant in FAULTS else job.scene_memory
    threads = job.block_width * job.block_height
    if job.max_registers * threads > REGISTERS:
        worker.refuse(f"max_registers {job.max_registers}: a block of {threads} threads has {REGISTERS} at most")
    tree = job.accel == "bvh" or (job.accel == "auto" and memory != "shared" and count_shapes(job) >= needs.MANY)
    if memory == "auto":  # constant memory takes the fewest registers
        memory = "constant" if not tree and bytes_of_scene(job, 0) <= CONSTANT else "global"
    streamed = cuda and memory == "shared" and not tree and bytes_of_scene(job, threads) > SHARED
    if streamed and walk == "table":
        worker.refuse("walk table: not of a scene that is streamed through shared memory")
    if streamed and "adaptive" in job.needs:
        worker.refuse("scene_memory shared: the scene is too large for it, and adaptive samples cannot be streamed")
    needs.take(
        job.needs,
        walk="stack" if streamed else walk,
        tree=tree,
        jittered=job.sampler == "jittered",
        study_weight=job.glossy_weight == "study",
        limited=largest_part(job) > needs.CROSSINGS,
        target="cuda" if cuda else "cpu",
        simulated=cuda and os.environ.get("NUMBA_ENABLE_CUDASIM") == "1",
        single=job.precision == "float32",
        threads=threads,
        memory=memory,
        strided=job.total_threads > 0 or -(-(job.region[3] - job.region[1]) // job.block_height) > needs.MOST_ROWS,
        streamed=streamed,
        fault=FAULTS.get(job.variant, ""),
    )


def main(arguments):
    job = worker.Job(arguments)
    if os.environ.get("RAYRACE_CUDASIM") == "1":
        os.environ["NUMBA_ENABLE_CUDASIM"] = "1"  # before Numba is imported
    with worker.importing():
        prepare(job)
        if needs.TARGET == "cuda":
            from .gpu.run import run
        else:
            from .run import run
    run(job)


if __name__ == "__main__":
    main(sys.argv[1:])
