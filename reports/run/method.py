"""Groups cells by method: views of one truth, names of methods, and curves along a dial such as samples."""

from collections.abc import Iterable
from dataclasses import dataclass

from reports.run import command, launch, view
from reports.run.cell import Cell
from reports.run.results import Results, grouped
from reports.run.view import View

# Parameters that a curve runs along: more is slower and nearer to the truth, or the other way round.
DIALS = ("samples", "feelers", "glossy_rays", "adaptive_threshold", "cutoff", "depth")
# Methods of single steps, with the word that follows their value in a name.
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
PLAIN = "as by default"  # in place of an empty name
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def views(results: Results) -> list[View]:
    """Returns views: cells that approximate one truth by different methods, in the order of the run.

    As in harness/judge/truth.py, a picture at the centres of pixels has another truth than one over their areas, and so
    has a picture with feelers or glossy rays, or of another depth, unless the experiment gives the truth its own depth.
    """
    free = tuple(key for key in (*DIALS, *CHOICES, "epsilon") if key != "depth" or truth_depth(results) is not None)
    found = []
    for seen in view.views(results.cells, free):
        parts = grouped(seen.cells, _kind)
        differ = [len({kind[place] for kind in parts}) > 1 for place in range(3)]
        for kind, cells in parts.items():
            words = [word for word, differs in zip(kind, differ, strict=True) if differs]
            found.append(View(", ".join([seen.label, *words]), seen.names, cells))
    return found


def _kind(cell: Cell) -> tuple[str, ...]:
    get = cell.parameters.get
    return (
        "centres of pixels" if get("sampler", "one") == "one" else "areas of pixels",
        "soft shadows" if get("feelers") else "hard shadows",
        "glossy" if get("glossy_rays") else "mirrors",
    )


def values(cell: Cell, keys: Iterable[str]) -> str:
    """Returns the values of some parameters as text."""
    return ", ".join(f"{key} = {cell.parameters[key]}" for key in keys)


def truth_depth(results: Results) -> int | None:
    """Returns the depth of the truth; None if it is each picture's own."""
    return (results.facts["experiment"].get("reference") or {}).get("depth")


def of(cell: Cell) -> dict:
    """Returns the method of a cell: its values of DIALS and CHOICES that can change its picture or its time."""
    found = {key: cell.parameters[key] for key in (*DIALS, *CHOICES) if key in cell.parameters}
    sampler = found.get("sampler", "one")
    idle = {"glossy_weight"} if not found.get("glossy_rays") else set()
    if sampler not in ("uniform", "jittered"):
        idle.add("samples")
    if sampler != "adaptive":
        idle |= {"adaptive_depth", "adaptive_threshold"}
    return {key: value for key, value in found.items() if key not in idle}


def unbiased(results: Results, cell: Cell) -> bool:
    """Is the error of a cell noise only, which more samples average away?

    This holds for random samples in strict float64 that leave nothing out. A grid converges too, but not as noise.
    """
    get, depth = cell.parameters.get, truth_depth(results)
    return (
        max(cell.known("truth_pictures", cell.timed).values(), default=1) > 1
        and get("sampler", "one") in ("jittered", "one")
        and (get("precision"), get("floating_point", "strict")) == ("float64", "strict")
        and not get("cutoff")
        and not (get("glossy_rays") and get("glossy_weight") != "plain")
        and depth in (None, get("depth"))
    )


@dataclass(frozen=True)
class Curve:
    """Cells of one variant along a dial, by its rising value; the dial is None for a single cell.

    family: the name of the method without the value of the dial.
    """

    variant: str
    family: str
    dial: str | None
    cells: list[Cell]


class Names:
    """Names the methods of a view by their values that are not the default and by the dials that vary.

    depth: the truth's, which a name leaves out.
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
        """Returns the variant and the name of the method."""
        return ", ".join(filter(None, [cell.variant, self.method(cell)]))

    def method(self, cell: Cell, *dials: str | None) -> str:
        """Returns the name of the method, "" for the default one, without the values of `dials`."""
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
            f"{sampler} {number('samples', '{0} × {0}'.format(told['samples']))}" if "samples" in told else "",
            "adaptive" if sampler == "adaptive" else "",
            f"to 1/{2 ** told['adaptive_depth']} pixel" if "adaptive_depth" in self.turned & told.keys() else "",
            number("adaptive_threshold", f"threshold {told['adaptive_threshold']:g}")
            if "adaptive_threshold" in told else "",
            number("feelers", f"{told['feelers']} feelers") if "feelers" in self.turned else "",
            number("glossy_rays", f"{told['glossy_rays']} glossy rays") if "glossy_rays" in self.turned else "",
            other("glossy_weight", "the study's weight"),
            number("cutoff", f"cut-off {_power(cutoff)}") if cutoff else "",
            number("depth", f"depth {told['depth']}") if "depth" in self.turned and told["depth"] != self.depth else "",
            other("walk", f"{told.get('walk')} walk"),
            other("accel", f"accel {told.get('accel')}"),
            other("kernel", f"{told.get('kernel')} kernel"),
            other("vector", "vector"),
            *(other(key, f"{key} {told.get(key)}") for key in launch.UNSEEN),
            f"{told.get('threads')} threads" if cell.variant in self.threaded else "",
            other("seed", f"seed {told.get('seed')}"),
        ]  # fmt: skip
        return ", ".join(filter(None, words))


def curves(cells: list[Cell], names: Names) -> list[Curve]:
    """Returns curves that hold every cell: of each variant the longest first, then shorter ones, then single cells.

    A cell may be in two curves, where dials were varied one at a time from it.
    """
    found = []
    for variant in dict.fromkeys(cell.variant for cell in cells):
        mine = [cell for cell in cells if cell.variant == variant]
        groups = [(dial, group) for dial in DIALS for group in _along(mine, dial)]
        alone = dict.fromkeys(mine)
        while groups:
            dial, group = max(groups, key=lambda one: sum(cell in alone for cell in one[1]))
            if not any(cell in alone for cell in group):
                break
            groups.remove((dial, group))
            family = max((names.method(cell, dial) for cell in group), key=len)  # some may have nothing of the dial
            found.append(Curve(variant, family, dial, group))
            alone = {cell: None for cell in alone if cell not in group}
        found += [Curve(variant, names.method(cell), None, [cell]) for cell in alone]
    return found


def _along(cells: list[Cell], dial: str) -> list[list[Cell]]:
    """Returns groups of two cells or more that differ only in the dial, by its rising value."""

    def rest(cell: Cell) -> str:
        return repr(sorted((key, value) for key, value in of(cell).items() if key != dial))

    groups = grouped((cell for cell in cells if dial in of(cell)), rest)
    return [sorted(group, key=lambda cell: cell.parameters[dial]) for group in groups.values() if len(group) > 1]


def _power(value: float) -> str:
    """Returns a power of two as such: 2⁻⁸."""
    exponent = command.power(value)
    return f"{value:.3g}" if exponent is None else f"2{str(exponent).translate(SUPERSCRIPT)}"
