"""Runs one job: a picture of spheres."""

import sys

from renderers import worker

FEATURES = ("sphere", "ambient", "diffuse", "phong", "shadows", "reflection", "region")


def tables(job, npy, sqrt):
    """The tables of the scene that `render` of kernel.py reads, as lists of rows."""
    camera, ambient, background, air, lights, materials, spheres, ids = (
        npy.read(job.array(name))
        for name in ("camera", "ambient", "background", "air", "lights", "materials", "spheres", "sphere_ids")
    )
    n_of_air, mu_of_air = sqrt(air[0] * air[1]), air[1]
    surfaces, exponents, optics = [], [], []
    for _, material in ids:
        row = materials[material]
        n, mu = sqrt(row[8] * row[9]), row[9]  # REF-1
        surfaces.append(row[:4])
        exponents.append(row[4:5])
        optics.append((n_of_air / n, mu_of_air / mu, n / n_of_air, mu / mu_of_air))
    camera = [*camera, (float(job.width), float(job.height))]
    return spheres, surfaces, exponents, optics, [row[:6] for row in lights], (ambient, background), camera


def main(arguments):
    job = worker.Job(arguments)
    worker.require(job, FEATURES)
    if job.kind != "image":
        worker.refuse("makes pictures only")
    if job.precision != "float64":
        worker.refuse(f'no precision "{job.precision}": float64')
    methods = {"precision": "float64", "threads": 1, "floating_point": "strict", "walk": "chain", "accel": "none"}
    versions = {}
    with worker.importing():
        from array import array
        from itertools import chain
        from math import isfinite, sqrt

        from . import npy

        if job.variant == "pypy":
            from . import kernel
        else:
            from . import build
    with worker.phase("load"):
        x0, y0, x1, y1 = job.region
        pixels = (x1 - x0) * (y1 - y0)
        table = list if job.variant != "cython" else lambda values: array("d", values)
        flat = [table(chain.from_iterable(rows)) for rows in tables(job, npy, sqrt)]
        picture, counts = table([0.0]) * (3 * pixels), table([0.0, 0.0])
        parameters = (x0, y0, x1 - x0, y1 - y0, *job.sample, job.depth, job.shadows, job.epsilon)
    if job.variant != "pypy":
        with worker.phase("compile"):
            try:
                kernel, found = build.compiled(job.variant, job.cache)
            except build.BuildError as error:
                worker.say("error", reason=str(error))
                sys.exit(1)
        methods["compile_cache"] = "warm" if found else "cold"
        package = build.PACKAGES[job.variant]
        versions = {package.lower(): build.version(package), "flags": " ".join(build.FLAGS)}
    worker.render(job, lambda: kernel.render(picture, counts, *flat, *parameters))
    with worker.phase("save"):
        npy.write(job.output("image.npy"), picture, (y1 - y0, x1 - x0, 3))
        worker.say("output", file="image.npy")
        broken = sum(not all(map(isfinite, picture[3 * pixel : 3 * pixel + 3])) for pixel in range(pixels))
        worker.say_rays(pixels, counts[0], counts[1], broken)
    worker.say("used", features=job.needs, methods=methods)
    worker.say_python_versions(**versions)


if __name__ == "__main__":
    main(sys.argv[1:])
