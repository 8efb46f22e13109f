"""The page on what goes wrong names every module that deletes, moves, truncates or replaces files."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "when-things-go-wrong.md").read_text("utf-8")
TABLE = PAGE[PAGE.index("## What rayrace deletes") : PAGE.index("## Hostile input")]
# Names of functions and methods; `os.replace` and `Path.replace` beside `str.replace`, which has two arguments or more.
ALWAYS = {"unlink", "rmtree", "rmdir", "rename", "truncate", "move", "mkdtemp", "TemporaryDirectory", "removedirs"}


def deletes(path):
    """Lines of a module that call such a function."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if not isinstance(node, ast.Call):
            continue
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        owner = getattr(getattr(node.func, "value", None), "id", "")
        of_os = owner == "os" and name in ("replace", "remove", "rename", "renames")
        of_path = name == "replace" and len(node.args) == 1 and not node.keywords and owner not in ("os", "dataclasses")
        if (name in ALWAYS and name != "rename") or of_os or of_path:
            yield node.lineno


def test_every_module_that_deletes_is_in_the_table():
    found = {}
    for top in ("rayrace", "harness", "reports", "renderers", "docs"):
        for path in sorted((ROOT / top).rglob("*.py")):
            if lines := list(deletes(path)):
                found[str(path.relative_to(ROOT))] = lines
    assert len(found) > 8
    assert {path: lines for path, lines in found.items() if f"`{path}`" not in TABLE} == {}


def test_every_module_of_the_table_exists():
    named = re.findall(r"`((?:rayrace|harness|reports|renderers|docs)/[\w/]+\.py)`", TABLE)
    assert named and [path for path in named if not (ROOT / path).exists()] == []
