"""Works out single pixels of a picture, one after the other as long as there is time (README.md, "Spots")."""

import sys
import time
from array import array

from renderers import worker

from . import npy
from .main import accept, eye_of, picture
from .scene import Scene


def spots(eye, job, number, wanted):
    """The pixels (i, j) of `wanted`, as they are in the picture, as floats; none is begun after `job.seconds`."""
    pixels = array("d")
    for i, j in wanted:
        if time.monotonic() - worker.START > job.seconds:
            break
        pixels += picture(eye, job, number, (i, j, i + 1, j + 1))[0]
    return pixels


def main(arguments):
    job, number = accept(arguments)
    with worker.phase("load"):
        scene = Scene(job, number)
        eye = eye_of(scene, job)
        wanted = npy.read(job.array("spots"))
    if scene.accel == "bvh":
        with worker.phase("build"):
            scene.build()
    with worker.phase("render"):
        pixels = spots(eye, job, number, wanted)
    with worker.phase("save"):
        npy.write(job.output("spots.npy"), pixels, (len(pixels) // 3, 3))
        worker.say("output", file="spots.npy")


if __name__ == "__main__":
    main(sys.argv[1:])
