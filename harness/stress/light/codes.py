"""S19: sRGB codes averaged as if they were light: edges become too dark, by tens of codes."""

import numpy as np

from harness.picture import colour
from harness.scene.model import Material, Polygon, Scene
from harness.stress.exact import triple
from harness.stress.row import Finding, Row, Trial, in_general_position, rounded
from harness.stress.view import OPAQUE, WHITE, camera

SIDE = 4  # pixels; column 0 is covered, column 1 partly, columns 2 and 3 are not
SAMPLES = 16  # a side
COVER, BACKGROUND = (1.0, 1.0, 0.8), (0.0, 0.2, 0.0)  # sRGB


def edge(share, precision, rng):
    """A pane in general position whose edge covers `share` of column 1, rounded to sixteenths."""
    share = round(share * SAMPLES) / SAMPLES
    turn, centre = in_general_position(rng), rounded(rng.uniform(-1, 1, 3), precision)

    def place(x, y):
        return triple(rounded(centre + turn @ [x, y, 0], precision))

    end = 2 * (1 + share) / SIDE - 1  # between two columns of samples
    pane = Polygon(
        Material(COVER, 0.0, 1.0, OPAQUE, 1.0, 1.0), (place(-9, -9), place(end, -9), place(end, 9), place(-9, 9))
    )
    seen = camera(centre + 3 * turn[:, 2], centre, turn[:, 0], turn[:, 1], precision)
    scene = Scene(seen, (pane,), ambient=WHITE, background=BACKGROUND)
    light = share * colour.decode(COVER) + (1 - share) * colour.decode(BACKGROUND)
    expected = colour.encode_8bit(light).astype(int)

    def judge(result):
        """The covered column tells whether the numbers are linear or sRGB; the renderer does not say."""
        whole = result.array[:, 0].astype(float)
        arithmetic = min(("linear", "srgb"), key=lambda name: np.abs(whole - flat(name)).max())
        off = np.abs(colour.codes(result.array[:, 1], arithmetic).astype(int) - expected)
        return Finding(off.size, (off > 1).sum(), off.ravel())

    parameters = {"width": SIDE, "height": SIDE, "depth": 0, "sampler": "uniform", "samples": SAMPLES}
    return Trial(scene, judge, parameters=parameters)


def flat(arithmetic):
    """The pane's colour as the renderer receives it."""
    return colour.decode(COVER) if arithmetic == "linear" else np.asarray(COVER)


def between_black_and_white(share, u, methods):
    """The error, in codes of 256, of a black pixel of which `share` is white."""
    return 255 * abs(float(colour.encode(share)) - share) if methods["arithmetic"] == "srgb" else 0.0


ROWS = (
    Row(
        name="codes",
        code="S19",
        title="Edges averaged in sRGB codes",
        stress="covered share of the pixel",
        failure="channels off by more than one code of 256",
        error="codes of 256",
        levels=tuple(k / SAMPLES for k in (1, 2, 4, 6, 8, 10, 12, 14, 15)),
        logarithmic=False,
        method="arithmetic",
        source="study, figure 2.6",
        make=edge,
        expected=between_black_and_white,
    ),
)
