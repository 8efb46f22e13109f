"""S24: the number of threads does not change a byte of a picture."""

import numpy as np

from harness.process.repetition import METHODS
from harness.scene.model import Light, Material, Scene, Sphere
from harness.stress.exact import triple
from harness.stress.row import Finding, Row, Trial, in_general_position, rounded
from harness.stress.view import CLEAR, OPAQUE, WHITE, camera

SIDE = 32  # pixels
SEED = 24  # of the scene, which must be the same at every level

# The first picture of each renderer, precision and set of methods; the others are compared with it.
FIRST: dict[str, np.ndarray] = {}


def busy(threads, precision):
    """A scene in which all features that use random numbers are on: soft shadows, glossy rays, jittered samples."""
    rng = np.random.default_rng(SEED)
    turn = in_general_position(rng)

    def ball(where, radius, *optics):
        material = Material(triple(rng.uniform(0.1, 0.6, 3)), *optics)
        return Sphere(material, triple(rounded(turn @ where, precision)), float(rounded(radius, precision)))

    kinds = (0.6, 40.0, OPAQUE, 400.0, 1.0, 0.22), (0.9, 40.0, CLEAR, 2.25, 1.0), (0.0, 1.0, OPAQUE, 1.0, 1.0)
    balls = [ball(rng.uniform(-2, 2, 3), rng.uniform(0.4, 0.8), *kinds[k % 3]) for k in range(9)]
    lights = [Light(triple(rounded(turn @ at, precision)), (0.7, 0.6, 0.5), 0.5) for at in ([4, 5, 6], [-5, 4, 3])]
    seen = camera(turn @ [0, 0, 7], np.zeros(3), 2.5 * turn[:, 0], 2.5 * turn[:, 1], precision)
    scene = Scene(seen, tuple(balls), tuple(lights), (0.2, 0.2, 0.2), WHITE)

    def judge(result):
        picture = result.array
        standard = FIRST.setdefault(who(result, precision), picture)
        differ = (picture.view(np.uint8) != standard.view(np.uint8)).sum() if picture is not standard else 0
        return Finding(picture.nbytes, differ)

    parameters = {"width": SIDE, "height": SIDE, "depth": 3, "shadows": True, "sampler": "jittered", "samples": 2}
    return Trial(scene, judge, parameters={**parameters, "feelers": 2, "glossy_rays": 2, "threads": threads})


def who(result, precision):
    """Identifies a picture's origin by everything that may change it, except the number of threads."""
    said = result.said
    methods = {name: said.used["methods"].get(name) for name in METHODS}
    return repr((said.versions, said.device and said.device.get("name"), methods, precision))


ROWS = (
    Row(
        name="threads",
        code="S24",
        title="Pictures by the number of threads",
        stress="threads",
        failure="bytes that differ from the renderer's first picture",
        levels=(1.0, 2.0, 3.0, 5.0, 8.0),
        logarithmic=False,
        make=lambda level, precision, rng: busy(int(level), precision),
    ),
)
