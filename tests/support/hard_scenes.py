"""Random scenes in which a truth can be wrong: light after many reflections, behind dim mirrors, below a pixel."""

import numpy as np
from random_scenes import words

SMALL = "glint", "needle"  # than a pixel
OPAQUE = "(0,0,0) 1e30 1"  # reflects all that its k_s says


def kind(number: int) -> str:
    return list(SCENES)[number % len(SCENES)]


def draw(number: int, seed: str) -> str:
    """The text of a scene."""
    return SCENES[kind(number)](np.random.default_rng([number, *seed.encode()]))


def _camera(rng, distance=3.0):
    tilt = rng.uniform(-0.1, 0.1, 4)
    return f"CAMERA {words(tilt[:3])} (1,0,{tilt[3]}) (0,0.8,0) (0,0,{distance})\n"


def _lights(rng, largest=1.0):
    bright = rng.uniform(0.5, 1, 3) * largest
    return f"AMBIENT {words(rng.uniform(0.05, 0.3, 3))}\nLIGHT {words(rng.uniform(2, 6, 3))} {words(bright)} 0\n"


def _sky(rng):
    return f"BACKGROUND {words(rng.uniform(0.3, 1, 3))}\n"


def guide(rng):
    """The eye in a long glass rod: what is behind its walls is seen at its ends alone, after so many reflections."""
    long, rod = 10 ** rng.uniform(0.5, 4), rng.uniform(0.4, 0.9, 2)
    clear = words(rng.uniform(0.9, 1, 3) ** (1 / long))
    box = f"BOX ({-rod[0]},{-rod[1]},{-long}) ({2 * rod[0]},0,0) (0,{2 * rod[1]},0) (0,0,{long + 3.5})"
    return f"{_camera(rng)}{_sky(rng)}{_lights(rng)}{box} (0,0,0) 1 9 {clear} {rng.uniform(1.8, 4)} 1\n"


def corridor(rng):
    """Between mirrors that keep 0.9 to all of the light, before a sky or a ball at the end."""
    keep, half = 1 - 10 ** rng.uniform(-5, -1), 10 ** rng.uniform(1, 5)
    mirror = f"{words(rng.uniform(0, 0.1, 3) * (rng.uniform() < 0.5))} {keep} 30 {OPAQUE}"
    low, high = rng.uniform(0.8, 1.5, 2)
    slabs = [f"BOX ({-half},{y},{-half}) ({2 * half},0,0) (0,{y},0) (0,0,{2 * half}) {mirror}\n" for y in (-low, high)]
    return _camera(rng) + _sky(rng) + _lights(rng) + "".join(slabs)


def dim(rng):
    """Mirrors of a k_s of 1e-4 to 1e-2 before a sky of 10 to 300, as it is written."""
    sky, k_s = 10 ** rng.uniform(1, 2.5), 10 ** rng.uniform(-4, -2)
    balls = [
        f"SPHERE {words((x, rng.uniform(-0.3, 0.3), -1))} {rng.uniform(0.8, 1)} (0.1,0.1,0.1) {k_s} 9 {OPAQUE}\n"
        for x in (-1.1, 1.1)
    ]
    wall = f"POLYGON 4 (-9,-9,-4) (9,-9,-4) (9,9,-4) (-9,9,-4) (0.2,0.3,0.2) {k_s} 9 {OPAQUE}\n"
    return f"{_camera(rng)}BACKGROUND ({sky},{sky},{sky})\n{_lights(rng)}{''.join(balls)}{wall}"


def glint(rng):
    """Shiny balls whose highlights are far below a pixel."""
    exponent, bright = 10 ** rng.uniform(3.5, 6), 10 ** rng.uniform(0, 1)
    balls = [
        f"SPHERE {words(rng.uniform(-1, 1, 3) * [1, 0.8, 1] - [0, 0, 2])} {10 ** rng.uniform(-1.3, -0.3)}"
        f" {words(rng.uniform(0, 0.2, 3))} {rng.uniform(0.3, 1)} {exponent} {OPAQUE}\n"
        for _ in range(int(rng.integers(1, 30)))
    ]
    return _camera(rng) + _lights(rng, bright) + "".join(balls)


def needle(rng):
    """Bright splinters, a hundredth to a tenth of a pixel wide."""
    bright, found = 10 ** rng.uniform(0, 1), []
    for _ in range(int(rng.integers(1, 20))):
        x, y, turn, long = rng.uniform(-1, 1), rng.uniform(-0.8, 0.8), rng.uniform(0, np.pi), 10 ** rng.uniform(-1.5, 0)
        way, wide = np.array([np.cos(turn), np.sin(turn), 0]), 10 ** rng.uniform(-3.8, -2.5)
        side = wide * np.array([-way[1], way[0], 0])
        middle = np.array([x, y, rng.uniform(-0.2, 0)])
        corners = [middle + s * long / 2 * way + t * side / 2 for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        found.append(f"POLYGON 4 {' '.join(map(words, corners))} (1,1,1) 0 1 {OPAQUE}\n")
    return f"{_camera(rng)}AMBIENT ({bright},{bright},{bright})\n{''.join(found)}"


SCENES = {"guide": guide, "corridor": corridor, "dim": dim, "glint": glint, "needle": needle}
