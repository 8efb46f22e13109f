"""Traces eye rays from places of the picture, and returns their colours."""

import math
from functools import partial

from ..trace import Tracer
from .camera import Camera, Lens


class Eye:
    """Looks at places of the picture: `look(x, y, pixel, sample)` is the colour there.

    other: an eye of the same job, whose pinhole it shares, as one thread's eye does with another's. Where rays are cut
    off, `dropped` grows by the dropped weight of each sample (CUT-2).
    """

    def __init__(self, scene, job, other=None):
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
            self.camera = other.camera if other else Camera(*scene.camera, job.width, job.height, scene.number)
            self.look = self.through_pinhole
            if other is None:
                scene.look_from(self.camera.eye)
        self.dropped = 0
        if self.tracer.cuts:
            self.look = partial(self.noting, self.look)

    def through_pinhole(self, x, y, pixel, sample):
        return self.follow(*self.camera.ray(x, y), pixel, sample)

    def through_lens(self, x, y, pixel, sample):
        u2, u3 = self.tracer.random.lens(pixel, sample)
        return self.follow(*self.camera.ray(x, y, u2, u3), pixel, sample)

    def noting(self, look, *place):
        """Looks, and notes the weight that was cut off."""
        self.tracer.dropped = 0
        colour = look(*place)
        self.dropped += self.tracer.dropped
        return colour

    def follow(self, origin, direction, pixel, sample):
        """The colour of an eye ray, counted (CNT-1, CNT-2)."""
        counts = self.tracer.counts
        counts.primary += 1
        colour = self.tracer.colour(origin, direction, pixel, sample)
        red, green, blue = colour
        if not (math.isfinite(red) and math.isfinite(green) and math.isfinite(blue)):
            counts.non_finite += 1
        return colour
