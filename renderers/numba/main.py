"""Reads a job, sets what the kernel needs for it as constants, and only then imports the kernel."""

import os
import sys

from renderers import worker

from . import needs

FEATURES = (
    *("sphere", "box", "polygon", "ellipsoid", "mesh", "csg"),
    *("ambient", "diffuse", "phong", "shadows", "soft"),
    *("reflection", "transmission", "glossy", "attenuation", "media", "contact"),
    *("supersampling", "sobol", "adaptive", "lens", "cutoff", "region", "rays"),
)
METHODS = {
    "precision": ("float64", "float32"),
    "walk": ("least", "recursion", "table", "stack", "chain"),
    "accel": ("auto", "none", "bvh"),
    "sphere": ("robust", "textbook", "stable", "wide"),
    "offset": ("bounded", "relative", "fixed", "none"),
    "triangle": ("watertight", "moller-trumbore", "watertight-kahan"),
    "slab": ("branch", "plain"),
    "csg": ("intervals",),
    "merge": ("tolerant", "none"),
    "fresnel": ("clamped", "unclamped"),
    "phong": ("clamped", "unclamped"),
    "renormalise": ("on", "off"),
    "vector": ("off", "on", "auto"),
    "floating_point": ("strict", "contract", "fast"),
    "glossy_weight": ("plain", "study"),
    "scene_memory": ("auto",),
    "gpu_wait": ("auto",),
}
CUDA_METHODS = METHODS | {
    "walk": ("least", "table", "stack", "chain"),
    "vector": ("off",),
    "scene_memory": ("auto", "global", "constant", "shared"),
    "gpu_wait": ("auto", "spin", "yield", "block"),
}
# What there is in lanes (VEC-1); of methods that are not named here, the first.
LANES = tuple(name for name in FEATURES if name not in ("rays", "contact"))
LANE_METHODS = {name: METHODS[name] for name in ("precision", "accel", "vector", "glossy_weight")} | {
    "walk": ("least", "chain"),
}
RANKS = 31  # bits of a set of clear solids in lanes (MED-2)
held = {}  # the kernel of this process, once a job has asked for one
STUDY = {"walk": "table", "scene_memory": "global", "accel": "none"}  # of study-cuda-global (2.6.2, 2.7.4)
FAULTS = {"numba-cuda-index-fault": "index", "numba-cuda-barrier-fault": "barrier"}


def prepare(job):
    """Refuses a job that the kernel cannot do, or sets its constants. Call it before importing the kernel's modules."""
    worker.require(job, FEATURES)
    cuda = job.variant.startswith("numba-cuda") or job.variant == "study-cuda-global"
    if job.variant == "study-cuda-global":
        vars(job).update(STUDY)
    for name, known in (CUDA_METHODS if cuda else METHODS).items():
        if getattr(job, name) not in known:
            worker.refuse(f"does not support {name} {getattr(job, name)}")
    from .count import count_shapes, glossy_rays, largest_part, transmits

    job.glossy_rays = glossy_rays(job)
    missing = missing_in_lanes(job)
    if job.vector == "on" and missing:
        worker.refuse(f"vector on: {missing}")
    vector = job.vector == "on" or (job.vector == "auto" and not missing and lanes_pay(job))

    several = "glossy" in job.needs and job.glossy_rays > 1
    if job.walk == "chain" and (several or ("transmission" in job.needs and transmits(job))):
        worker.refuse("walk chain: a ray of this scene can have several children")
    cuts = "cutoff" in job.needs and job.cutoff > 0
    if cuts and job.walk in ("recursion", "table"):
        worker.refuse(f"cutoff: with the walks chain and stack, not with {job.walk}")
    if cuts and job.sampler == "adaptive":
        worker.refuse("cutoff: not with adaptive samples")
    walk = "chain" if vector else job.walk  # in lanes no walk but the streams takes work memory
    if not vector and (walk == "least" or job.kind == "rays"):  # of what the kernel has, not of what the job uses
        walk = "stack" if several or "transmission" in job.needs or "glossy" in job.carried else "chain"

    in_shared = cuda and (job.scene_memory == "shared" or job.variant in FAULTS)
    many = needs.MANY_FOR_LANES[job.precision] if vector else needs.MANY
    tree = job.accel == "bvh" or (job.accel == "auto" and not in_shared and count_shapes(job) >= many)
    chosen = {"walk": walk, "tree": tree} | (on_gpu(job, walk, tree, in_shared) if cuda else {})
    needs.take(
        job.needs,
        job.carried,
        **chosen,
        single=job.precision == "float32",
        sphere_method=job.sphere,
        offset=job.offset,
        triangle=job.triangle,
        slab=job.slab,
        merge=job.merge,
        fresnel=job.fresnel,
        phong_method=job.phong,
        renormalise=job.renormalise,
        vector=vector,
        floating_point=job.floating_point,
        jittered=job.sampler in ("jittered", "sobol") or "supersampling" in job.carried,
        study_weight=job.glossy_weight == "study",
        limited=cuda and ("csg" in job.carried or largest_part(job) > needs.CROSSINGS),
    )


def missing_in_lanes(job):
    """Returns what of the job the kernel in lanes lacks, or None."""
    from .count import ranks

    if job.kind == "rays":
        return "pictures alone, no rays"
    missing = [name for name in job.needs if name not in LANES]
    if missing:
        return "does not support " + ", ".join(missing)
    if job.carried:
        return "kernels of what the job needs alone"
    if "media" in job.needs and ranks(job) > RANKS:
        return f"sets of up to {RANKS} clear solids alone"
    for name, known in METHODS.items():
        if getattr(job, name) not in LANE_METHODS.get(name, known[:1]):
            return f"does not support {name} {getattr(job, name)}"
    return None


def lanes_pay(job):
    """Whether a picture that lanes can make takes less time in them (VEC-4)."""
    from .count import count_shapes

    x0, y0, x1, y1 = job.region
    few = job.accel == "none" or (job.accel == "auto" and count_shapes(job) < needs.MANY_FOR_LANES[job.precision])
    return few and min(x1 - x0, y1 - y0) >= needs.LEAST_SIDE


def on_gpu(job, walk, tree, in_shared):
    """Sets the GPU's constants and the walk."""
    from .count import bytes_of_scene, streamable, touches

    threads = job.block_width * job.block_height
    if job.max_registers * threads > needs.BLOCK_REGISTERS:
        worker.refuse(f"max_registers {job.max_registers}: {threads} threads have {needs.BLOCK_REGISTERS} together")
    memory = "shared" if in_shared else job.scene_memory
    if memory == "auto":  # constant memory takes the fewest registers
        memory = "constant" if not tree and bytes_of_scene(job) <= needs.CONSTANT_BYTES else "global"
    streamed = in_shared and not tree and bytes_of_scene(job) + 8 * threads > needs.SHARED_BYTES
    if streamed:
        if touches(job):
            worker.refuse("scene_memory shared: the scene is too large for it at once, and touches; use global")
        large = "scene_memory shared: the scene is too large for it at once, and"
        if walk == "table":
            worker.refuse(f"{large} walk table cannot be streamed; use global")
        if job.sampler == "adaptive":
            worker.refuse(f"{large} adaptive samples cannot be streamed; use global")
        if not streamable(job):
            worker.refuse(f"{large} CSG solids cannot be streamed; use global")
    simulated = os.environ.get("NUMBA_ENABLE_CUDASIM") == "1"
    if simulated and job.floating_point != "strict":
        worker.refuse(f"floating_point {job.floating_point}: the simulator of a GPU is strict")
    if simulated and job.gpu_wait != "auto":
        worker.refuse(f"gpu_wait {job.gpu_wait}: the simulator of a GPU has no driver that waits")
    return {
        "walk": "stack" if streamed else walk,
        "target": "cuda",
        "simulated": simulated,
        "threads": threads,
        "memory": memory,
        "strided": job.total_threads > 0 or -(-(job.region[3] - job.region[1]) // job.block_height) > needs.GRID_ROWS,
        "streamed": streamed,
        "fault": FAULTS.get(job.variant, ""),
    }


def must_share(job):
    """Put a job of a list off whose kernel or threads are not those that this process has."""
    asked = job.kind, job.variant, job.precision, job.threads, job.cache, needs.constants()
    if held.setdefault("kernel", asked) != asked:
        raise worker.Apart("this process has compiled another kernel")


def main(arguments):
    job = worker.Job(arguments)
    if os.environ.get("RAYRACE_CUDASIM") == "1":
        os.environ["NUMBA_ENABLE_CUDASIM"] = "1"  # before Numba is imported
    with worker.importing():
        prepare(job)
        must_share(job)
        if needs.TARGET == "cuda":
            from .gpu.run import run
        else:
            from .run import run
    run(job)


if __name__ == "__main__":
    worker.serve(main, sys.argv[1:])
