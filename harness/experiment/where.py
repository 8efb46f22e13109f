"""The constraints of `where`: expressions that must be true of a cell."""

import ast
from collections import Counter
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from simpleeval import EvalWithCompoundTypes

from harness.errors import UserError
from harness.experiment.image import Image

FUNCTIONS = {"min": min, "max": max, "abs": abs}
# What an expression of `where` can name.
NAMES = (
    *("renderer", "scene", "case", "stress", "level", "objects", "lights", "size", "side"),
    *("without", "processes", "frames", *Image.model_fields),
)


def parse(text: str) -> ast.AST:
    """The tree of an expression; ValueError if it is none, or names what no cell has."""
    try:
        tree = EvalWithCompoundTypes.parse(text)
    except Exception as error:
        why = error.msg if isinstance(error, SyntaxError) else error
        raise ValueError(f"expected an expression such as depth <= 4 or renderer != 'python': {why}") from None
    names = (*NAMES, *FUNCTIONS)
    if unknown := sorted(_names(tree) - set(names)):
        near = get_close_matches(unknown[0], names, n=1)
        hint = f'did you mean "{near[0]}"?' if near else f"known: {', '.join(NAMES)}"
        raise ValueError(f"no parameter {', '.join(unknown)}; {hint}")
    return tree


class Constraints:
    """The expressions of `where`. `left_out` counts the cells that each left out, those of the first that did.

    ValueError if one is none (parse).
    """

    def __init__(self, expressions: tuple[str, ...], file: Path):
        self.file = file
        self.left_out = Counter(dict.fromkeys(expressions, 0))
        self._evaluator = EvalWithCompoundTypes(functions=FUNCTIONS)
        # Of floats, which have no millions of digits.
        self._evaluator.operators = {**self._evaluator.operators, ast.Pow: lambda a, b: float(a) ** b}
        self._trees = {text: parse(text) for text in expressions}

    def keep(self, values: dict[str, Any]) -> bool:
        """Is a cell of these values in? UserError for an expression that cannot tell."""
        self._evaluator.names = values
        return all(self._holds(text, tree, values) for text, tree in self._trees.items())

    def _holds(self, text: str, tree: ast.AST, values: dict[str, Any]) -> bool:
        try:
            value = self._evaluator.eval(text, previously_parsed=tree)
        except Exception as error:  # of many kinds: the expression can be anything
            where = ", ".join(f"{name} = {values[name]!r}" for name in sorted(_names(tree) & set(values)))
            raise self._error(text, f"cannot be worked out for {where}: {error}") from None
        if not isinstance(value, bool):
            raise self._error(text, f"expected true or false, such as objects * lights <= 200, found {value!r}")
        self.left_out[text] += not value
        return value

    def _error(self, text: str, why: str) -> UserError:
        return UserError(f'where "{text}": {why}', file=self.file)


def _names(tree: ast.AST) -> set[str]:
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
