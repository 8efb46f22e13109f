"""Makes cameras, materials and eye rays for the rows that are pictures."""

import mpmath as mp
import numpy as np

from harness.scene.model import Camera, Material
from harness.stress.exact import triple
from harness.stress.row import ROUNDOFF, rounded

BLACK = OPAQUE = (0.0, 0.0, 0.0)
WHITE = CLEAR = (1.0, 1.0, 1.0)
MATTE = Material(WHITE, 0.0, 1.0, OPAQUE, 1.0, 1.0)
DIGITS = 50


def glass(eps_r: float = 2.25, mu_r: float = 1.0) -> Material:
    """A clear, lossless material without diffuse colour: it only reflects and transmits."""
    return Material(BLACK, 1.0, 1.0, CLEAR, eps_r, mu_r)


def camera(eye, centre, u, v, precision: str) -> Camera:
    """A Camera from an eye, the centre of the screen and its half-extents, all (3,), rounded to the precision.

    Eye and centre are moved to a grid of about four u of the largest coordinate, on which their difference and sum are
    exact, so the renderer's C + e (CAM-1) is the eye of the truth.
    """
    largest = max(np.abs(eye).max(), np.abs(centre).max(), np.abs(np.subtract(eye, centre)).max())
    step = 2.0 ** np.ceil(np.log2(largest)) * 4 * ROUNDOFF[precision]
    centre, eye = np.round(np.asarray(centre) / step) * step, np.round(np.asarray(eye) / step) * step
    return Camera(triple(centre), triple(rounded(u, precision)), triple(rounded(v, precision)), triple(eye - centre))


def fan(eye, towards, across, spread: float, tilt: float, precision: str) -> Camera:
    """A Camera for one row of pixels: eye rays around `towards`, within angles of about `spread` along `across` and
    `tilt` at right angles to it. towards, across: unit vectors (3,) at right angles. The angle to a third vector at
    right angles to `across` changes by the tilt, and by the square of the spread."""
    eye, towards, across = map(np.asarray, (eye, towards, across))
    aside = np.cross(across, towards)
    u, v = spread * across + tilt * aside, spread * aside - tilt * across
    return camera(eye, eye + towards, u, v, precision)


def sides(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """X (width,) and Y (height,) of the pixels' centres (CAM-2); exact if the sizes are powers of 2."""
    return 2 * (np.arange(width) + 0.5) / width - 1, 1 - 2 * (np.arange(height) + 0.5) / height


def eye_rays(seen: Camera, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """The eye (3,) and unit directions (height, width, 3) through the pixels' centres."""
    x, y = sides(width, height)
    way = x[None, :, None] * np.array(seen.u) + y[:, None, None] * np.array(seen.v) - np.array(seen.e)
    return np.add(seen.centre, seen.e), way / np.linalg.norm(way, axis=-1, keepdims=True)


def exactly(values) -> list:
    """The values as numbers of mpmath."""
    return [mp.mpf(float(value)) for value in values]


def exact_rays(seen: Camera, width: int, height: int):
    """Yields (row, column, eye, unit direction) for each pixel's centre, rounded by mpmath alone."""
    centre, u, v, e = map(exactly, (seen.centre, seen.u, seen.v, seen.e))
    x, y = sides(width, height)
    for j in range(height):
        for i in range(width):
            way = [float(x[i]) * a + float(y[j]) * b - c for a, b, c in zip(u, v, e, strict=True)]
            yield j, i, [a + b for a, b in zip(centre, e, strict=True)], unit(way)


def unit(vector) -> list:
    size = mp.sqrt(mp.fdot(vector, vector))
    return [value / size for value in vector]


def minus(a, b) -> list:
    return [x - y for x, y in zip(a, b, strict=True)]


def cross(a, b) -> list:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
