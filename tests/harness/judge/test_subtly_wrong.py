"""A renderer that is made subtly wrong is rejected, whatever it is; and unharmed it is not."""

import shutil
from pathlib import Path

import pytest

import renderers

SCENE = """CAMERA (0,0,0) (1,0,0) (0,0.8,0) (0,0,4)
AMBIENT (0.1,0.1,0.1)
LIGHT (4,5,6) (0.9,0.9,0.8) 0
LIGHT (-3,1,5) (0.5,0.5,0.6) 0
BOX (-0.7,-0.6,-1.1) (0.8,0.1,0.1) (-0.1,0.7,0) (0.05,0.1,0.6)
(0.7,0.5,0.3) 0.2 20 (0,0,0) 1e6 1
SPHERE (0.5,0.1,-0.3) 0.4 (0.3,0.5,0.7) 0.4 20 (0,0,0) 1e6 1
"""
FACE = "(add(corner, edge), normal)"
LIGHTS = "(light_red, light_green, light_blue) in lights"
END = "return pixels, counts"
# What is changed in the source of `python`: file, text, text in its place.
WRONG = {
    "one light is dropped": ("shade.py", f"{LIGHTS}:", f"{LIGHTS}[1:]:"),
    "the normal of one face is flipped": (
        "box.py", FACE, "(add(corner, edge), scale(normal, -1 if len(self.faces) == 2 else 1))"
    ),
    "gamma 2.2 in place of sRGB": (
        "main.py", "map(float, colour)", "(max(0, 1.055 * max(0, c) ** (1 / 2.4) - 0.055) ** 2.2 for c in colour)"
    ),
    "one channel of one pixel is NaN": ("main.py", END, f"pixels[4] = math.nan; {END}"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("wrong", [*WRONG, None])
def test_it_is_rejected(rayrace, experiment, rows, tmp_path, wrong):
    """The renderers as a copy, in front of those that are installed."""
    copy = tmp_path / "packages" / "renderers"
    shutil.copytree(Path(renderers.__path__[0]), copy, ignore=shutil.ignore_patterns("__pycache__"))
    if wrong:
        name, right, changed = WRONG[wrong]
        source = (copy / "python" / name).read_text()
        assert source.count(right) == 1
        (copy / "python" / name).write_text(source.replace(right, changed))
    file = experiment(["python"], scene=SCENE, size=24)
    rayrace("run", file, "--out", tmp_path / "run", env={"PYTHONPATH": str(copy.parent)}, code=1 if wrong else 0)
    (row,) = rows(tmp_path / "run")["python"]
    if not wrong:
        assert row["status"] == "ok" and row["agreement"]["max_outside"] < 1e-12
        return
    assert row["status"] == "wrong picture" and row["agreement"]["reference"] != "python"
    print(wrong, row["reason"], row["agreement"])
    if "NaN" in wrong:
        assert row["reason"] == "1 pixels are not finite" and "not finite" in row["error"]["unavailable"]
        assert not list((tmp_path / "run" / "pictures").glob("*.flip.npy"))
    else:
        assert row["agreement"]["max_outside"] > 1e-3 and row["error"]["flip"] > 0
        assert (tmp_path / "run" / row["error"]["flip_file"]).exists()
