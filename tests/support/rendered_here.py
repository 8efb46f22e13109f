"""Jobs of renderers/opencl, done in the process of the test, where a stand-in can take a device's place."""

import json
import tempfile
from pathlib import Path

import numpy as np

from harness.renderer import job as jobs
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs
from harness.scene.needs import shapes as shapes_of
from renderers import worker
from renderers.opencl import method, run

SMALL = {"width": 15, "height": 11, "block_width": 4, "block_height": 3}


def flags(folder, source, variant, rays=None, **parameters):
    """The flags of a job, written to a new folder in `folder`, where its output belongs too."""
    folder = Path(tempfile.mkdtemp(dir=folder)) / "job"
    scene = text.read(source, "scene") if isinstance(source, str) else source
    wanted = Parameters(**{**SMALL, **parameters, **({} if rays is None else {"kind": "rays"})})
    needed = needs(scene, wanted) if rays is None else shapes_of(scene)
    jobs.write(folder, flatten(scene) if rays is None else {**flatten(scene), "rays": rays}, wanted, needed)
    return jobs.flags(folder, folder, variant, None, wanted, needed)


def render(folder, capsys, session, source, variant, rays=None, **parameters):
    """The array that the job makes, and its events by name. session: the class that `run` works with."""
    capsys.readouterr()
    job = worker.Job(flags(folder, source, variant, rays, **parameters))
    method.check(job)
    run.run(job, session)
    said = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    name = next(event["file"] for event in said if event["event"] == "output")
    return np.load(Path(job.out) / name), {event["event"]: event for event in said}
