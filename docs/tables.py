"""Writes the tables of README and docs from the reference results: python docs/tables.py [FOLDER].

A page holds a table, or a list of findings with their numbers, between <!-- table: NAME --> and <!-- end -->.
"""

import itertools
import json
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np

from harness.statistics.statistics import Estimate
from harness.store import packed
from reports.accuracy import accuracy_columns, chaos, convergence, precision
from reports.paper import markdown, quantity
from reports.run import gpu, ranking, reduced, results, study
from reports.run.results import Cell, Missing, Results
from reports.scaling import (
    complexity_models,
    complexity_points,
    complexity_text,
    hierarchy,
    limits,
    sweep,
    sweep_figure,
)
from reports.stability import overview, stability
from reports.study import ladder, verdict
from reports.times import cpu_figure, startup_table

ROOT = Path(__file__).parents[1]
PAGES = (
    "README.md",
    *(f"docs/{name}.md" for name in ("results", "fast-paths", "speed-and-accuracy", "where-methods-fail", "on-a-gpu")),
    "docs/what-effects-are-worth.md",
)
MARK = re.compile(r"(<!-- table: (?P<name>[\w-]+) -->\n).*?(<!-- end -->)", re.DOTALL)


@contextmanager
def _opened(machine: str, name: str) -> Iterator[Results]:
    """A run whose pictures can be read meanwhile."""
    with packed.opened(ROOT / "results" / "reference" / machine / f"{name}.tar.xz") as folder:
        yield results.load(folder)


@cache
def _run(machine: str, name: str) -> Results:
    with _opened(machine, name) as run:
        return run


def _cell(run: Results, **wanted) -> Cell:
    """The one cell with these values; `case` is a whole name."""
    case = wanted.get("case")
    (found,) = (one for one in verdict.cells(run, wanted) if case in (None, one.swept.get("case")))
    return found


def _shown(run: Results, value: Estimate | Missing) -> str:
    return str(value) if isinstance(value, Missing) else quantity.ratio(value, run.floor.value)


def _tracing(run: Results, pov_ray: Cell, cell: Cell) -> str:
    """The time in which POV-Ray traces over the time of the cell, or of its own whole process."""
    traced = pov_ray.rounds("trace_s")
    return _shown(run, ranking.ratio_of_rounds(traced, cell.rounds("steady_s")) if traced else Missing(limits.NO_TRACE))


TRACING = "POV-Ray's tracing ÷ its time"


def _table(header: list[str], rows: list[list[str]]) -> str:
    """A table of texts that need no escape."""
    return markdown.table(header, [[markdown.Ready(text) for text in row] for row in rows])


# --- Lanes, scene by scene ---

PRECISIONS = "float32", "float64"
COMPARISON, BALLS = "scenes/comparison.txt", "generated/balls-size-4.txt"  # of lanes.toml, beside the gallery
SCENE_BY_SCENE = {"width": 320}
STUDY_CASE = {"width": 512}  # of the comparison scene


def _lanes() -> Results:
    return _run("emerald-rapids-2x", "lanes")


def _files(run: Results) -> list[str]:
    return [scene for scene in run.scenes if scene != BALLS]


def _ratio(run: Results, scene: str, above: dict, below: dict) -> Estimate | Missing:
    over, under = (_cell(run, scene=scene, **wanted) for wanted in (above, below))
    return next((Missing(cell.unranked) for cell in (over, under) if cell.unranked), None) or ranking.ratio(over, under)


def _mean(run: Results, above: dict, below: dict) -> Estimate:
    """The geometric mean over the gallery."""
    pairs = [tuple(_cell(run, scene=scene, **one) for one in (above, below)) for scene in _files(run)]
    return ranking.mean_ratio([pair for pair in pairs if pair[0].scene != COMPARISON])


def lanes(*pairs: tuple[str, dict, dict]) -> Callable[[], str]:
    """Returns a table of ratios of times: a row for each scene, a column for each pair (title, above, below)."""

    def made() -> str:
        run = _lanes()
        rows = [
            [Path(scene).stem, *(_shown(run, _ratio(run, scene, *pair[1:])) for pair in pairs)] for scene in _files(run)
        ]
        means = [quantity.text(_mean(run, *pair[1:])) for pair in pairs]  # the noise floor is of one scene
        rows.append(["geometric mean of the gallery", *means])
        return _table(["scene", *(pair[0] for pair in pairs)], rows)

    return made


def _of(variant: str, precision: str, vector: str, of: dict = SCENE_BY_SCENE) -> dict:
    return {"variant": variant, "precision": precision, "vector": vector, **of}


def _against_off(vector: str) -> list[tuple[str, dict, dict]]:
    return [
        (f"{variant}, {precision}", _of(variant, precision, vector), _of(variant, precision, "off"))
        for variant in ("cpp", "numba")
        for precision in PRECISIONS
    ]


NUMBA_OVER_CPP = [(f"numba over cpp, {one}", _of("numba", one, "on"), _of("cpp", one, "on")) for one in PRECISIONS]


def gains() -> str:
    """What each fast path gains, of one run: ratios of times."""
    run, rows = _lanes(), []
    compared = [
        *((f"{name}, in lanes over one by one", *pair) for name, *pair in _against_off("on")),
        *((f"{name}, both in lanes", *pair) for name, *pair in NUMBA_OVER_CPP),
        (
            "cpp in lanes, float32, over cpp one by one, float64",
            _of("cpp", "float32", "on"),
            _of("cpp", "float64", "off"),
        ),
    ]
    for told, above, below in compared:
        ratios = [_ratio(run, scene, above, below) for scene in _files(run) if scene != COMPARISON]
        worst = max((one for one in ratios if not isinstance(one, Missing)), key=lambda one: one.value)
        case = _ratio(run, COMPARISON, above | STUDY_CASE, below | STUDY_CASE)
        rows.append([told, quantity.text(_mean(run, above, below)), _shown(run, worst), _shown(run, case)])
    readable = _of("cpp", "float64", "off", STUDY_CASE)
    naive_ = _ratio(run, COMPARISON, readable, {**readable, "variant": "naive"})
    rows.append(["cpp over naive C++, float64, both one by one", "", "", _shown(run, naive_)])
    pov_ray, quick = (
        _cell(run, scene=BALLS, **one) for one in (_of("povray", "float64", "off"), _of("cpp", "float64", "on"))
    )
    header = ["time over time", "the gallery, geometric mean", "its largest", "the study's case"]
    group = limits.Limits(run, "", verdict.cells(run, {"scene": COMPARISON, **STUDY_CASE}))
    quickest = {one: _cell(run, scene=COMPARISON, **_of("cpp", one, "on", STUDY_CASE)) for one in PRECISIONS}
    shares = " and ".join(f"{quantity.text(group.share(cell), 100)} % in {one}" for one, cell in quickest.items())
    peak = f"On the study's case `cpp` in lanes reaches {shares} of the peak of fused multiply-adds."
    slower = _tracing(run, pov_ray, quick)
    balls_ = f"On Haines' balls POV-Ray takes {slower} times as long to trace as `cpp` in lanes of float64."
    return f"{_table(header, rows)}\n\n{peak} {balls_}"


def roofline() -> str:
    """Operations of each scene, and shares of the machine's peak one ray after another and in lanes."""
    kinds = ("float64", "off"), ("float64", "on"), ("float32", "on")
    rows = []
    for group in limits.pictures(_run("cascade-lake-2x", "roofline")):
        cells = {(cell.parameters["precision"], group.vector(cell)): cell for cell in group.cells}
        shares = [quantity.text(group.share(cells[kind]), 100) for kind in kinds]
        operations = [quantity.plain(group.intensity(cells[precision, "on"])) for precision in PRECISIONS]
        rows.append([group.cells[0].swept["case"], *operations, *shares])
    header = [f"flop a byte, {precision}" for precision in PRECISIONS]
    told = [
        f"{precision}, {'in lanes' if vector == 'on' else 'one by one'} (% of the peak)" for precision, vector in kinds
    ]
    return _table(["scene", *header, *told], rows)


# --- The comparison ---

WHOLE = {"region": "all", "vector": "off", "precision": "float64"}  # the study's case
RACED = "python", "numpy", "numba", "numba-parallel", "cpp", "cpp-threads"


def _comparison() -> Results:
    return _run("epyc-2x", "comparison")


def times() -> str:
    """Times, errors and costs of the variants on the study's case, beside the study's times."""
    run = _comparison()
    base = _cell(run, variant="cpp", **WHOLE)
    header = ["variant", "steady frame (s)", "÷ cpp", "RMSE", "agrees", "compile, cold (s)", "peak RSS (MB)"]
    rows = []
    for name in RACED:
        cell = _cell(run, variant=name, **WHOLE)
        published = study.find(study.TIMES_S, cell)
        rows.append(
            [
                name,
                quantity.text(cell.steady),
                "1" if cell is base else _shown(run, ranking.ratio(cell, base)),
                accuracy_columns.shown_rmse(cell),
                cell.agreement,
                quantity.text(startup_table.cold(cell)),
                quantity.text(cell.median("peak_bytes", "not told"), 1e-6),
                "" if isinstance(published, Missing) else study.show(published),
            ]
        )
    share = quantity.percentage(run.floor.value)
    floor = f"The noise floor of the run, from running `cpp` twice in every round, is {share}."
    return _table([*header, "the study, 2020 (s)"], rows) + f"\n\n{floor}"


def fast() -> str:
    """Rays in lanes on the study's case: time over that of `cpp` one by one, and errors."""
    run = _comparison()
    base = _cell(run, variant="cpp", **WHOLE)
    rows = []
    for name, numbers in itertools.product(("cpp", "numba", "cpp-threads", "numba-parallel"), ("float64", "float32")):
        cell = _cell(run, variant=name, **{**WHOLE, "vector": "on", "precision": numbers})
        ratio, rmse = _shown(run, ranking.ratio(cell, base)), accuracy_columns.shown_rmse(cell)
        rows.append([f"{name}, {numbers}", ratio, rmse, cell.agreement])
    return _table(["in lanes", "time ÷ cpp, one by one, float64", "RMSE", "agrees"], rows)


# --- Sweeps ---


def crossings() -> str:
    """A line for each place where one renderer overtakes another."""
    run = _run("epyc-2x", "sweeps")
    found = sweep_figure.crossings(run, sweep.panels(run), sweep.TIME)
    return markdown.bullets([sweep_figure.words(panel, sweep.TIME, one) for panel in found for _, one in found[panel]])


# --- Accuracy ---

# Of accuracy.toml: one sample, strict, the default solvers and walk, depth 6, nothing cut off.
ONE = {
    **{"sampler": "one", "precision": "float64", "vector": "off", "depth": 6, "cutoff": 0.0, "sphere": "robust"},
    **{"floating_point": "strict", "walk": "least", "samples": 1},
}


def equation() -> str:
    """Fits of the study's equation 4.1 to each renderer: exponents of its factors, and what it leaves."""
    rows = []
    for series in complexity_points.series(_run("epyc-2x", "complexity")):
        found = complexity_models.fitted(series)
        powers = {
            one.factor: complexity_text.power(one) for one in found.powers if one.model == complexity_models.STUDY
        }
        lines = [found.line(model) for model in (complexity_models.STUDY, complexity_models.COUNTED)]
        spreads = ["unavailable" if line is None else quantity.percentage(line.spread) for line in lines]
        rows.append([series.label, *(powers[factor] for factor in ("p", "d", "o + l")), *spreads])
    header = [f"exponent of {factor}" for factor in ("p", "d", "o + l")]
    return _table(["variant", *header, "spread of a + b p d (o + l)", "of a + b rays (o + l)"], rows)


def cutoffs() -> str:
    """What a cut-off of 2^-8 saves and changes, scene by scene."""
    run = _run("epyc-2x", "accuracy")
    rows = []
    for case in _cases(run):
        whole, cut = (_cell(run, **{**ONE, "case": case, "variant": "cpp", "cutoff": at}) for at in (0.0, "2^-8"))
        if whole.unranked or cut.unranked:
            continue
        kept = _rays(run, cut) / _rays(run, whole)
        errors = [accuracy_columns.shown_rmse(cell) for cell in (whole, cut)]
        rows.append([case, quantity.percent(kept), _shown(run, ranking.ratio(cut, whole)), *errors])
    return _table(["scene", "rays kept", "time ÷ without", "RMSE without", "with"], rows)


def _rays(run: Results, cell: Cell) -> int:
    return sum(run.record(cell)["rays"][kind] for kind in ("primary", "reflected", "transmitted", "shadow"))


# --- Samples, and rounding between mirrors ---

SAMPLED = {
    "edge": "edges at general angles",
    "aligned": "edges along rows and columns",
    "smooth": "shading without an edge",
    "lens": "a lens",
    "soft": "soft shadows",
    "glossy": "glossy mirrors",
}
BY = {"glossy_rays": "glossy rays"}
SINGLE = "cpp", ("float32", "strict")


def slopes() -> str:
    """Slopes of error against samples, beside theory's."""
    with _opened("cascade-lake-2x", "sampling") as run:
        found = {view.cells[0].swept["case"]: lines for view, lines in convergence.lines_by_view(run)}
    rows = [
        [SAMPLED[case], BY.get(line.sampler, line.sampler), quantity.text(line.slope), quantity.plain(line.theory)]
        for case in SAMPLED
        for line in found[case]
        if "cpp" in line.variants
    ]
    return _table(["sampled", "by", "slope", "theory"], rows)


def growth() -> str:
    """A sentence on how rounding grows between mirrors."""
    with _opened("cascade-lake-2x", "precision") as run:
        (mirrors,) = [one for one in chaos.mirror_views(run) if one.view.cells[0].swept["case"] == "perfect"]
        views = precision.methods_by_view(run)
    (single,) = [one for one in mirrors.growths if (one.variant, one.arithmetic) == SINGLE]
    bad, none = (quantity.percent(_beyond(views, *where)) for where in (("perfect", 10), ("matte", 0)))
    beyond = "differ from the float64 picture by more than 1/255 at depth 10"
    told = f"In float32, {bad} of the pixels between perfect mirrors {beyond}, and {none} of matte spheres"
    more = f"a difference grows {quantity.times(single.growth)} with each bounce there"
    return f"{told}; {more}, so float32 is of use for some {single.useful:.0f} bounces."


def _beyond(views: list, case: str, depth: int) -> float:
    """The share of pixels of float32 that are off by more than 1/255."""
    (methods,) = [methods for view, methods in views if view.cells[0].swept["case"] == case]
    (single,) = [one for one in methods if (one.variant, one.arithmetic) == SINGLE]
    return next(found.bad for found in single.pictures if found.depth == depth)


# --- Where methods fail ---

FAILING = (
    "far-picture", "huge-sphere", "acne-scale", "leak", "cracks", "coincident-and", "thin-part", "drift",
    "highlight-behind", "slabs",
)  # fmt: skip
READABLE = "cpp"


def failing(name: str) -> Callable[[], str]:
    """Returns a table of the levels at which the ways of a row of the catalogue fail, in the readable renderer."""

    def made() -> str:
        row = _row(name)
        curves = [curve for curve in row.curves if curve.variant == READABLE]
        numbers = sorted({curve.precision for curve in curves})
        table = []
        for way in row.ways:
            mine = {curve.precision: curve for curve in curves if curve.way == way}
            if mine:
                told = [overview.broken(mine.get(one)) for one in numbers]
                table.append([f"{way.name}{' (naive)' * way.naive}", *told])
        return _table([f"{row.label}: {row.facts['stress']}", *(f"first failure in {one}" for one in numbers)], table)

    return made


def pixel_bytes() -> str:
    """Returns a table of the bytes of a pixel in work at the greatest depth, for each way to walk the tree of rays."""
    row = _row("table")
    curves = [curve for curve in row.curves if curve.variant == READABLE]
    numbers, ways = sorted({curve.precision for curve in curves}), list(dict.fromkeys(curve.way for curve in curves))
    lasts = {(curve.way, curve.precision): curve.answered[-1] for curve in curves}
    (depth,) = {last.level for last in lasts.values()}
    rows = [[way.name, *(quantity.size(lasts[way, one].answers["error_median"]) for one in numbers)] for way in ways]
    return _table([f"bytes of a pixel, depth {depth:g}", *numbers], rows)


def _row(name: str) -> stability.Row:
    (found,) = (row for row in stability.rows(_run("cascade-lake-2x", "stability")) if row.name == name)
    return found


# --- Peers ---

PICTURES = "spheres", "in lanes, float64", "in lanes, float32"  # cases of peers.toml


def peers() -> str:
    """Times of all technologies on the comparison scene, over readable C++ and under POV-Ray."""
    run = _run("emerald-rapids-2x", "peers")
    base, pov_ray = (_cell(run, case=PICTURES[0], variant=name) for name in ("cpp", "povray"))
    rows = []
    for case, name in itertools.product(PICTURES, sorted(run.variants)):
        for cell in verdict.cells(run, {"variant": name}):
            if cell.swept["case"] != case or cell.unranked or limits.threads(cell) > 1:
                continue
            label = name if case == PICTURES[0] else f"{name}, {case}"
            over = "1" if cell is base else _shown(run, ranking.ratio(cell, base))
            rows.append([label, over, _tracing(run, pov_ray, cell), accuracy_columns.shown_rmse(cell), cell.agreement])
    floor = f"The noise floor of the run is {quantity.percentage(run.floor.value)}."
    header = ["variant", "time ÷ cpp", TRACING, "RMSE", "agrees"]
    return f"{_table(header, sorted(rows))}\n\n{floor}"


def threads() -> str:
    """What all threads gain over one on the comparison scene, and its share of what the machine gains."""
    run = _lanes()
    group = limits.Limits(run, "", verdict.cells(run, {"scene": COMPARISON, **STUDY_CASE}))
    rows = []
    for cell in group.cells:
        if cell.variant in ("cpp-threads", "numba-parallel"):
            lanes_ = ", in lanes" if group.vector(cell) == "on" else ""
            label = f"{cell.variant}{lanes_}, {cell.parameters['precision']}"
            gain, share = _shown(run, group.speed_up(cell)), quantity.text(group.efficiency(cell), 100)
            rows.append([label, str(limits.threads(cell)), gain, share])
    return _table(["variant", "threads", "speed-up", "share of the machine's gain (%)"], sorted(rows))


# --- Without guards ---


def naive() -> str:
    """The time of readable C++ over that of naive C++, and of itself without one guard against rounding."""
    run = _run("emerald-rapids-2x", "naive")
    rows, columns = [], list(itertools.product(("float64", "float32"), ("strict", "contract")))
    cases = [("cpp", case) for case in dict.fromkeys(cell.swept["case"] for cell in run.cells) if case != "guards"]
    for name, case in [("naive", "guards"), *cases]:
        row = [f"{name}, {case}" if name == "cpp" else name]
        for numbers, arithmetic in columns:
            wanted = {"precision": numbers, "floating_point": arithmetic}
            cell, base = (_cell(run, variant=one, case=at, **wanted) for one, at in ((name, case), ("cpp", "guards")))
            timed = not isinstance(cell.steady, Missing)
            row.append(_shown(run, ranking.ratio(base, cell)) if timed else cell.verdict)
        rows.append(row)
    floor = f"The noise floor of the run is {quantity.percentage(run.floor.value)}."
    header = ["cpp's time ÷ that of", *(f"{one}, {WAYS[way]}" for one, way in columns)]
    return f"{_table(header, rows)}\n\n{floor}"


WAYS = {"strict": "strict", "contract": "fused"}  # floating_point, in a heading


def first_hits() -> str:
    """Times of lists of rays over Embree's own search."""
    run = _run("emerald-rapids-2x", "peers")
    group = limits.Limits(run, "first hits", [cell for cell in run.cells if cell.parameters["kind"] == "rays"])
    rows = []
    for cell in group.cells:
        if not cell.unranked and limits.threads(cell) == 1:
            lanes = ", in lanes" if group.vector(cell) == "on" else ""
            rows.append([f"{cell.variant}{lanes}", _shown(run, group.over_search(cell))])
    return _table(["first hits", "a whole frame ÷ Embree's own search"], sorted(rows))


def mesh_pictures() -> str:
    """Times of pictures of triangles over that of Embree with NumPy."""
    run = _run("emerald-rapids-2x", "peers")
    cells = [cell for cell in run.cells if (cell.swept["case"] or "").startswith("balls of triangles")]
    (embree,) = (cell for cell in cells if cell.variant == "embree" and not cell.unranked)
    rows = []
    for cell in cells:
        if cell is not embree and not cell.unranked and limits.threads(cell) == 1:
            lanes = ", in lanes" if cell.swept["case"].endswith("lanes") else ""
            rows.append([f"{cell.variant}{lanes}", _shown(run, ranking.ratio(cell, embree)), cell.agreement])
    return _table(["pictures of triangles", "time ÷ embree", "agrees"], sorted(rows))


# --- Hierarchies ---


def hierarchies() -> str:
    """From how many objects on each renderer is faster with a hierarchy, and how long it builds its largest."""
    rows = []
    for line in hierarchy.lines_of(_run("emerald-rapids-2x", "hierarchy")):
        even = hierarchy.break_even(line)
        pays = str(even) if isinstance(even, Missing) else quantity.plain(even.objects, 2)
        last = max((one for one in line.points if one.bvh), key=lambda one: one.objects)
        label = line.label.replace(", vector = off", "").replace(", vector = on", ", in lanes")
        rows.append([Path(line.scene).stem, label, pays, f"{last.objects:,}", quantity.text(last.built, 1e3)])
    return _table(["scene", "renderer", "pays from (objects)", "the largest (objects)", "its build (ms)"], rows)


# --- Beside POV-Ray ---

LARGEST = 4  # of the sizes of balls.toml


def balls() -> str:
    """Times of the largest balls, beside POV-Ray on as many threads."""
    run = _run("emerald-rapids-2x", "balls")
    rows = []
    for name, vector in itertools.product(("cpp", "cpp-threads", "numba", "numba-parallel"), ("off", "on")):
        if name.startswith("numba") and vector == "on":
            continue  # as `where` of the experiment has it
        cell = _cell(run, variant=name, size=LARGEST, vector=vector)
        theirs = "povray-threads" if name in ("cpp-threads", "numba-parallel") else "povray"
        ratio = _tracing(run, _cell(run, variant=theirs, size=LARGEST), cell)
        rows.append(
            [f"{name}, in lanes" if vector == "on" else name, quantity.text(cell.steady), ratio, cell.agreement]
        )
    for name in ("povray", "povray-threads"):
        cell = _cell(run, variant=name, size=LARGEST)
        rows.append([name, quantity.text(cell.steady), _tracing(run, cell, cell), cell.agreement])
    floor = f"The noise floor of the run is {quantity.percentage(run.floor.value)}."
    return _table(["variant", "steady frame (s)", TRACING, "agrees"], rows) + f"\n\n{floor}"


# --- What effects are worth ---

# Rows of the tables for teachers, and how the names of their leave-outs begin.
EFFECTS = {
    "shadows": "shadows",
    "soft shadows": "soft shadows",
    "4 feelers, to 1": "feelers",
    "glossy reflection": "glossy reflection",
    "4 glossy rays, to 1": "glossy rays",
    "depth 10 (glossy mirrors: 3), to 0": r"depth \d+ to 0",
    "the same, to 1": r"depth \d+ to 1",
    "the same, to 2": r"depth \d+ to 2",
    "rays of a weight up to 2^-6": r"rays of a weight up to 2\^-6",
    "specular share": "specular share of",
    "constant Fresnel share": "constant Fresnel share of",
    "refraction, and a constant Fresnel share": "constant Fresnel share, no refraction",
    "transmission": "transmission of",
    "attenuation": "attenuation of",
    "medium of the air": "medium of the air",
    "ambient light": "ambient light",
    "lens": "lens",
    "supersampling": "supersampling",
    "4 x 4 samples, to 2 x 2": "samples",
    "a quarter of the triangles": "triangles 4,608 to 1,152",
    "float64, to float32": "float64",
    "one ray at a time, to lanes": "one ray at a time",
}


def worth(header: str, whole: str | None, shown: Callable[[Results, Cell, Cell], str]) -> Callable[[], str]:
    """Returns a table of the scenes without each effect. whole: the text of the whole scene, None for `shown` of it.

    shown: what it tells of a cell and its whole scene.
    """

    def made() -> str:
        run = _run("emerald-rapids-2x", "needs-gallery")
        scenes = {cell.swept["case"]: cell for cell in run.cells if not reduced.without(cell)}
        rows = [["nothing", *(whole or shown(run, cell, cell) for cell in scenes.values())]]
        for effect, begins in EFFECTS.items():
            found = {cell.swept["case"]: cell for cell in run.cells if re.match(begins, reduced.without(cell))}
            if found:
                rows.append(
                    [effect, *(shown(run, found[case], scenes[case]) if case in found else "" for case in scenes)]
                )
        return _table([header, *scenes], rows)

    return made


def _steps(run: Results, cell: Cell, whole: Cell) -> str:
    """The RMSE in steps of an 8-bit picture."""
    error = cell.error()
    return str(error) if isinstance(error, Missing) else quantity.plain(255 * error, 2)


def _time(run: Results, cell: Cell, whole: Cell) -> str:
    """The time of a frame over that of the whole scene."""
    return cell.unranked or whole.unranked or _shown(run, ranking.ratio(cell, whole))


# --- What was found out ---

FRONT = "mirrors"  # the case of accuracy.toml


def _way(run: Results, variant: str, **more) -> Cell:
    """A cell of the front, as ONE but for `more`."""
    return _cell(run, case=FRONT, variant=variant, **{**ONE, **more})


def findings() -> str:
    """Six findings, each with its numbers and the run that shows it."""
    return markdown.bullets([_of_numba(), _of_style(), _of_lanes(), _of_gpu(), _of_samples(), _of_depth()])


def _of_numba() -> str:
    run = _comparison()
    one_by_one = _shown(run, ranking.ratio(*(_cell(run, variant=name, **WHOLE) for name in ("numba", "cpp"))))
    mean = quantity.text(_mean(_lanes(), *NUMBA_OVER_CPP[1][1:]))
    told = f"with rays in lanes, the best of both, Numba takes {mean} times the time of C++ on one core"
    more = f"(float64, geometric mean over the gallery); one ray after another on the study's scene {one_by_one} times"
    return f"**Numba is close to C++**: {told} {more}, where the study found 13. [The race](docs/results.md)."


def _of_style() -> str:
    whole = next(climb for climb in ladder.climbs(_run("epyc-2x", "ladder")) if climb.name == "All the way")
    factor, share = quantity.plain(whole.whole.value, 2), quantity.plain(100 * whole.accounted)
    told = f"the study's code in Python takes {factor} times as long as the fastest of ours on the same machine"
    rungs = f"one change at a time accounts for {share} % of that"
    return f"**Most of the study's factors are style**: {told}; {rungs}. [Every claim, a verdict](docs/the-study.md)."


def _of_lanes() -> str:
    run, race = _lanes(), _comparison()
    means = [quantity.text(_mean(run, *_pair("cpp", one))) for one in PRECISIONS]
    threads = ranking.ratio(*(_cell(race, variant=name, **WHOLE) for name in ("cpp-threads", "cpp")))
    told = f"rays side by side take {means[0]} of the time of C++ in float32 and {means[1]} in float64"
    more = f"(geometric means over the gallery); a second core, {_shown(race, threads)}"
    return f"**Lanes buy more than a second core**: {told} {more}. [The fast paths](docs/fast-paths.md)."


def _of_gpu() -> str:
    """A GPU beside the best of all cores of its machine; without lanes there, what lanes gain on another."""
    run = _run(GPU, "gpu")
    wanted = {"precision": "float64", "floating_point": "strict"}
    numba, cuda = (_cell(run, variant=name, vector="off", **wanted) for name in ("numba-cuda", "cuda-cpp"))
    best = min(_on_cores(run, **wanted), key=lambda cell: cell.steady.value)
    factors = [ranking.ratio(best, cell).value for cell in (numba, cuda)]
    device, cores = gpu.device(run, cuda, "name"), run.facts["environment"]["cores"]["usable"]
    told = f"on one {device} Numba is {quantity.plain(factors[0], 2)} times as fast as"
    and_cuda = f"and CUDA C++ {quantity.plain(factors[1], 2)} times"
    note = f"in float64 (medians of {best.steady.processes} processes)"
    if best.parameters["vector"] == "on":
        rival = f"{best.variant} in lanes on {cores} cores"
        return f"**A GPU beside all cores, both at their best**: {told} {rival}, {and_cuda}, {note}. {ON_A_GPU}"
    lanes_ = _lanes_of_threads("float64")
    left = " and ".join(quantity.plain(factor * lanes_.value, 2) for factor in factors)
    rival = f"C++ on {cores} cores that trace one ray after another"
    more = (
        f"lanes, which no run has beside a GPU yet, take C++ to {quantity.text(lanes_)} of its time on two other cores"
    )
    rest = f"if they do so there, {left} times remain"
    return f"**A GPU, from Python too**: {told} {rival}, {and_cuda}, {note}; {more}: {rest}. {ON_A_GPU}"


ON_A_GPU = "[On a GPU](docs/on-a-gpu.md)."


def _on_cores(run: Results, **wanted) -> list[Cell]:
    """The cells of all cores of the processor, in lanes too, that have a rank."""
    found = [
        cell for name in ("cpp-threads", "numba-parallel") for cell in verdict.cells(run, {"variant": name, **wanted})
    ]
    return [cell for cell in found if not cell.unranked]


def _lanes_of_threads(precision: str) -> Estimate:
    """The time of C++ on all cores in lanes over that one ray after another, on the study's case."""
    found = _ratio(
        _lanes(), COMPARISON, *(_of("cpp-threads", precision, vector, STUDY_CASE) for vector in ("on", "off"))
    )
    assert isinstance(found, Estimate), found
    return found


LEAST_FALLS = (4, 2.0), (8, 1.5)  # samples on a side, and by how much they lower the error at least if they decide it


def _of_samples() -> str:
    """What samples do to the error, and whether they decide it."""
    run = _run("epyc-2x", "accuracy")
    python, quick = _way(run, "python"), _way(run, "cpp-threads", precision="float32", vector="on")
    many = {1: _way(run, "cpp"), **{n: _way(run, "cpp", sampler="jittered", samples=n) for n, _ in LEAST_FALLS}}
    errors = {n: cell.error() for n, cell in many.items()}
    decide = all(errors[before] >= fall * errors[n] for before, (n, fall) in zip((1, 4), LEAST_FALLS, strict=True))
    title = "Samples decide the error" if decide else "Samples lower the error, and do not decide it alone"
    slow, fast = quantity.seconds(python.steady), quantity.seconds(quick.steady)
    quickest = f"C++ in lanes of float32 on two cores {fast}"
    told = f"with one sample a pixel {_of_all(run)}: Python takes {slow} for it, {quickest}"
    more = ", ".join(f"{n} × {n} samples have {accuracy_columns.shown_rmse(many[n])}" for n, _ in LEAST_FALLS)
    rest = "" if decide else f", where independent samples would have {quantity.plain(errors[1] / 8)}"
    return f"**{title}**: {told}; {more}{rest}. [Speed against accuracy](docs/speed-and-accuracy.md)."


def _of_all(run: Results) -> str:
    """The error of one sample in words, of all renderers that made a right picture."""
    cells = [cell for name in run.variants for cell in verdict.cells(run, {"variant": name, **ONE})]
    shown = {accuracy_columns.shown_rmse(cell) for cell in cells if cell.swept["case"] == FRONT and not cell.unranked}
    return (
        f"every renderer has an RMSE of {min(shown)}" if len(shown) == 1 else f"RMSEs are {min(shown)} to {max(shown)}"
    )


def _of_depth() -> str:
    run = _run("epyc-2x", "complexity")
    base = {"variant": "cpp", "side": 128, "objects": 48, "lights": 3, "depth": 4}

    def grown(name: str, few: int, many: int) -> str:
        return quantity.times(ranking.ratio(*(_cell(run, **{**base, name: n}) for n in (many, few))))

    told = f"depth 16 takes C++ {grown('depth', 1, 16)} the time of depth 1, since mirror rays leave the scene"
    more = f"12 lights take it {grown('lights', 1, 12)} that of 1"
    return f"**Depth is no factor**, as it is in the study's equation 4.1: {told}; {more}. [The race](docs/results.md)."


def _pair(variant: str, precision: str) -> tuple[dict, dict]:
    return _of(variant, precision, "on"), _of(variant, precision, "off")


def _cases(run: Results) -> list[str]:
    return sorted({cell.swept["case"] for cell in run.cells})


# --- On a GPU ---

GPU = "h200-16x"
NO_INTERVAL = "Medians of {} processes or fewer, too few for intervals; a first look."


def gpu_times() -> str:
    """Times, energy and errors of the comparison on a GPU, beside all cores of the processor."""
    run = _run(GPU, "gpu")
    rows, most = [], 0
    ways = itertools.product(("float64", "float32"), ("strict", "fast"))
    keys = [{"precision": numbers, "floating_point": arithmetic} for numbers, arithmetic in ways]
    on_gpu = [_cell(run, variant=name, vector="off", **key) for name in ("numba-cuda", "cuda-cpp") for key in keys]
    for cell in [*(cell for key in keys for cell in _on_cores(run, **key)), *on_gpu]:
        key = {name: cell.parameters[name] for name in keys[0]}
        base = _cell(run, variant="cpp-threads", vector="off", **key)
        most = max(most, cell.steady.processes)
        here = cell in on_gpu
        rows.append(
            [
                ", ".join([cell.variant, *key.values(), *(["in lanes"] if cell.parameters["vector"] == "on" else [])]),
                _value(cell.steady, 1e3),
                _value(cell.median("kernel_s", ""), 1e3) if here else "",
                "1" if cell is base else quantity.plain(ranking.ratio(base, cell).value),
                _value(gpu.observed(run, cell, "power_w")) if here else "",
                _value(gpu.observed(run, cell, "joules_per_mray")) if here else "",
                accuracy_columns.shown_rmse(cell),
                cell.agreement,
            ]
        )
    faster = "times as fast as cpp-threads one ray after another"
    header = ["variant", "steady frame (ms)", "kernel (ms)", faster, "power of the GPU (W)"]
    table = _table([*header, "energy (J a million rays)", "RMSE", "agrees"], rows)
    note = NO_INTERVAL.format(most)
    if not any(cell.parameters["vector"] == "on" for cell in _on_cores(run)):
        gains_ = " and ".join(f"{quantity.text(_lanes_of_threads(one))} in {one}" for one in reversed(PRECISIONS))
        note += f" The cores trace one ray after another here; in lanes, which this run lacks, C++ on all of two cores of another machine takes {gains_} of that time on the same picture ([lanes.toml](../experiments/lanes.toml))."  # noqa: E501
    return f"{table}\n\n{note}"


def gpu_memories() -> str:
    """Times of the kernel by the memory that holds the scene."""
    run = _run(GPU, "launch-memory")
    rows, most = [], 0
    places = list(itertools.product(("global", "constant", "shared"), ("numba-cuda", "cuda-cpp")))
    for scene, numbers in itertools.product(run.scenes, ("float64", "float32")):
        row = [f"{Path(scene).stem}, {numbers}"]
        for memory, name in places:
            cell = _cell(run, scene=scene, variant=name, precision=numbers, scene_memory=memory)
            found = cell.median("kernel_s", "")
            most = max(most, getattr(found, "processes", 0))
            row.append(cell.status if isinstance(found, Missing) else _value(found, 1e3))
        rows.append(row)
    table = _table(["scene", *(f"{memory}, {name}" for memory, name in places)], rows)
    return f"{table}\n\nTime of the kernel in ms. {NO_INTERVAL.format(most)}"


def gpu_blocks() -> str:
    """Times of the kernel by the shape of a block, at one thread for each pixel."""
    run = _run(GPU, "launch-blocks")
    names, rows, most = ("numba-cuda", "cuda-cpp"), [], 0
    for width, height in sorted({(cell.swept["block_width"], cell.swept["block_height"]) for cell in run.cells}):
        cells = [_cell(run, variant=name, block_width=width, block_height=height) for name in names]
        found = [cell.median("kernel_s", "") for cell in cells]
        most = max(most, *(one.processes for one in found))
        rows.append([f"{width} × {height}", str(width * height), *(_value(one, 1e3) for one in found)])
    rows.sort(key=lambda row: int(row[1]))
    return f"{_table(['block', 'threads', *names], rows)}\n\nTime of the kernel in ms. {NO_INTERVAL.format(most)}"


def gpu_threads() -> str:
    """Times of the kernel of numba-cuda by the number of all threads."""
    run = _run(GPU, "launch-threads")
    blocks, rows, most = ((8, 4), (8, 8)), [], 0
    for count in sorted({cell.swept["total_threads"] for cell in run.cells}):
        row = [str(count)]
        for width, height in blocks:
            cell = _cell(run, variant="numba-cuda", total_threads=count, block_width=width, block_height=height)
            found = cell.median("kernel_s", "")
            most = max(most, found.processes)
            row.append(_value(found, 1e3))
        rows.append(row)
    table = _table(["threads in all", *(f"in blocks of {width} × {height}" for width, height in blocks)], rows)
    return f"{table}\n\nTime of the kernel of `numba-cuda` in ms. {NO_INTERVAL.format(most)}"


def gpu_waits() -> str:
    """Times of a frame, and the processor's use meanwhile, by what a thread does until the GPU is done."""
    rows = []
    with _opened(GPU, "gpu-wait") as run:
        for name, wait in itertools.product(("numba-cuda", "cuda-cpp"), ("spin", "yield", "block")):
            cell = _cell(run, variant=name, gpu_wait=wait)
            record = run.records[cell.counting[0]]
            start, end = next(phase[1:] for phase in record["phases"] if phase[0] == "render")
            t, percent = cpu_figure.rates(run.folder / record["series"])
            within = (t[:-1] >= start) & (t[1:] <= end)
            use = quantity.plain(float(np.median(percent[within])))
            rows.append([f"{name}, {wait}", _value(cell.steady, 1e3), _value(cell.median("kernel_s", ""), 1e3), use])
    table = _table(
        ["variant, gpu_wait", "steady frame (ms)", "kernel (ms)", "processor's use meanwhile (% of a core)"], rows
    )
    return f"{table}\n\nOne process each, too few for intervals."


def _value(value: Estimate | Missing | float, scale: float = 1.0) -> str:
    """Returns a number alone, where a note below the table says how many processes it is of."""
    return str(value) if isinstance(value, Missing) else quantity.plain(scale * getattr(value, "value", value))


KERNELS = ROOT / "results" / "reference" / "kernels.json"


def kernels() -> str:
    """Registers, spilled bytes and occupancy of the kernels in the file that docs/kernels.py writes."""
    stored = json.loads(KERNELS.read_text("utf-8"))
    rows = stored["kernels"]
    columns = list(dict.fromkeys(_compiled(row) for row in rows))
    lines: dict[tuple[str, str], dict[str, str]] = {}
    for row in rows:
        lines.setdefault((row["case"], row["precision"]), {})[_compiled(row)] = _taken(row)
    table = [[*line, *(cells[column] for column in columns)] for line, cells in lines.items()]
    mixed = sum(row["precision"] == "float32" and row["float64_instructions"] > 0 for row in rows)
    told = f"Registers of a thread, and occupancy in blocks of {rows[0]['block']}. "
    told += "" if any(map(_spilled, rows)) else "Nothing is spilled. "
    told += f"{mixed or 'No'} float32 kernels have"
    told += f" instructions of float64. Constant memory of {rows[0]['case']}: {_constants(rows)}."
    versions = ", ".join(f"{name} {version}" for name, version in stored["versions"].items())
    return f"{_table(['scene', 'precision', *columns], table)}\n\n{told} Compiled with {versions}."


def _compiled(row: dict) -> str:
    return f"{row['variant']}, {row['target']}"


def _taken(row: dict) -> str:
    spilled = f", {_spilled(row)} B spilled" if _spilled(row) else ""
    return f"{row['registers']}, {100 * row['occupancy']:.0f} %{spilled}"


def _spilled(row: dict) -> int:
    return row["spill_store_bytes"] + row["spill_load_bytes"]


def _constants(rows: list[dict]) -> str:
    of_case = [row for row in rows if row["case"] == rows[0]["case"]]
    taken = {(row["variant"], row["precision"]): row["constant_bytes"] for row in of_case}  # of all targets alike
    return ", ".join(f"{size} bytes of `{variant}` in {precision}" for (variant, precision), size in taken.items())


TABLES: dict[str, Callable[[], str]] = {
    "gains": gains,
    "lanes": lanes(*_against_off("on"), *NUMBA_OVER_CPP),
    "lanes-auto": lanes(*_against_off("auto")),
    "roofline": roofline,
    "times": times,
    "fast": fast,
    "crossings": crossings,
    "hierarchies": hierarchies,
    "balls": balls,
    "peers": peers,
    "threads": threads,
    "naive": naive,
    "first-hits": first_hits,
    "mesh-pictures": mesh_pictures,
    "equation": equation,
    "cutoffs": cutoffs,
    "slopes": slopes,
    "growth": growth,
    **{f"fails-{name}": failing(name) for name in FAILING},
    "pixel-bytes": pixel_bytes,
    "findings": findings,
    "gpu": gpu_times,
    "gpu-memories": gpu_memories,
    "gpu-waits": gpu_waits,
    "gpu-blocks": gpu_blocks,
    "gpu-threads": gpu_threads,
    "kernels": kernels,
    "worth-errors": worth("error (255ths) without", None, _steps),
    "worth-times": worth("time ÷ the whole scene's, without", "1", _time),
}


def page(text: str) -> str:
    """Returns the text of a page with its tables made again."""
    return MARK.sub(lambda found: f"{found[1]}{TABLES[found['name']]()}\n{found[3]}", text)


if __name__ == "__main__":
    to = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT
    for name in PAGES:
        (to / name).parent.mkdir(parents=True, exist_ok=True)
        (to / name).write_text(page((ROOT / name).read_text("utf-8")), encoding="utf-8")
