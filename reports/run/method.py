"""Groups cells by method: views of one truth, names of methods, and curves along a dial such as samples."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

from harness.renderer.methods import METHODS, TIME
from reports.run import command, launch, reduced, view
from reports.run.cell import Cell
from reports.run.results import Results, grouped
from reports.run.view import View

# Parameters that a curve runs along: more is slower and nearer to the truth, or the other way round.
DIALS = ("samples", "spp", "feelers", "glossy_rays", "adaptive_threshold", "cutoff", "depth")
# Methods of single steps, with the word that follows their value in a name.
STEPS = {method.name: method.word for method in METHODS if method.word and method.changes != TIME}
PLACE = "sample_x", "sample_y"  # of a pixel's one sample
CHOICES = (
    "precision", *STEPS, "sampler", "adaptive_depth", "glossy_weight", "walk", "accel",
    "kernel", "vector", "seed", *launch.UNSEEN, "threads",
)  # fmt: skip
# Of the truth of the scene: it has samples all over a pixel, and rays that leave from the surface itself.
OF_SCENE = "sliver", *PLACE
STANDS_FOR = {
    "samples": "n × n", "spp": "n", "feelers": "n feelers", "glossy_rays": "n glossy rays",
    "adaptive_threshold": "threshold t", "cutoff": "cut-off w", "depth": "depth d",
}  # fmt: skip
HIERARCHIES = {"none": "no hierarchy", "bvh": "hierarchy"}
LANES = {"on": "lanes", "auto": "lanes where faster"}
PLAIN = "as by default"  # in place of an empty name
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Truth:
    """What the errors of a run are distances from: keys of `Reference` (harness/experiment/experiment.py)."""

    against: str
    depth: int | str


@lru_cache(maxsize=8)
def truth(results: Results) -> Truth:
    """Returns what the errors of a run are distances from; before 0.2 each picture's own limit, at its own depth."""
    reference = results.facts["experiment"].get("reference") or {}
    errors = [error for record in results.records if (error := record.get("error")) and "unavailable" not in error]
    old = any("against" not in error for error in errors)
    return Truth(
        reference.get("against") or ("centres" if old else "scene"),
        reference.get("depth") or ("own" if old else "enough"),
    )


def views(results: Results) -> list[View]:
    """Returns views: cells that approximate one truth by different methods, in the order of the run; no first hits.

    Models without something stand beside their whole scene, whose truth they have. As in harness/judge/truth.py: all
    pictures of a scene with one size, region and lens, with shadows or without, have
    one truth. Where errors are held against the centres of pixels, a picture of one sample a pixel has another truth
    than others, and so has one with feelers or glossy rays; where against a truth of each picture's own depth, one of
    another depth.
    """
    target = truth(results)
    free = {*DIALS, *CHOICES, "epsilon", reduced.KEY, *(OF_SCENE if target.against == "scene" else ())}
    free -= {"depth"} if target.depth == "own" else set()
    all_views = []
    pictures = [cell for cell in results.cells if cell.parameters.get("kind") != "rays"]
    wholes = reduced.wholes(results)
    for seen in view.views(pictures, tuple(free), lambda cell: wholes.get(cell, cell)):
        parts = grouped(seen.cells, _kind if target.against == "centres" else lambda _: ("",) * 3)
        differ = [len({kind[place] for kind in parts}) > 1 for place in range(3)]
        for kind, cells in parts.items():
            words = [word for word, differs in zip(kind, differ, strict=True) if differs]
            label, title = (", ".join([text, *words]) for text in (seen.label, seen.title))
            all_views.append(View(label, title, seen.names, cells))
    return all_views


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


def of(cell: Cell) -> dict:
    """Returns the method of a cell: its values of DIALS and CHOICES that can change its picture or its time."""
    settings = {key: cell.parameters[key] for key in (*DIALS, *CHOICES) if key in cell.parameters}
    sampler = settings.get("sampler", "one")
    idle = {"glossy_weight"} if not settings.get("glossy_rays") else set()
    if sampler not in ("uniform", "jittered"):
        idle.add("samples")
    if sampler != "sobol":
        idle.add("spp")
    if sampler != "adaptive":
        idle |= {"adaptive_depth", "adaptive_threshold"}
    model = {reduced.KEY: reduced.without(cell)} if reduced.without(cell) else {}
    return {key: value for key, value in settings.items() if key not in idle} | model


def sampled(error: dict) -> bool:
    """Is the truth of `error` of a record a mean of random pictures?"""
    return (error.get("samples") or error.get("pictures") or 1) > 1


def unbiased(results: Results, cell: Cell) -> bool:
    """Is the error of a cell noise only, which more samples average away?

    This holds for random samples in strict float64 that leave nothing out, so deep that nothing changes that the truth
    could tell. A grid converges too, but not as noise.
    """
    get, against = cell.parameters.get, truth(results).against
    error = (results.record(cell) or {}).get("error") or {}
    return (
        sampled(error)
        and get("sampler", "one") in (("jittered", "sobol") if against == "scene" else ("jittered", "sobol", "one"))
        and (get("precision"), get("floating_point", "strict")) == ("float64", "strict")
        and not get("cutoff")
        and not (get("glossy_rays") and get("glossy_weight") != "plain")
        and not reduced.without(cell)
        and _deep(results, cell, error)
        and not (against == "scene" and _leaves_out(results, cell))
    )


def _deep(results: Results, cell: Cell, error: dict) -> bool:
    """Has a picture the depth of its truth, or half of it, where it changes by less than the truth is known to?"""
    depth, truth_depth = cell.parameters.get("depth"), truth(results).depth
    if truth_depth == "enough":
        return 2 * depth >= error.get("depth", 0)
    return truth_depth in ("own", depth)


def _leaves_out(results: Results, cell: Cell) -> set[str]:
    """Returns which of soft shadows and glossy reflection this cell lacks, where other cells of the scene have them."""
    others = (results.record(other) for other in results.of(cell.scene))
    there = {need for record in others if record for need in record.get("needs") or ()}
    return {"soft", "glossy"} & there - set(results.record(cell).get("needs") or ())


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

    depth: the truth's, which a name leaves out if it is a number. silent: parameters that it leaves out.
    """

    def __init__(self, cells: list[Cell], depth: int | str | None = None, silent: tuple[str, ...] = ()):
        self.depth, self.silent = depth, silent
        methods = [(cell.variant, of(cell)) for cell in cells]
        self.placed = bool(view.differing(cells, PLACE))
        values = {key: {str(settings[key]) for _, settings in methods if key in settings} for key in (*DIALS, *CHOICES)}
        self.turned = {key for key in values if len(values[key]) > 1}
        threads: dict[str, set] = {}
        for variant, settings in methods:
            threads.setdefault(variant, set()).add(settings.get("threads"))
        several = {variant for variant, counts in threads.items() if len(counts) > 1}
        self.threaded = several if "threads" not in silent else set()

    def full(self, cell: Cell) -> str:
        """Returns the variant and the name of the method."""
        return ", ".join(filter(None, [cell.variant, self.method(cell)]))

    def method(self, cell: Cell, *dials: str | None) -> str:
        """Returns the name of the method, "" for the default one, without the values of `dials`."""
        return ", ".join(self.words(cell, *dials))

    def words(self, cell: Cell, *dials: str | None) -> list[str]:
        """Returns the parts of `method`, one for each choice that is not the default and each dial that varies."""
        settings = of(cell)

        def number(key: str, text: str) -> str:
            return STANDS_FOR[key] if key in dials else text

        def other(key: str, text: str) -> str:
            named = key in settings and key not in self.silent
            return text if named and settings[key] != command.default(key) else ""

        sampler, cutoff = settings.get("sampler", "one"), settings.get("cutoff", 0)
        words = [
            other("vector", LANES.get(settings.get("vector"), "")),
            other("precision", f"{settings['precision']}"),
            *(other(key, f"{settings.get(key)} {what}") for key, what in STEPS.items()),
            "one sample" if sampler == "one" and "sampler" in self.turned else "",
            "at {}, {}".format(*map(cell.parameters.get, PLACE)) if sampler == "one" and self.placed else "",
            f"{sampler} {number('samples', '{0} × {0}'.format(settings['samples']))}" if "samples" in settings else "",
            f"sobol {number('spp', settings['spp'])}" if "spp" in settings else "",
            "adaptive" if sampler == "adaptive" else "",
            f"to 1/{2 ** settings['adaptive_depth']} pixel"
            if "adaptive_depth" in self.turned & settings.keys() else "",
            number("adaptive_threshold", f"threshold {settings['adaptive_threshold']:g}")
            if "adaptive_threshold" in settings else "",
            number("feelers", _many(settings["feelers"], "feeler", "hard shadows")) if "feelers" in self.turned else "",
            number("glossy_rays", _many(settings["glossy_rays"], "glossy ray", "mirrors"))
            if "glossy_rays" in self.turned else "",
            other("glossy_weight", "the study's weight"),
            number("cutoff", f"cut-off {_power(cutoff)}") if cutoff else "",
            number("depth", f"depth {settings['depth']}")
            if "depth" in self.turned and settings["depth"] != self.depth else "",
            other("walk", f"{settings.get('walk')} walk"),
            other("accel", HIERARCHIES.get(settings.get("accel"), "")),
            other("kernel", f"{settings.get('kernel')} kernel"),
            *(other(key, f"{key.replace('_', ' ')} {settings.get(key)}") for key in launch.UNSEEN),
            _threads(settings.get("threads")) if cell.variant in self.threaded else "",
            other("seed", f"seed {settings.get('seed')}"),
            f"without {settings[reduced.KEY]}" if reduced.KEY in settings else "",
            f"epsilon {cell.swept['epsilon']}" if "epsilon" in cell.swept else "",  # else it follows from the precision
        ]  # fmt: skip
        return [word for word in words if word]


def curves(cells: list[Cell], names: Names) -> list[Curve]:
    """Returns curves that hold every cell: of each variant the longest first, then shorter ones, then single cells.

    A cell may be in two curves, where dials were varied one at a time from it.
    """
    all_curves = []
    for variant in dict.fromkeys(cell.variant for cell in cells):
        of_variant = [cell for cell in cells if cell.variant == variant]
        groups = [(dial, group) for dial in DIALS for group in _along(of_variant, dial)]
        alone = dict.fromkeys(of_variant)
        while groups:
            dial, group = max(groups, key=lambda pair: sum(cell in alone for cell in pair[1]))
            if not any(cell in alone for cell in group):
                break
            groups.remove((dial, group))
            family = max((names.method(cell, dial) for cell in group), key=len)  # some may have nothing of the dial
            all_curves.append(Curve(variant, family, dial, group))
            alone = {cell: None for cell in alone if cell not in group}
        all_curves += [Curve(variant, names.method(cell), None, [cell]) for cell in alone]
    return all_curves


def _along(cells: list[Cell], dial: str) -> list[list[Cell]]:
    """Returns groups of two cells or more that differ only in the dial, by its rising value."""

    def rest(cell: Cell) -> str:
        return repr(sorted((key, value) for key, value in of(cell).items() if key != dial))

    groups = grouped((cell for cell in cells if dial in of(cell)), rest)
    return [sorted(group, key=lambda cell: cell.parameters[dial]) for group in groups.values() if len(group) > 1]


def _many(count: int, what: str, none: str) -> str:
    return f"{count} {what}{'s' * (count > 1)}" if count else none


def _threads(count: int | None) -> str:
    return "1 thread" if count == 1 else f"{count} threads"


def _power(value: float) -> str:
    """Returns a power of two as such: 2⁻⁸."""
    exponent = command.power(value)
    return f"{value:.3g}" if exponent is None else f"2{str(exponent).translate(SUPERSCRIPT)}"
