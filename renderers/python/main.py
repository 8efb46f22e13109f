"""Runs one job: a picture, or the first hits of a list of rays."""

from renderers import worker

with worker.importing():
    import math
    import sys
    from array import array
    from functools import partial
    from itertools import chain
    from operator import itemgetter

    from . import npy
    from .eye.eye import Eye
    from .eye.sample import SAMPLERS
    from .number import number
    from .scene import Scene, first_hit
    from .trace import Counts
    from .vector import dot, normalise
    from .walk import CannotWalk

FEATURES = (
    *("sphere", "box", "polygon", "ellipsoid", "mesh", "csg"),
    *("ambient", "diffuse", "phong", "shadows", "soft"),
    *("reflection", "transmission", "attenuation", "media", "contact", "glossy"),
    *("supersampling", "sobol", "adaptive", "lens", "cutoff", "region", "rays"),
)
METHODS = {
    "sampler": SAMPLERS,
    "walk": ("least", "recursion", "table", "stack", "chain"),
    "accel": ("auto", "none", "bvh"),
    "sphere": ("robust", "textbook", "stable", "wide"),
    "triangle": ("watertight", "moller-trumbore"),
    "slab": ("branch", "plain"),
    "csg": ("intervals", "stepping"),
    "merge": ("tolerant", "none"),
    "offset": ("bounded", "relative", "fixed", "none"),
    "fresnel": ("clamped", "unclamped"),
    "phong": ("clamped", "unclamped"),
    "renormalise": ("on", "off"),
    "floating_point": ("strict",),
    "glossy_weight": ("plain", "study"),
}
PARTED = "python-processes", "python-threads"  # the variants of parts.py
USED_WITH = {  # methods, each with the features for which it matters
    "sphere": ("sphere", "ellipsoid"),
    "triangle": ("polygon", "mesh"),
    "slab": ("box",),
    "csg": ("csg",),
    "merge": ("csg", "contact"),
    "offset": ("reflection", "transmission", "shadows"),
    "fresnel": ("reflection", "transmission"),
    "phong": ("phong",),
    "renormalise": ("reflection", "transmission"),
}


def picture(eye, job, number, region):
    """One frame: the pixels of the region as floats in C order, the ray counts, and the dropped weights if any."""
    counts = eye.tracer.counts = Counts()
    pixels, dropped = array("d"), array("d")
    samples = {"one": 1, "sobol": job.spp}.get(job.sampler, job.samples**2)
    for colour in SAMPLERS[job.sampler](eye.look, job, number, eye.tracer.random, region):
        pixels.extend(map(float, colour))
        if eye.tracer.cuts:  # CUT-2
            dropped.append(float(eye.dropped / samples))
            eye.dropped = 0
    return pixels, counts, dropped


def hits(scene, rays):
    """One frame: a row (t, point, normal, object) of floats for each ray."""
    rows = []
    for ray in rays:
        hit = first_hit(scene, ray[0:3], unit(ray[3:6], scene.number), math.inf)
        if hit is None:
            rows.append((math.inf, 0, 0, 0, 0, 0, 0, -1))
        else:
            t, point, normal, shape = hit
            rows.append(tuple(map(float, (t, *point, *normal, shape.identity))))
    return rows


def frames(job, scene, eye, rays, number):
    """The answer of all frames of a job: of `hits`, or of `picture`."""
    if job.variant not in PARTED:
        if job.kind == "rays":
            return worker.render(job, lambda: hits(scene, rays))
        return worker.render_checked(job, lambda _: picture(eye, job, number, job.region), itemgetter(0))
    from . import parts  # whose modules the baseline does without

    if job.kind == "rays":
        lists = [rays[i : i + parts.RAYS] for i in range(0, len(rays), parts.RAYS)]
        with parts.workers(job, partial(hits, scene)) as deal:
            return worker.render(job, lambda: list(chain.from_iterable(deal(lists))))

    def part(own, task):
        region, job.sample = task  # which another process has not heard of
        return picture(own, job, number, region)

    painter, regions = parts.Painter(lambda: Eye(scene, job, eye), part), parts.regions(job)
    with parts.workers(job, painter) as deal:

        def frame(_):
            return parts.joined(deal([(region, job.sample) for region in regions]), Counts())

        return worker.render_checked(job, frame, itemgetter(0))


def unit(direction, number):
    """The unit direction of a given ray; unchanged if its length is 1 up to rounding (NUM-4)."""
    if abs(dot(direction, direction) - 1) <= 4 * number.roundoff:
        return direction
    return normalise(direction, number.sqrt)


def accept(arguments):
    """The job and its Number, unless it is refused."""
    job = worker.Job(arguments)
    worker.require(job, FEATURES)
    for method, choices in METHODS.items():
        chosen = getattr(job, method)
        if chosen not in choices:
            worker.refuse(f'no {method} "{chosen}": {", ".join(choices)}')
    if job.variant in PARTED:
        from . import parts

        if reason := parts.refusal(job):
            worker.refuse(reason)
    try:
        return job, number(job.precision)
    except ValueError as error:
        worker.refuse(str(error))


def eye_of(scene, job):
    """The Eye of a job, unless its walk is refused."""
    try:
        return Eye(scene, job)
    except CannotWalk as error:
        worker.refuse(str(error))


def main(arguments):
    job, kind_of_number = accept(arguments)
    with worker.phase("load"):
        scene, eye, rays = Scene(job, kind_of_number), None, None
        if job.kind == "rays":
            rays = [tuple(map(kind_of_number.real, row)) for row in npy.read(job.array("rays"))]
        else:
            eye = eye_of(scene, job)
    if scene.accel == "bvh":
        with worker.phase("build"):
            scene.build()
    methods = {
        "precision": job.precision,
        "threads": job.threads if job.variant in PARTED else 1,
        "floating_point": job.floating_point,
        "accel": scene.accel,
    }
    methods |= {
        method: getattr(job, method) for method, with_any in USED_WITH.items() if set(with_any) & set(job.needs)
    }
    if job.kind == "rays":
        rows = frames(job, scene, eye, rays, kind_of_number)
        with worker.phase("save"):
            npy.write(job.output("hits.npy"), chain.from_iterable(rows), (len(rows), 8))
            worker.say("output", file="hits.npy")
    else:
        pixels, counts, dropped = frames(job, scene, eye, rays, kind_of_number)
        with worker.phase("save"):
            x0, y0, x1, y1 = job.region
            npy.write(job.output("image.npy"), pixels, (y1 - y0, x1 - x0, 3))
            worker.say_rays(counts.primary, counts.reflected, counts.shadow, counts.non_finite, counts.transmitted)
            outputs = {"file": "image.npy"}
            if eye.tracer.cuts:
                outputs["dropped"] = "dropped.npy"
                npy.write(job.output("dropped.npy"), dropped, (y1 - y0, x1 - x0))
            worker.say("output", **outputs)
        methods |= eye.tracer.methods(job)
    worker.say("used", features=job.needs, methods=methods)
    worker.say_python_versions()


if __name__ == "__main__":
    worker.serve(main, sys.argv[1:])
