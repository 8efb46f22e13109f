"""Barriers of the GPU kernels of numba: each stands in one place of the machine code.

Threads of a warp that wait at two copies of a barrier wait for ever. Python makes copies: it compiles the condition of
a loop before the loop and again at its end; and from 3.12 on, the end of a function, if short, in each of the branches
that lead to it.
"""

import ast
import dis
import types
from collections import Counter
from pathlib import Path

import pytest

NUMBA = Path(__file__).parents[2] / "renderers" / "numba"
BARRIERS = {"syncthreads", "syncthreads_or"}
LOADS = ("LOAD_GLOBAL", "LOAD_NAME", "LOAD_ATTR", "LOAD_METHOD", "LOAD_DEREF", "LOAD_FAST")
TWICE = """
def step(condition):
    return cuda.syncthreads_or(condition)
def walk(height):
    while step(height > 0):
        height -= 1
"""
BRANCH = """
def vote(condition):
    return cuda.syncthreads_or(1 if condition else 0) != 0
"""
BRANCHES = ast.IfExp, ast.BoolOp, ast.comprehension


def sources():
    folders = (NUMBA, *(NUMBA / name for name in ("gpu", "shapes", "trace")))  # lanes are of processors
    return {path: path.read_text() for folder in folders for path in sorted(folder.glob("*.py"))}


def named(node):
    """How often each name or attribute is read under a node."""
    names = (getattr(one, "id", None) or getattr(one, "attr", None) for one in ast.walk(node))
    return Counter(name for name in names if name)


def with_barriers(texts):
    """The functions that come to a barrier, with those that they call."""
    functions = [node for text in texts for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)]
    found, size = set(BARRIERS), 0
    while len(found) > size:
        size = len(found)
        found |= {function.name for function in functions if found & set(named(function))}
    return found


def loaded(code):
    """How often each name is loaded in a code object and those in it, but not to hand it on to those."""
    names = (one.argval for one in dis.get_instructions(code) if one.opname in LOADS)
    found = Counter(name for name in names if name not in code.co_cellvars)
    for one in code.co_consts:
        if isinstance(one, types.CodeType):
            found += loaded(one)
    return found


def copies(text, names):
    """Names of functions with barriers whose calls Python has compiled more often than they are written."""
    written, compiled = named(ast.parse(text)), loaded(compile(text, "source", "exec"))
    return {name for name in names if compiled[name] > written[name]}


def expressions(statement):
    """All nodes of a statement that are no statements of their own."""
    for child in ast.iter_child_nodes(statement):
        if not isinstance(child, ast.stmt):
            yield child
            yield from expressions(child)


def branching(text, names):
    """Lines of statements that call one of the names and have a branch within, which Python may put before a copy."""
    for statement in ast.walk(ast.parse(text)):
        if isinstance(statement, ast.stmt):
            parts = list(expressions(statement))
            called = {name for part in parts if isinstance(part, ast.Call) for name in named(part.func)}
            chained = any(isinstance(part, ast.Compare) and len(part.ops) > 1 for part in parts)
            if called & names and (chained or any(isinstance(part, BRANCHES) for part in parts)):
                yield statement.lineno


def test_no_barrier_is_compiled_twice():
    texts = sources()
    names = with_barriers(texts.values())
    assert {"any_of_block", "unfinished", "walk_stack", "nearest_in_tiles", "occluded"} <= names
    for path, text in texts.items():
        assert not copies(text, names), path
        assert not list(branching(text, names)), path


def test_a_copy_is_found():
    if not copies(TWICE, {"step"}):
        pytest.skip("this Python compiles a loop's condition once")
    assert with_barriers([TWICE]) == {*BARRIERS, "step", "walk"}


def test_a_branch_is_found():
    """As of any version of Python, though only some copy what follows it."""
    assert list(branching(BRANCH, BARRIERS)) == [3]
    assert not list(branching(BRANCH.replace("1 if condition else 0", "np.int32(condition)"), BARRIERS))
