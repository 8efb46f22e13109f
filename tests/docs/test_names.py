"""A file that a comment names is there."""

import ast
import io
import re
import subprocess
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NAME = re.compile(r"(?<![\w/.{}*-])((?:[\w-]+/)*[\w-]+\.(?:py|hpp|h|cpp|toml))\b")
# Files of others, and examples.
OTHERS = {"nvml.h", "earlier.py", "file.py", "csv.py"}
SOURCES = "harness", "rayrace", "renderers", "reports"


def listed():
    done = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        pytest.skip("no git checkout")
    return done.stdout.splitlines()


def comments(path):
    """Yields line and text of the comments of a file, and of the docstrings of a Python file."""
    source = path.read_text("utf-8")
    if path.suffix != ".py":
        for number, line in enumerate(source.splitlines(), 1):
            if "//" in line:
                yield number, line.partition("//")[2]
        return
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.FunctionDef | ast.ClassDef) and (text := ast.get_docstring(node)):
            yield getattr(node, "lineno", 1), text


def missing(texts, files):
    """The names in texts, (place, text), that no file has: by its end if a folder is named, else by its last part."""
    ends = {"/".join(parts[-n:]) for parts in (name.split("/") for name in files) for n in range(1, len(parts) + 1)}
    return [f"{place}: {name}" for place, text in texts for name in NAME.findall(text) if name not in ends | OTHERS]


def test_a_file_that_a_comment_names_is_there():
    files = listed()
    sources = [
        Path(name) for name in files if name.startswith(SOURCES) and name.endswith((".py", ".hpp", ".h", ".cpp"))
    ]
    texts = [(f"{name}:{line}", text) for name in sources for line, text in comments(ROOT / name)]
    assert len(texts) > 1000 and missing(texts, files) == []


def test_what_is_missing_is_found():
    files = ["harness/judge/cache.py", "renderers/cpp/shapes/box.hpp"]
    texts = [("a", "see cache.py, judge/cache.py and shapes/box.hpp"), ("b", "see kept.py"), ("c", "lanes/box.hpp")]
    assert missing(texts, files) == ["b: kept.py", "c: lanes/box.hpp"]
