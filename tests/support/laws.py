"""A renderer whose errors and times follow laws that a test sets. No process runs."""

import time
from types import SimpleNamespace

import numpy as np

from harness.choice.trial import Trial
from harness.process.repetition import Result
from harness.renderer.events import Said
from harness.renderer.parameters import Parameters

NEEDS = ("diffuse", "reflection", "sphere")
ARRAYS = {
    "materials": np.ones((1, 11)), "lights": np.zeros((0, 7)), "ambient": np.zeros(3), "background": np.full(3, 1e-6),
    "air": np.ones(5),
}  # fmt: skip


class Laws:
    """Its pictures are 0.5, with the noise `sampled` / n of n x n samples, the `bias` of float32, and what depths leave
    out: `deep` for each order less than 8, to which rays go. Of the scene all white they are the weights of these. A
    frame takes 1 s for each sample of a pixel, half of that in float32.

    lie: times the noise of tiles, as compared with that of the whole picture.
    """

    def __init__(self, sampled=0.1, bias=0.0, deep=0.0, lie=1.0, hard=None):
        self.sampled, self.bias, self.deep, self.lie, self.hard = sampled, bias, deep, lie, hard
        self.jobs = []

    def needs(self, job):
        return (*NEEDS, *(["supersampling"] if job.sampler in ("uniform", "jittered") else []))

    def entry(self, name="law"):
        manifest = SimpleNamespace(
            name=name,
            external=False,
            build=None,
            features=(*NEEDS, "supersampling", "region", "cutoff"),
            methods={"precision": ("float64", "float32")},
        )
        renderer = SimpleNamespace(folder=None, manifest=manifest, given=lambda job, needs: needs)
        variant = SimpleNamespace(threads=1, device="cpu")
        return SimpleNamespace(
            name=name, renderer=renderer, variant=variant, methods=manifest.methods, unavailable=None, threads=lambda: 1
        )

    def picture(self, job):
        n = 1 if job.sampler == "one" else job.samples
        rng = np.random.default_rng([job.seed, n, len(job.sampler)])
        noise = rng.normal(0, self.sampled / n, (job.height, job.width, 3))
        if self.hard is not None:
            noise *= self.hard
        x0, y0, x1, y1 = job.bounds()
        part = (x1 - x0, y1 - y0) != (job.width, job.height)
        noise = noise * (self.lie if part else 1.0)
        left = self.deep * max(0, 8 - job.depth) + self.bias * (job.precision == "float32")
        return (0.5 + noise + left)[y0:y1, x0:x1]

    def run(self, entry, arrays, job, needs, timeout=0.0, cache=None):
        self.jobs.append(job)
        array = np.full(job.shape(), 1.0 + min(job.depth, 8)) if arrays["ambient"].all() else self.picture(job)
        n = 1 if job.sampler == "one" else job.samples
        seconds = n**2 * (0.5 if job.precision == "float32" else 1.0) * array.size / (job.width * job.height * 3)
        rays = {"primary": n**2 * array.size, "reflected": n**2 * array.size * min(job.depth, 8)}
        said = Said()
        said.frames, said.rays = [{"start": 0.0, "end": seconds, "renders": 1}], rays
        return Result("ok", "", None, said, array)


def trial(laws, limit, width=96, height=80, seconds=1e9, **more):
    """A trial of a picture that a renderer by `laws` makes."""
    known = {"cpp-threads": laws.entry("cpp-threads")}
    job = Parameters(width=width, height=height, **more)
    return Trial(ARRAYS, laws.needs, job, known, limit, "scene", laws.run, time.monotonic() + seconds)
