"""Runs one job: a picture, or the first hits of a list of rays."""

from renderers import worker

with worker.importing():
    import math
    import sys
    from array import array
    from itertools import chain

    from . import npy
    from .camera import Camera, Lens
    from .csg import TooManyCrossings
    from .number import number
    from .sample import SAMPLERS
    from .scene import Scene, first_hit
    from .trace import Counts, Tracer
    from .vector import normalise
    from .walk import CannotWalk

FEATURES = (
    *("sphere", "box", "polygon", "ellipsoid", "mesh", "csg"),
    *("ambient", "diffuse", "phong", "shadows", "soft"),
    *("reflection", "transmission", "attenuation", "media", "glossy"),
    *("supersampling", "adaptive", "lens", "region", "rays"),
)
METHODS = {
    "sampler": SAMPLERS,
    "walk": ("least", "recursion", "table", "stack", "chain"),
    "accel": ("auto", "none", "bvh"),
    "glossy_weight": ("plain", "study"),
}
NOT_FINITE = math.nan, math.nan, math.nan


class Eye:
    """Looks at places of the picture: `look(x, y, pixel, sample)` is the colour there."""

    def __init__(self, scene, job):
        self.tracer = Tracer(scene, job)
        if "lens" in job.needs:
            real = scene.number.real
            self.camera = Lens(
                *scene.camera,
                *(job.width, job.height, scene.number),
                radius=real(job.lens_radius),
                focal_distance=real(job.focal_distance),
            )
            self.look = self.through_lens
        else:
            self.camera = Camera(*scene.camera, job.width, job.height, scene.number)
            self.look = self.through_pinhole

    def through_pinhole(self, x, y, pixel, sample):
        return self.follow(*self.camera.ray(x, y), pixel, sample)

    def through_lens(self, x, y, pixel, sample):
        _, _, u2, u3 = self.tracer.random.numbers(pixel, sample, 0, 0)
        return self.follow(*self.camera.ray(x, y, u2, u3), pixel, sample)

    def follow(self, origin, direction, pixel, sample):
        """The colour of an eye ray, counted (CNT-1, CNT-2)."""
        counts = self.tracer.counts
        counts.primary += 1
        try:
            colour = self.tracer.colour(origin, direction, pixel, sample)
        except TooManyCrossings:
            colour = NOT_FINITE
        red, green, blue = colour
        if not (math.isfinite(red) and math.isfinite(green) and math.isfinite(blue)):
            counts.non_finite += 1
        return colour


def picture(eye, job, number):
    """One frame: the pixels of the region as floats in C order, and the ray counts."""
    counts = eye.tracer.counts = Counts()
    pixels = array("d")
    for colour in SAMPLERS[job.sampler](eye.look, job, number, eye.tracer.random):
        pixels.extend(map(float, colour))
    return pixels, counts


def hits(scene, rays):
    """One frame: a row (t, point, normal, object) of floats for each ray."""
    rows = []
    for ray in rays:
        try:
            hit = first_hit(scene, ray[0:3], normalise(ray[3:6], scene.number.sqrt), math.inf)
        except TooManyCrossings:
            rows.append((math.nan,) * 7 + (-1,))
            continue
        if hit is None:
            rows.append((math.inf, 0, 0, 0, 0, 0, 0, -1))
        else:
            t, point, normal, shape = hit
            rows.append(tuple(map(float, (t, *point, *normal, shape.identity))))
    return rows


def main(arguments):
    job = worker.Job(arguments)
    worker.require(job, FEATURES)
    for method, choices in METHODS.items():
        chosen = getattr(job, method)
        if chosen not in choices:
            worker.refuse(f'no {method} "{chosen}": {", ".join(choices)}')
    try:
        kind_of_number = number(job.precision)
    except ValueError as error:
        worker.refuse(str(error))
    with worker.phase("load"):
        scene = Scene(job, kind_of_number)
        if job.kind == "rays":
            rays = [tuple(map(kind_of_number.real, row)) for row in npy.read(job.array("rays"))]
        else:
            try:
                eye = Eye(scene, job)
            except CannotWalk as error:
                worker.refuse(str(error))
    methods = {"precision": job.precision, "threads": 1, "contraction": "off", "accel": scene.accel}
    if job.kind == "rays":
        rows = worker.render(job, lambda: hits(scene, rays))
        with worker.phase("save"):
            npy.write(job.output("hits.npy"), chain.from_iterable(rows), (len(rows), 8))
            worker.say("output", file="hits.npy")
    else:
        pixels, counts = worker.render(job, lambda: picture(eye, job, kind_of_number))
        with worker.phase("save"):
            x0, y0, x1, y1 = job.region
            npy.write(job.output("image.npy"), pixels, (y1 - y0, x1 - x0, 3))
            worker.say_rays(counts.primary, counts.reflected, counts.shadow, counts.non_finite, counts.transmitted)
            worker.say("output", file="image.npy")
        methods |= eye.tracer.methods(job)
    worker.say("used", features=job.needs, methods=methods)
    worker.say_python_versions()


if __name__ == "__main__":
    main(sys.argv[1:])
