"""Parts of scenes whose picture is known on paper, in any orientation."""

import math

import numpy as np
from random_scenes import words

from harness.picture.colour import decode

TOLERANCE = 1e-12
OPAQUE = "(0,0,0)"


def linear(*srgb):
    return decode(np.array(srgb))


def turned(rng):
    """A random rotation matrix: nothing in these scenes may depend on the axes."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def camera(turn, eye, half=1.0, towards=(0, 0, -1)):
    """A camera at `eye` that looks along `towards` (both before turning), its screen at distance 1."""
    z = np.array(towards, dtype=float) / np.linalg.norm(towards)
    x = np.cross(z, (0.31, 0.83, 0.47))
    x /= np.linalg.norm(x)
    y = np.cross(x, z)
    parts = np.array(eye) + z, half * x, half * y, -z
    return "CAMERA " + " ".join(words(turn @ part) for part in parts) + "\n"


def square(turn, centre, x, y, material):
    """A polygon centre ± x ± y."""
    centre, x, y = (np.array(v, dtype=float) for v in (centre, x, y))
    corners = [centre - x - y, centre + x - y, centre + x + y, centre - x + y]
    return f"POLYGON 4 {' '.join(words(turn @ corner) for corner in corners)}\n{material}\n"


def close(colour, expected):
    np.testing.assert_allclose(colour, np.broadcast_to(expected, np.shape(colour)), rtol=0, atol=TOLERANCE)


def reflectance(index, cosine):
    """Fresnel's R of unpolarised light that meets a medium of relative index `index` under this cosine (mu = 1)."""
    root = 1 - (1 - cosine**2) / index**2
    if root <= 0:
        return 1.0
    inside = np.sqrt(root)
    perpendicular = (cosine - index * inside) / (cosine + index * inside)
    parallel = (index * cosine - inside) / (index * cosine + inside)
    return (perpendicular**2 + parallel**2) / 2


def rough_mirror(turn, exponent, degrees=40):
    """Scene text of a rough mirror, seen under an angle in a white room. Also the mirrored direction and n."""
    angle = math.radians(degrees)
    way = np.array([math.sin(angle), 0, -math.cos(angle)])
    rough = f"(0,0,0) 0.8 7 (0,0,0) 9 1 {math.sqrt(2 / (exponent + 2))!r}"
    source = camera(turn, -3 * way, 1e-13, towards=way) + "BACKGROUND (1,1,1)\n"
    source += square(turn, (0, 0, 0), (60, 0, 0), (0, 60, 0), rough)
    return source, turn @ (way * (1, 1, -1)), turn @ (0, 0, 1)
