"""Runs one job: a picture, or the first hits of a list of rays."""

from renderers import worker

with worker.importing():
    import math
    import sys
    from array import array
    from itertools import chain

    from . import npy
    from .camera import Camera
    from .number import number
    from .scene import Scene, first_hit
    from .trace import Counts, trace
    from .vector import normalise

FEATURES = (
    *("sphere", "box", "polygon", "ellipsoid"),
    *("ambient", "diffuse", "phong", "shadows", "reflection", "region", "rays"),
)


def picture(scene, camera, job):
    """One frame: the pixels of the region as floats in C order, and the ray counts."""
    x0, y0, x1, y1 = job.region
    counts = Counts()
    pixels = array("d")
    for j in range(y0, y1):
        for i in range(x0, x1):
            origin, direction = camera.ray(i, j)
            colour = trace(scene, origin, direction, job.depth, job.shadows, counts)
            red, green, blue = map(float, colour)
            if not (math.isfinite(red) and math.isfinite(green) and math.isfinite(blue)):
                counts.non_finite += 1
            pixels.extend((red, green, blue))
    counts.primary = (x1 - x0) * (y1 - y0)
    return pixels, counts


def hits(scene, rays):
    """One frame: a row (t, point, normal, object) of floats for each ray."""
    rows = []
    for ray in rays:
        hit = first_hit(scene, ray[0:3], normalise(ray[3:6], scene.number.sqrt), math.inf)
        if hit is None:
            rows.append((math.inf, 0, 0, 0, 0, 0, 0, -1))
        else:
            t, point, normal, shape = hit
            rows.append(tuple(map(float, (t, *point, *normal, shape.identity))))
    return rows


def main(arguments):
    job = worker.Job(arguments)
    worker.require(job, FEATURES)
    try:
        kind_of_number = number(job.precision)
    except ValueError as error:
        worker.refuse(str(error))
    with worker.phase("load"):
        scene = Scene(job, kind_of_number)
        if job.kind == "rays":
            rays = [tuple(map(kind_of_number.real, row)) for row in npy.read(job.array("rays"))]
        else:
            camera = Camera(*scene.camera, job.width, job.height, job.sample, kind_of_number)
    if job.kind == "rays":
        rows = worker.render(job, lambda: hits(scene, rays))
        with worker.phase("save"):
            npy.write(job.output("hits.npy"), chain.from_iterable(rows), (len(rows), 8))
            worker.say("output", file="hits.npy")
    else:
        pixels, counts = worker.render(job, lambda: picture(scene, camera, job))
        with worker.phase("save"):
            x0, y0, x1, y1 = job.region
            npy.write(job.output("image.npy"), pixels, (y1 - y0, x1 - x0, 3))
            worker.say_rays(counts.primary, counts.reflected, counts.shadow, counts.non_finite)
            worker.say("output", file="image.npy")
    worker.say("used", features=job.needs, methods={"precision": job.precision, "threads": 1, "contraction": "off"})
    worker.say_python_versions()


if __name__ == "__main__":
    main(sys.argv[1:])
