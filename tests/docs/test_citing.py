"""CITATION.cff is of this version, and the page on citing names what is there."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CITATION = (ROOT / "CITATION.cff").read_text("utf-8")
PAGE = (ROOT / "docs" / "citing.md").read_text("utf-8")


def test_the_citation_is_of_this_version_and_licence():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    told = dict(re.findall(r"^([a-z-]+): (.+)$", CITATION, re.MULTILINE))
    assert (told["version"], told["license"]) == (project["version"], project["license"])
    assert f"version {project['version']}." in PAGE


@pytest.mark.parametrize("key", ["cff-version", "message", "title", "authors"])  # what the format asks for
def test_the_citation_has_what_its_format_asks_for(key):
    assert re.search(rf"^{key}:", CITATION, re.MULTILINE)
