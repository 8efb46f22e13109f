"""The map of the house in CONTRIBUTING.md is true: its paths exist, and no folder is missing."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
PATHS = re.findall(r"`((?:rayrace|harness|reports|renderers|tests|docs|experiments)/[\w./-]*)`", TEXT)


def test_every_path_exists():
    assert len(PATHS) > 30
    assert [path for path in PATHS if not (ROOT / path).exists()] == []


def test_every_folder_has_a_question():
    modules = [path for top in ("harness", "reports") for path in ROOT.glob(f"{top}/*/*.py")]
    folders = {f"{path.parent.relative_to(ROOT)}/" for path in modules}
    assert len(folders) > 20 and folders <= set(PATHS)


def test_folders_hold_3_to_16_modules():
    """reports/ itself holds none, and __init__.py does not count."""
    counts = {}
    for top in ("harness", "reports"):
        for path in (ROOT / top).rglob("*.py"):
            counts.setdefault(path.parent.relative_to(ROOT), []).append(path.name != "__init__.py")
    assert {str(folder): sum(names) for folder, names in counts.items() if sum(names) not in (0, *range(3, 17))} == {}


@pytest.mark.parametrize("package", ["harness", "reports"])
def test_the_picture_has_the_layers_of_the_contract(package):
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    (layers,) = [contract["layers"] for contract in contracts if contract.get("containers") == [package]]
    folders = [{name for name in layer.split(" | ") if (ROOT / package / name).is_dir()} for layer in layers]
    drawn = re.search(rf"subgraph {package}\n(.*?)\n", TEXT)[1]
    assert [set(re.findall(r"\w+", layer)) for layer in drawn.split("-->")] == list(filter(None, folders))
