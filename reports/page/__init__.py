"""Writes report.html: the report as one offline page with interactive charts."""

import base64
import hashlib
from pathlib import Path

import orjson
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from harness.errors import UserError
from reports.page import chart, comparer, sections, series, sweep_chart
from reports.page.embedded import Embedded
from reports.run.results import Results

NAME = "report.html"
LIMIT = 8_000_000  # bytes of the page
TAGS = 20_000  # of them for HTML tags around figures
ROOM = 1_300_000  # of them for pictures to compare and of points; figures get the rest

# Sections that come first, in this order, and those with something interactive.
FIRST = ("summary", "pareto_figure", "sweep_figure", "speedup", "overview", "pictures_figure", "cpu_figure")
TRIED = {"pareto_figure": chart, "pictures_figure": comparer, "cpu_figure": series, "sweep_figure": sweep_chart}


def write(results: Results, told: list[tuple[str, str]], out: Path) -> Path:
    """Writes report.html into the folder `out`, beside its figures; returns its path.

    told: sections, each (name of its module, Markdown).
    """
    pictures = Embedded(ROOM)
    data = {name: TRIED[name].data(results, pictures) for name, _ in told if name in TRIED}
    data = {name: found for name, found in data.items() if found}
    return _write(results.facts["title"], _lead(results), sorted(told, key=_place), data, pictures, out)


def write_plain(title: str, lead: str, told: list[tuple[str, str]], out: Path) -> Path:
    """Writes the same page without anything interactive, in the order of `told`. lead: a line below the title."""
    return _write(title, lead, told, {}, Embedded(0), out)


def _write(title: str, lead: str, told: list[tuple[str, str]], data: dict, pictures: Embedded, out: Path) -> Path:
    block = orjson.dumps({**data, "images": pictures.images}).decode().replace("<", "\\u003c")

    def made(figures: Embedded) -> str:
        return _made(title, lead, sections.of(told, out, figures), figures, data, block)

    path = out / NAME
    path.write_text(made(Embedded(LIMIT - TAGS - len(made(Embedded(0)).encode()))), encoding="utf-8")
    return path


def _made(title: str, lead: str, found: list[sections.Section], figures: Embedded, data: dict, block: str) -> str:
    """Returns the page. figures: the embedded ones. data: of interactive charts by the name of their section."""
    drawing, program = _drawing() if data else "", _source("page.js")
    made = Environment(
        loader=PackageLoader("reports.page", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
    ).get_template("page.html.jinja")  # fmt: skip
    return made.render(
        title=title,
        lead=lead,
        sections=found,
        data=data,
        left_out=figures.left_out,
        block=Markup(block),
        look=Markup(_source("page.css")),
        drawing=Markup(drawing),
        program=Markup(program),
        allowed=" ".join(map(_fingerprint, filter(None, (drawing, program)))),
    )


def _drawing() -> str:
    """Returns the script of plotly, which an installation packs (build.py). UserError where nothing is installed."""
    try:
        return _source("plotly.min.js")
    except FileNotFoundError as error:
        raise UserError(f"{error.filename}: no such file", remedy="install rayrace: pip install -e .") from None


def _source(name: str) -> str:
    return (Path(__file__).parent / name).read_text(encoding="utf-8")


def _place(told: tuple[str, str]) -> int:
    return FIRST.index(told[0]) if told[0] in FIRST else len(FIRST)


def _fingerprint(script: str) -> str:
    """Returns the hash by which the page's policy allows a script; the browser runs no other script."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def _lead(results: Results) -> str:
    """Returns a line on the run: variants, processes, processor and time."""
    facts, places = results.facts, len(results.places)
    counts = f"{len(results.variants)} variants, {len(results.records)} processes"
    many = f", {places} places" if places > 1 else ""
    return f"{counts}{many}; {facts['environment']['cpu']}; begun {facts['started'][:16].replace('T', ' ')} UTC"
