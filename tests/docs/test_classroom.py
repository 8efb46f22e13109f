"""The pictures for teachers are all on a page, and what differs in them is seen."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

DOCS = Path(__file__).parents[2] / "docs"
spec = importlib.util.spec_from_file_location("classroom", DOCS / "classroom.py")
classroom = importlib.util.module_from_spec(spec)
spec.loader.exec_module(classroom)
SEEN = 0.002  # share of the pixels


def test_each_picture_is_on_a_page():
    pages = "".join(path.read_text("utf-8") for path in DOCS.glob("*.md"))
    files = {path.name for path in (DOCS / "classroom").glob("*.png")}
    assert len(files) == len(classroom.EFFECTS) + len(classroom.FAILURES)
    assert [name for name in files if f"(classroom/{name})" not in pages] == []


@pytest.mark.parametrize("path", sorted((DOCS / "classroom").glob("*.png")), ids=lambda path: path.stem)
def test_what_differs_is_seen(path):
    with Image.open(path) as opened:
        pixels = np.asarray(opened.convert("RGB")).astype(int)
    first, second = pixels[:, : classroom.WIDTH], pixels[:, classroom.WIDTH + classroom.GAP :][:, : classroom.WIDTH]
    assert (np.abs(first - second).max(axis=-1) > 8).mean() > SEEN


def test_a_pixel_that_is_no_number_is_magenta():
    picture = np.array([[[0.0, 0.0, 0.0], [0.5, np.nan, 0.5], [1.0, 1.0, 1.0]]])
    assert classroom.shown(picture).tolist() == [[[0, 0, 0], [255, 0, 255], [255, 255, 255]]]
