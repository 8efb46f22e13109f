"""The points of a sweep: combines swept values and applies the constraints of `where`."""

import ast
import itertools
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from simpleeval import EvalWithCompoundTypes

from harness.errors import UserError
from harness.experiment.experiment import Experiment
from harness.experiment.image import Image

FUNCTIONS = {"min": min, "max": max, "abs": abs}
# What an expression of `where` can name.
NAMES = (
    *("renderer", "scene", "case", "stress", "level", "objects", "lights", "size", "side"),
    *("processes", "frames", *Image.model_fields),
)


def points(experiment: Experiment) -> list[tuple[dict, int]]:
    """The swept values of every point, in the order of the file, and the number of the [[points]] table it is from."""
    if isinstance(experiment.sweep, dict):
        axes = [[{key: value} for value in values] for key, values in experiment.sweep.items()]
    else:
        axes = [_zipped(table) for table in experiment.sweep]
    tables = [(list(_product(table)), number) for number, table in enumerate(experiment.points)] or [([{}], 0)]
    return [
        ({key: value for part in (own, *parts) for key, value in part.items()}, number)
        for some, number in tables
        for own, *parts in itertools.product(some, *axes)
    ]


def _zipped(table: dict) -> list[dict]:
    return [dict(zip(table, values, strict=True)) for values in zip(*table.values(), strict=True)]


def _product(table: dict):
    lists = [value if isinstance(value, tuple) else (value,) for value in table.values()]
    return (dict(zip(table, values, strict=True)) for values in itertools.product(*lists))


def filled(point: dict, experiment: Experiment, values: Mapping[str, Any]) -> dict:
    """`point` with all that any [[points]] table sweeps, taken from `values` where its own table does not.

    All points of an experiment then say the same things, and one that two tables hold is one.
    """
    keys = dict.fromkeys(key for table in experiment.points for key in table)
    return {**{key: values[key] for key in keys if values.get(key) is not None}, **point}


class Constraints:
    """The expressions of `where`. `left_out` counts the cells that each left out, those of the first that did."""

    def __init__(self, expressions: tuple[str, ...], file: Path):
        self.file = file
        self.left_out = Counter(dict.fromkeys(expressions, 0))
        self._evaluator = EvalWithCompoundTypes(functions=FUNCTIONS)
        # Of floats, which have no millions of digits.
        self._evaluator.operators = {**self._evaluator.operators, ast.Pow: lambda a, b: float(a) ** b}
        self._trees = {text: self._parsed(text) for text in expressions}

    def keep(self, values: dict[str, Any]) -> bool:
        """Is a cell of these values in? UserError for an expression that cannot tell."""
        self._evaluator.names = values
        return all(self._holds(text, tree, values) for text, tree in self._trees.items())

    def _holds(self, text: str, tree: ast.AST, values: dict[str, Any]) -> bool:
        try:
            found = self._evaluator.eval(text, previously_parsed=tree)
        except Exception as error:  # of many kinds: the expression can be anything
            where = ", ".join(f"{name} = {values[name]!r}" for name in sorted(_names(tree) & set(values)))
            raise self._error(text, f"cannot be worked out for {where}: {error}") from None
        if not isinstance(found, bool):
            raise self._error(text, f"expected true or false, such as objects * lights <= 200, found {found!r}")
        self.left_out[text] += not found
        return found

    def _parsed(self, text: str) -> ast.AST:
        try:
            tree = self._evaluator.parse(text)
        except Exception as error:
            why = f"expected an expression such as depth <= 4 or renderer != 'python': {error}"
            raise self._error(text, why) from None
        unknown = sorted(_names(tree) - {*NAMES, *FUNCTIONS})
        if unknown:
            raise self._error(text, f"no parameter {', '.join(unknown)}", f"known: {', '.join(NAMES)}")
        return tree

    def _error(self, text: str, why: str, remedy: str | None = None) -> UserError:
        return UserError(f'where "{text}": {why}', file=self.file, remedy=remedy)


def _names(tree: ast.AST) -> set[str]:
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
