"""Runs one job: a picture of spheres."""

import os
import sys

from renderers import worker

FEATURES = ("sphere", "ambient", "diffuse", "phong", "shadows", "reflection", "region")
METHODS = {"precision": ("float64", "float32"), "floating_point": ("strict", "contract")}


def surfaces(job, np):
    """Of each sphere: diffuse colour, k_s, exponent; and N and M of REF-1, entering and leaving."""
    materials, air = np.load(job.array("materials")), np.load(job.array("air"))
    of_sphere = materials[np.load(job.array("sphere_ids"))[:, 1]]
    n, mu = np.sqrt(of_sphere[:, 8] * of_sphere[:, 9]), of_sphere[:, 9]
    n_of_air, mu_of_air = np.sqrt(air[0] * air[1]), air[1]
    return of_sphere[:, :5], np.column_stack([n_of_air / n, mu_of_air / mu, n / n_of_air, mu / mu_of_air])


def main(arguments):
    job = worker.Job(arguments)
    worker.require(job, FEATURES)
    if job.kind != "image":
        worker.refuse("makes pictures only")
    for method, choices in METHODS.items():
        if getattr(job, method) not in choices:
            worker.refuse(f'no {method} "{getattr(job, method)}": ' + " or ".join(choices))
    if not hasattr(os, "sched_setaffinity"):
        worker.refuse("this system cannot keep a process on some cores, which is what limits XLA's threads")
    # XLA starts a thread for each core that it may run on, and has no option to start fewer.
    cores = sorted(os.sched_getaffinity(0))[: job.threads]
    os.sched_setaffinity(0, cores)
    flags = ["--xla_cpu_enable_fast_math=false"]
    if job.floating_point == "strict":  # XLA lets LLVM fuse products and sums, so it gets no such instruction (NUM-3)
        flags.append("--xla_cpu_max_isa=AVX")
    os.environ |= {"XLA_FLAGS": " ".join(flags), "JAX_PLATFORMS": "cpu", "JAX_ENABLE_X64": "1"}
    with worker.importing():
        import jax
        import numpy as np

        from .trace import Scene, render
    with worker.phase("load"):
        arrays = [np.load(job.array(name)) for name in ("camera", "ambient", "background", "lights", "spheres")]
        arrays += [*surfaces(job, np), np.array(job.epsilon)]
        scene = Scene(*(jax.device_put(array.astype(job.precision)) for array in arrays))
    with worker.phase("compile"):
        settings = job.region, (job.width, job.height), job.sample, job.depth, tuple(job.needs)
        compiled = render.lower(scene, *settings).compile()
    picture, reflected, feelers = worker.render(job, lambda: jax.block_until_ready(compiled(scene)))
    with worker.phase("save"):
        picture = np.asarray(picture)
        np.save(job.output("image.npy"), picture)
        worker.say("output", file="image.npy")
        pixels = picture.shape[0] * picture.shape[1]
        worker.say_rays(pixels, reflected, feelers, pixels - np.isfinite(picture).all(axis=-1).sum())
    methods = {"precision": job.precision, "threads": len(cores), "floating_point": job.floating_point}
    worker.say("used", features=job.needs, methods=methods | {"walk": "wavefront", "accel": "none"})
    versions = {"jax": jax.__version__, "jaxlib": jax.lib.__version__, "numpy": np.__version__}
    worker.say_python_versions(**versions, flags=os.environ["XLA_FLAGS"])


if __name__ == "__main__":
    main(sys.argv[1:])
