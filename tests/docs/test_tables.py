"""The tables and findings of README and docs are those that the reference results make."""

import importlib.util
import json
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def script(name):
    """A script in docs, as a module."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def tables():
    return script("tables")


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


@pytest.fixture(scope="module")
def kernels():
    return script("kernels")


def test_stored_kernels_are_those_of_the_table(kernels):
    rows = json.loads(kernels.FILE.read_text("utf-8"))["kernels"]
    found = [(row["variant"], row["case"], row["precision"], row["target"]) for row in rows]
    assert set(found) == {
        (variant, case, precision, target)
        for variant in ("numba-cuda", "cuda-cpp")
        for case in kernels.CASES
        for precision in kernels.PRECISIONS
        for target in kernels.TARGETS
    }
    assert len(set(found)) == len(found)


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_stored_kernels_are_what_the_compilers_make(kernels, precision):
    """Of the first scene, for one GPU: a change of a kernel, or of a compiler, needs docs/kernels.py again."""
    stored = json.loads(kernels.FILE.read_text("utf-8"))
    try:
        here = kernels.versions()
    except metadata.PackageNotFoundError as error:
        pytest.skip(f"{error} (pip install 'rayrace[cuda]')")
    other = {name: version for name, version in stored["versions"].items() if here.get(name) != version}
    if other:
        pytest.skip(f"the file was made with other versions, {other}")
    case, target = next(iter(kernels.CASES)), "sm_90"
    made = kernels.kernels(kernels.cases([case], [precision]), (target,))
    wanted = case, precision, target
    assert made == [row for row in stored["kernels"] if (row["case"], row["precision"], row["target"]) == wanted]


def test_other_kernels_would_be_seen(kernels, tables, tmp_path, monkeypatch):
    """The table has the numbers of the file."""
    stored = json.loads(kernels.FILE.read_text("utf-8"))
    stored["kernels"][0] |= {"registers": 77, "spill_store_bytes": 30, "spill_load_bytes": 12}
    (tmp_path / "kernels.json").write_text(json.dumps(stored))
    before = tables.kernels()
    monkeypatch.setattr(tables, "KERNELS", tmp_path / "kernels.json")
    assert "77, " in tables.kernels() and "42 B spilled" in tables.kernels() and tables.kernels() != before
