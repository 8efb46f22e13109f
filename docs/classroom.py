"""Renders the pictures for teachers: python docs/classroom.py [FOLDER].

effects.png has each effect: with it, without it, and where the two differ. The others show a failure: the naive method
on the left, the robust one on the right, on the same scene.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from PIL import Image

from harness.picture import colour

ROOT = Path(__file__).parents[1]
WIDTH, GAP, MAGENTA = 240, 4, (255, 0, 255)
SAMPLES = ["--sampler", "jittered", "--samples", "4"]
FOCUS = ["--lens-radius", "0.18", "--focal-distance", "5"]
# Scene, options of all, those with the effect, those without it.
EFFECTS = {
    "shadows": ("gallery/shadows", SAMPLES, ["--shadows"], ["--no-shadows"]),
    "soft shadows": ("gallery/shadows", SAMPLES, ["--feelers", "8"], []),
    "mirrors": ("comparison", SAMPLES, ["--depth", "10"], ["--depth", "0"]),
    "glossy reflection": ("gallery/glossy", [*SAMPLES, "--depth", "3"], ["--glossy-rays", "4"], []),
    "glass, to depth 2": ("gallery/mirrors-and-glass", SAMPLES, ["--depth", "10"], ["--depth", "2"]),
    "lens": ("gallery/focus", SAMPLES, FOCUS, []),
    "supersampling": ("gallery/edges", [], SAMPLES, []),
}
LEAST = 1 / 255  # difference of linear RGB that is drawn black: a step of a screen of 8 bits

# A stage of the size `s`: a floor and a light; then what stands there.
STAGE = """CAMERA (0,{h},0) ({u},0,0) (0,{s},0) {e}
AMBIENT (0.25,0.25,0.27)
BACKGROUND (0.62,0.72,0.85)
LIGHT {light} (0.85,0.82,0.75) 0
BOX ({a},{b},{a}) ({c},0,0) (0,{a},0) (0,0,{c}) (0.55,0.5,0.42) 0 1 (0,0,0) 1 1
"""
BALLS = """SPHERE ({l},0,0) {r} (0.2,0.45,0.8) {k} {left} (0,0,0) 4 1
SPHERE ({m},0,0) {r} (0.8,0.3,0.2) {k} {right} (0,0,0) 4 1
"""
LOCAL = ["--depth", "0", "--phong"]  # no mirrors, which would hide the highlights
TINY = 7e-5  # size of a stage on which a fixed offset of 1e-4 is longer than a ball is high
FAILURES = {
    "leak": (TINY, "0", "1", "1", (-3, 5, 4), ["--offset", "fixed"], ["--offset", "bounded"]),
    "highlight": (1.0, "0.3", "2", "2.5", (-1, 2, 6), [*LOCAL, "unclamped"], [*LOCAL, "clamped"]),
}


def stage(size: float, share: str, left: str, right: str, light: tuple) -> str:
    """Returns a scene with two balls: their specular share, and the exponent of each."""
    place = ",".join(f"{size * side:g}" for side in light)
    lengths = {"h": 0.1, "u": 1.6, "s": 1.0, "e": 4, "a": -20, "b": -0.72, "c": 40, "l": -0.8, "m": 0.8, "r": 0.7}
    values = {name: f"{size * length:g}" for name, length in lengths.items()}
    return (STAGE + BALLS).format(**values, light=f"({place})", k=share, left=left, right=right)


def render(scene: str | Path, options: list[str], folder: Path, renderer: str = "numpy") -> np.ndarray:
    """Renders a scene; returns linear RGB (height, width, 3)."""
    file = folder / "picture.npy"
    file.unlink(missing_ok=True)
    words = ["render", scene, "--width", str(WIDTH), "-r", renderer, *options, "-o", file]
    subprocess.run([sys.executable, "-m", "rayrace", *words], check=True, capture_output=True)
    return np.load(file)


def shown(picture: np.ndarray) -> np.ndarray:
    """Returns a picture as a display shows it, with pixels that are no numbers in magenta."""
    finite = np.isfinite(picture).all(axis=-1, keepdims=True)
    return np.where(finite, colour.encode_8bit(np.where(finite, picture, 0.0)), np.uint8(MAGENTA))


def difference(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Returns the largest difference of the channels as colours on a logarithmic scale, black where there is none."""
    size = np.abs(one - other).max(axis=-1)
    scaled = 1 + np.log10(np.clip(size, LEAST, 1)) / -np.log10(LEAST)
    return np.uint8(255 * colormaps["inferno"](scaled)[..., :3])


def beside(pictures: list[np.ndarray]) -> np.ndarray:
    """Returns pictures of one height in a row."""
    gap = np.full((pictures[0].shape[0], GAP, 3), 255, np.uint8)
    return np.hstack([part for picture in pictures for part in (picture, gap)][:-1])


def write(out: Path) -> None:
    """Renders all of them into a folder."""
    out.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        for name, (scene, options, with_it, without) in EFFECTS.items():
            pictures = [render(scene, [*options, *more], folder) for more in (with_it, without)]
            row = beside([*map(shown, pictures), difference(*pictures)])
            Image.fromarray(row).save(out / f"{name.partition(',')[0].replace(' ', '-')}.png", optimize=True)
        for name, (size, share, left, right, light, naive, robust) in FAILURES.items():
            scene = folder / f"{name}.txt"
            scene.write_text(stage(size, share, left, right, light), "utf-8")
            ways = [[*SAMPLES, *options] for options in (naive, robust)]
            row = beside([shown(render(scene, options, folder, "numba")) for options in ways])  # NumPy has no naive way
            Image.fromarray(row).save(out / f"{name}.png", optimize=True)


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "classroom")
