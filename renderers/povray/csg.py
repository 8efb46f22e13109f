"""Translates a CSG solid from its postfix (CSG-3) to POV-Ray's CSG.

NOT is pushed down to the parts (De Morgan), where POV-Ray writes it `inverse`: of an `inverse` union POV-Ray would keep
the faces within, and show them where the solid is not.
"""

from dataclasses import dataclass

import numpy as np

OR, AND, NOT = 4, 5, 6


@dataclass
class Node:
    """A part, or OR or AND of several."""

    operator: int | None
    parts: list  # nodes, or the one shape
    inverted: bool = False  # of a part alone


class Solid:
    solid = True

    def __init__(self, code, parts, clear):
        """code: rows (kind, row) of the postfix; parts: the shapes by kind and row; clear: rays go through it."""
        stack = []
        for kind, row in code:
            if kind == NOT:
                stack.append(_not(stack.pop()))
            elif kind in (OR, AND):
                second, first = stack.pop(), stack.pop()
                stack.append(_join(kind, first, second))
            else:
                stack.append(Node(None, [parts[kind][row]]))
        (self.root,) = stack
        # union keeps the faces inside other parts, which only a ray that is inside can meet
        self.words = {OR: "merge" if clear else "union", AND: "intersection"}

    def text(self, words=""):
        return self._text(self.root, words)

    def _text(self, node, words=""):
        if node.operator is None:
            return node.parts[0].text((" inverse" if node.inverted else "") + words)
        inner = "\n  ".join(self._text(part) for part in node.parts)
        return f"{self.words[node.operator]} {{\n  {inner}{words} }}"

    def contains(self, point, node=None):
        node = node or self.root
        if node.operator is None:
            return bool(node.parts[0].contains(point)) != node.inverted
        return (any if node.operator == OR else all)(self.contains(point, part) for part in node.parts)

    def bounds(self, node=None):
        node = node or self.root
        if node.operator is None:
            return (np.full(3, -np.inf), np.full(3, np.inf)) if node.inverted else node.parts[0].bounds()
        low, high = zip(*(self.bounds(part) for part in node.parts), strict=True)
        if node.operator == OR:
            return np.min(low, axis=0), np.max(high, axis=0)
        return np.max(low, axis=0), np.min(high, axis=0)


def _join(operator, first, second):
    """Joins two by OR or AND, without a level for each member of a chain."""
    parts = []
    for node in (first, second):
        parts += node.parts if node.operator == operator else [node]
    return Node(operator, parts)


def _not(node):
    if node.operator is None:
        return Node(None, node.parts, not node.inverted)
    return Node(OR + AND - node.operator, [_not(part) for part in node.parts])
