"""Methods: the views of a run, the name of a method, and curves along a dial."""

from dataclasses import dataclass

from reports.run import command, launch, view
from reports.run.cell import Cell
from reports.run.results import Results
from reports.run.view import View

# What a curve runs along: more of it is slower and nearer to the truth, or the other way round.
DIALS = ("samples", "feelers", "glossy_rays", "adaptive_threshold", "cutoff", "depth")
# Methods of single steps, by what comes after their value in a name.
STEPS = {
    "sphere": "spheres", "triangle": "triangles", "slab": "slabs", "merge": "merging", "offset": "offset",
    "fresnel": "Fresnel", "phong": "Phong", "renormalise": "renormalising",
}  # fmt: skip
CHOICES = (
    "precision", "floating_point", *STEPS, "sampler", "adaptive_depth", "glossy_weight", "walk", "accel",
    "kernel", "vector", "seed", *launch.UNSEEN, "threads",
)  # fmt: skip
STANDS_FOR = {
    "samples": "n × n", "feelers": "n feelers", "glossy_rays": "n glossy rays", "adaptive_threshold": "threshold t",
    "cutoff": "cut-off w", "depth": "depth d",
}  # fmt: skip
PLAIN = "as by default"  # stands for a name that says nothing
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def views(results: Results) -> list[View]:
    """Cells that approximate one truth by other methods, in the order of the run.

    As harness/judge/truth.py has it: whether a picture is of the centres of pixels or of their areas, and whether there
    are feelers and glossy rays at all makes another picture, and so does the depth, unless the experiment gives the
    truth a depth of its own.
    """
    free = tuple(key for key in (*DIALS, *CHOICES, "epsilon") if key != "depth" or truth_depth(results) is not None)
    found = []
    for seen in view.views(results.cells, free):
        parts: dict[tuple[str, ...], list[Cell]] = {}
        for cell in seen.cells:
            parts.setdefault(_kind(cell), []).append(cell)
        differ = [len({kind[place] for kind in parts}) > 1 for place in range(3)]
        for kind, cells in parts.items():
            words = [word for word, told in zip(kind, differ, strict=True) if told]
            found.append(View(", ".join([seen.label, *words]), seen.names, cells))
    return found


def _kind(cell: Cell) -> tuple[str, ...]:
    told = cell.parameters
    return (
        "centres of pixels" if told.get("sampler", "one") == "one" else "areas of pixels",
        "soft shadows" if told.get("feelers") else "hard shadows",
        "glossy" if told.get("glossy_rays") else "mirrors",
    )


def truth_depth(results: Results) -> int | None:
    """The depth of the truth; None if it is each picture's own."""
    return (results.facts["experiment"].get("reference") or {}).get("depth")


def of(cell: Cell) -> dict:
    """The method of a cell: those of DIALS and CHOICES that its picture or its time can depend on."""
    told = {key: cell.parameters[key] for key in (*DIALS, *CHOICES) if key in cell.parameters}
    sampler = told.get("sampler", "one")
    idle = [
        *(("samples",) if sampler not in ("uniform", "jittered") else ()),
        *(("adaptive_depth", "adaptive_threshold") if sampler != "adaptive" else ()),
        *(("glossy_weight",) if not told.get("glossy_rays") else ()),
    ]
    return {key: value for key, value in told.items() if key not in idle}


def unbiased(results: Results, cell: Cell) -> bool:
    """Is the error of a cell noise alone, which more samples average away?

    Of random samples in float64 with nothing left out. A grid converges too, but its error is not noise.
    """
    told, depth = cell.parameters, truth_depth(results)
    return (
        max(cell.known("truth_pictures", cell.timed).values(), default=1) > 1
        and told.get("sampler", "one") in ("jittered", "one")
        and (told["precision"], told.get("floating_point", "strict")) == ("float64", "strict")
        and not told.get("cutoff")
        and not (told.get("glossy_rays") and told.get("glossy_weight") != "plain")
        and depth in (None, told["depth"])
    )


@dataclass(frozen=True)
class Curve:
    """Cells of one variant along a dial, in the order of its values; of a cell that stands alone the dial is None.

    family: what the method is called whatever the dial says.
    """

    variant: str
    family: str
    dial: str | None
    cells: list[Cell]


class Names:
    """Names the methods of a view by what differs from the default and by the dials that are turned.

    depth: the truth's, which is not named.
    """

    def __init__(self, cells: list[Cell], depth: int | None = None):
        self.depth = depth
        methods = [(cell.variant, of(cell)) for cell in cells]
        values = {key: {str(told[key]) for _, told in methods if key in told} for key in (*DIALS, *CHOICES)}
        self.turned = {key for key in values if len(values[key]) > 1}
        threads: dict[str, set] = {}
        for variant, told in methods:
            threads.setdefault(variant, set()).add(told.get("threads"))
        self.threaded = {variant for variant, counts in threads.items() if len(counts) > 1}

    def full(self, cell: Cell) -> str:
        """With its variant."""
        return ", ".join(filter(None, [cell.variant, self.method(cell)]))

    def method(self, cell: Cell, *dials: str | None) -> str:
        """Without its variant; "" if it is as by default. dials: whatever these say."""
        told = of(cell)

        def number(key: str, text: str) -> str:
            return STANDS_FOR[key] if key in dials else text

        def other(key: str, text: str) -> str:
            return text if key in told and told[key] != command.default(key) else ""

        sampler, cutoff = told.get("sampler", "one"), told.get("cutoff", 0)
        words = [
            other("precision", f"{told['precision']}"),
            other("floating_point", f"{told.get('floating_point')} floating point"),
            *(other(key, f"{told.get(key)} {what}") for key, what in STEPS.items()),
            "one sample" if sampler == "one" and "sampler" in self.turned else "",
            f"{sampler} {number('samples', _square(told['samples']))}" if "samples" in told else "",
            "adaptive" if sampler == "adaptive" else "",
            f"to 1/{2 ** told['adaptive_depth']} pixel" if "adaptive_depth" in self.turned & told.keys() else "",
            number("adaptive_threshold", f"threshold {told['adaptive_threshold']:g}")
            if "adaptive_threshold" in told else "",
            number("feelers", f"{told['feelers']} feelers") if "feelers" in self.turned else "",
            number("glossy_rays", f"{told['glossy_rays']} glossy rays") if "glossy_rays" in self.turned else "",
            other("glossy_weight", "the study's weight"),
            number("cutoff", f"cut-off {_power(cutoff)}") if cutoff else "",
            number("depth", f"depth {told['depth']}") if self._names_depth(told["depth"]) else "",
            other("walk", f"{told.get('walk')} walk"),
            other("accel", f"accel {told.get('accel')}"),
            other("kernel", f"{told.get('kernel')} kernel"),
            other("vector", "vector"),
            *(other(key, f"{key} {told.get(key)}") for key in launch.UNSEEN),
            f"{told.get('threads')} threads" if cell.variant in self.threaded else "",
            other("seed", f"seed {told.get('seed')}"),
        ]  # fmt: skip
        return ", ".join(filter(None, words))

    def _names_depth(self, depth: int) -> bool:
        return "depth" in self.turned and depth != self.depth


def curves(cells: list[Cell], names: Names) -> list[Curve]:
    """Every cell in a curve: of each variant the longest first, until all that vary along some dial are in one.

    A cell may be in two, where dials were turned one at a time from it.
    """
    found = []
    for variant in dict.fromkeys(cell.variant for cell in cells):
        mine = [cell for cell in cells if cell.variant == variant]
        groups = [(dial, group) for dial in DIALS for group in _along(mine, dial)]
        alone = dict.fromkeys(mine)
        while groups:
            dial, group = max(groups, key=lambda told: sum(cell in alone for cell in told[1]))
            if not any(cell in alone for cell in group):
                break
            groups.remove((dial, group))
            family = max((names.method(cell, dial) for cell in group), key=len)  # some may have nothing of the dial
            found.append(Curve(variant, family, dial, group))
            alone = {cell: None for cell in alone if cell not in group}
        found += [Curve(variant, names.method(cell), None, [cell]) for cell in alone]
    return found


def _along(cells: list[Cell], dial: str) -> list[list[Cell]]:
    """Cells that differ in the dial alone, its values rising, where there are two at least."""
    groups: dict[str, list[Cell]] = {}
    for cell in cells:
        told = of(cell)
        if dial in told:
            rest = repr(sorted((key, value) for key, value in told.items() if key != dial))
            groups.setdefault(rest, []).append(cell)
    return [sorted(group, key=lambda cell: cell.parameters[dial]) for group in groups.values() if len(group) > 1]


def _square(side: int) -> str:
    return f"{side} × {side}"


def _power(value: float) -> str:
    """A power of two as such."""
    exponent = command.power(value)
    return f"{value:.3g}" if exponent is None else f"2{str(exponent).translate(SUPERSCRIPT)}"
