"""Each picture of the page on scenes is there, and its text, with the stage of the page, is a scene."""

import importlib.util
import re
from pathlib import Path

import pytest

from harness.scene import doubts, text

DOCS = Path(__file__).parents[2] / "docs"
spec = importlib.util.spec_from_file_location("scenes_of_the_page", DOCS / "scenes.py")
page = importlib.util.module_from_spec(spec)
spec.loader.exec_module(page)
PAGE = (DOCS / "scenes.md").read_text("utf-8")


def test_each_text_has_its_own_picture():
    pairs = [(name, picture) for name, _, picture in page.TEXT.findall(PAGE)]
    assert len(pairs) == PAGE.count("<!-- scene:") == len(re.findall(r"\(scenes/\w+\.png\)", PAGE)) > 10
    assert all(name == picture for name, picture in pairs)
    assert {f"{name}.png" for name, _ in pairs} == {path.name for path in (DOCS / "scenes").glob("*.png")}


@pytest.mark.parametrize("name", page.scenes())
def test_a_text_is_a_scene_without_doubts(name):
    scene = text.read(page.scenes()[name], page.MESH.with_name("scene.txt"))
    assert len(scene.objects) == (1 if name == "stage" else 2) or len(scene.objects) > 3
    assert doubts.warnings(scene) == []


def test_each_keyword_of_the_grammar_is_on_the_page():
    words = set(re.findall(r"\b[A-Z]{2,}\b", text.__doc__.partition("One CAMERA")[0])) - {"CS", "CSG"}
    assert {"SPHERE", "AIR", "NOT"} < words and words <= set(re.findall(r"\b[A-Z]{2,}\b", PAGE))
