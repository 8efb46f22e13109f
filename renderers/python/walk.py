"""Ways to walk the tree of rays (WLK-1, WLK-2).

`visit(ray, order)` returns the ray's own colour and the rays that it spawns, as pairs (weight, ray).
Walks that know the ray's weight in its sample pass it too: `visit(ray, order, weight)`.
"""

import sys

LARGEST_TABLE = 2**31  # bytes


class CannotWalk(ValueError):
    """The walk of the job is not possible; the text says why."""


class Walk:
    """The walk of a job: its name, the rows that one pixel takes and their bytes.

    children: how many a ray can have. row: one row of a table or stack, as large as any. cuts: rays may be cut off.
    """

    def __init__(self, name, depth, children, row, cuts):
        if name == "least":
            name = "chain" if children == 1 else "stack"
        if name == "chain" and children > 1:
            raise CannotWalk(f"cannot walk this scene as a chain: a ray can have {children} children")
        if cuts and name not in ("chain", "stack"):  # CUT-4
            raise CannotWalk(f"a cutoff needs the walk chain or stack: a {name} does not know the weights of rays")
        self.name, self.depth, self.children = name, depth, children
        self.rows = self.bytes = None
        if name == "table":
            self.children = max(2, children)
            self.rows = sum(self.children**order for order in range(depth + 1))
        elif name == "stack":
            self.rows = 1 + depth * (children - 1)
        elif name == "recursion":
            sys.setrecursionlimit(max(sys.getrecursionlimit(), 3 * depth + 1000))
        if self.rows is not None:
            self.bytes = self.rows * (8 + size(row))  # 8: its place in a list
        if name == "table" and self.bytes > LARGEST_TABLE:
            raise CannotWalk(f"a table of {self.rows} rows for one pixel takes {self.bytes} bytes, over 2^31")
        walks = {"recursion": self.recurse, "table": self.tabulate, "stack": self.pile, "chain": self.follow}
        self.colour = walks[name]

    def recurse(self, visit, ray, order=0):
        """Recursion, as REF-4 is written."""
        (red, green, blue), children = visit(ray, order)
        for (wr, wg, wb), child in children:
            r, g, b = self.recurse(visit, child, order + 1)
            red, green, blue = red + wr * r, green + wg * g, blue + wb * b
        return red, green, blue

    def tabulate(self, visit, ray):
        """The study's table (2.7.4), a row for every possible ray: filled from the root, summed from the end.

        A row is (weight, order, ray), and (weight, colour) when the ray is traced.
        """
        slots, children = [None] * self.rows, self.children
        slots[0] = None, 0, ray
        for place in range(self.rows):
            if slots[place] is None:
                continue
            weight, order, ray = slots[place]
            colour, sent = visit(ray, order)
            slots[place] = weight, colour
            for child, (share, ray) in enumerate(sent):
                slots[place * children + 1 + child] = share, order + 1, ray
        for place in range(self.rows - 1, 0, -1):
            if slots[place] is not None:
                (wr, wg, wb), (r, g, b) = slots[place]
                parent = (place - 1) // children
                weight, (red, green, blue) = slots[parent]
                slots[parent] = weight, (red + wr * r, green + wg * g, blue + wb * b)
        return slots[0][1]

    def pile(self, visit, ray):
        """A stack of rays with their weights; last in, first out, so it stays short."""
        red = green = blue = 0
        waiting = [((1, 1, 1), 0, ray)]
        while waiting:
            (wr, wg, wb), order, ray = waiting.pop()
            (r, g, b), children = visit(ray, order, (wr, wg, wb))
            red, green, blue = red + wr * r, green + wg * g, blue + wb * b
            for (sr, sg, sb), child in children:
                waiting.append(((wr * sr, wg * sg, wb * sb), order + 1, child))
        return red, green, blue

    def follow(self, visit, ray):
        """A loop, for trees in which no ray has more than one child."""
        red = green = blue = 0
        wr = wg = wb = 1
        for order in range(self.depth + 1):
            (r, g, b), children = visit(ray, order, (wr, wg, wb))
            red, green, blue = red + wr * r, green + wg * g, blue + wb * b
            if not children:
                break
            (((sr, sg, sb), ray),) = children
            wr, wg, wb = wr * sr, wg * sg, wb * sb
        return red, green, blue


def size(value):
    """Bytes of a tuple and its members."""
    return sys.getsizeof(value) + (sum(map(size, value)) if isinstance(value, tuple) else 0)
