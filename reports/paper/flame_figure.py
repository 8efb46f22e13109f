"""Draws stacks of functions as a flame graph, the outermost function on top (an icicle)."""

import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

ROOT = "a frame"  # over functions that nothing else calls, such as those of threads
LEAST = 0.002  # of the width, of a function that is drawn
LETTER = 0.0072  # of the width, that a letter takes
ROW = 0.22  # inches
COLOURS = "#E69F00", "#F0C05A", "#D98E3F", "#EBB34D"


def draw(stacks: dict[tuple[str, ...], float], title: str) -> Figure:
    """Draws each stack as wide as its share of all, as one tree."""
    roots: dict[str, float] = {}
    for stack, weight in stacks.items():
        roots[stack[0]] = roots.get(stack[0], 0.0) + weight
    if sum(weight >= LEAST * sum(stacks.values()) for weight in roots.values()) > 1:
        stacks = {(ROOT, *stack): weight for stack, weight in stacks.items()}
    total, deep = sum(stacks.values()), max(map(len, stacks))
    figure, axes = plt.subplots(figsize=(11, 0.8 + ROW * deep), layout="constrained")
    _draw(axes, sorted(stacks.items()), 0, 0.0, total)
    axes.set_xlim(0, 1)
    axes.set_ylim(deep, 0)
    axes.set_axis_off()
    figure.suptitle(title, x=0.01, ha="left", fontsize=9)
    return figure


def _draw(axes, stacks: list[tuple[tuple[str, ...], float]], level: int, left: float, total: float) -> None:
    """The functions at a level of stacks that share all above it. left: of the width, where they begin."""
    groups: dict[str, list] = {}
    for stack, weight in stacks:
        if len(stack) > level:
            groups.setdefault(stack[level], []).append((stack, weight))
    for name, group in groups.items():
        wide = sum(weight for _, weight in group) / total
        if wide >= LEAST:
            colour = COLOURS[sum(name.encode()) % len(COLOURS)]
            axes.add_patch(Rectangle((left, level), wide, 0.94, facecolor=colour, edgecolor="white", linewidth=0.5))
            shown = name if len(name) * LETTER <= wide else name[: max(0, int(wide / LETTER) - 1)] + "…"
            if len(shown) > 2:
                axes.text(left + 0.002, level + 0.5, shown, fontsize=6.5, va="center", clip_on=True)
            _draw(axes, group, level + 1, left, total)
        left += wide
