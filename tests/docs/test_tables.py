"""The tables and findings of README and docs are those that the reference results make."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def tables():
    spec = importlib.util.spec_from_file_location("tables", ROOT / "docs" / "tables.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The pages as the script writes them."""
    folder = tmp_path_factory.mktemp("pages")
    subprocess.run([sys.executable, ROOT / "docs" / "tables.py", folder], check=True, cwd=folder)
    return folder


def test_pages_have_the_numbers_of_the_stored_runs(tables, made):
    for page in tables.PAGES:
        assert (made / page).read_text("utf-8") == (ROOT / page).read_text("utf-8"), f"{page}: run docs/tables.py"


def test_every_table_is_on_a_page(tables):
    text = "".join((ROOT / page).read_text("utf-8") for page in tables.PAGES)
    found = [mark["name"] for mark in tables.MARK.finditer(text)]
    assert sorted(found) == sorted(tables.TABLES) and text.count("<!-- table: ") == len(found)


def test_a_number_that_was_changed_by_hand_is_made_again(tables):
    name, table = "lanes-auto", tables.TABLES["lanes-auto"]()
    page = f"before\n<!-- table: {name} -->\n{table.replace('0', '1')}\n<!-- end -->\nafter\n"
    assert tables.page(page) == f"before\n<!-- table: {name} -->\n{table}\n<!-- end -->\nafter\n"
