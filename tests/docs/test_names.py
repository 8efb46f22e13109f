"""A file that a comment names is there, and a binding is the noun of what it holds."""

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
# Bindings that say how a value came, not what it is.
NO_NOUNS = {"told", "found", "mine", "theirs", "known", "asked", "held", "heard", "one"}
WITH_NOUNS = "harness/", "rayrace/", "reports/"


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


def bindings(tree):
    """Yields line and name of each binding: variables, parameters, attributes, fields, functions, classes, aliases."""
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()) | ast.arg(arg=name):
                yield node.lineno, name
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                yield node.lineno, name
            case ast.alias(asname=str(name)) | ast.ExceptHandler(name=str(name)):
                yield node.lineno, name
            case ast.MatchAs(name=str(name)) | ast.MatchStar(name=str(name)) | ast.MatchMapping(rest=str(name)):
                yield node.lineno, name


def without_noun(sources):
    """The bindings in sources, (place, text), whose name is one of NO_NOUNS."""
    return [
        f"{place}:{line}: {name}"
        for place, text in sources
        for line, name in sorted(bindings(ast.parse(text)))
        if name in NO_NOUNS
    ]


def test_a_binding_is_the_noun_of_what_it_holds():
    names = [name for name in listed() if name.startswith(WITH_NOUNS) and name.endswith(".py")]
    sources = [(name, (ROOT / name).read_text("utf-8")) for name in names]
    assert len(sources) > 100
    assert without_noun(sources) == []


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("found = []", "found"),
        ("for told in rows: pass", "told"),
        ("rows = [one for one in cells]", "one"),
        ("if held := rows: pass", "held"),
        ("def take(entry, *, known=None): pass", "known"),
        ("key = lambda mine: mine[0]", "mine"),
        ("def heard(): pass", "heard"),
        ("self.asked = job", "asked"),
        ("class Row:\n    theirs: int = 0", "theirs"),
        ("import rows as known", "known"),
        ("try: pass\nexcept OSError as told: pass", "told"),
    ],
)
def test_a_binding_that_is_no_noun_is_listed(text, name):
    assert without_noun([("a.py", text)]) == [f"a.py:{text.count(chr(10)) + 1}: {name}"]


def test_what_is_only_read_or_named_otherwise_is_not_listed():
    text = 'rows = found(known.held, one=1, **{"told": 2})\nis_known = founds = rows.mine  # asked\n'
    assert without_noun([("a.py", text)]) == []
