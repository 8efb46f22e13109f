"""Writes a job as a POV-Ray scene, `scene.pov` in `out`. Needs no POV-Ray."""

import sys

from renderers import worker

FILE = "scene.pov"
FEATURES = [
    *("sphere", "box", "polygon", "ellipsoid", "mesh", "csg"),
    *("ambient", "diffuse", "phong", "shadows", "reflection", "transmission", "attenuation", "media"),
    *("supersampling", "region"),
]


def write(job):
    """Writes the job to `out` as a POV-Ray scene; refuses a job whose picture POV-Ray would make differently."""
    from .scene import Scene, Unmappable

    with worker.phase("load"):
        try:
            text = Scene(job).text()
        except Unmappable as error:
            worker.refuse(str(error))
        with open(job.output(FILE), "w", encoding="utf-8") as file:
            file.write(text)


def require(job):
    worker.require(job, FEATURES)
    if job.kind != "image":
        worker.refuse("does not answer lists of rays")


def main():
    job = worker.Job(sys.argv[1:])
    require(job)
    with worker.importing():
        import renderers.povray.scene  # noqa: F401
    write(job)
    worker.say("output", file=FILE)


if __name__ == "__main__":
    main()
