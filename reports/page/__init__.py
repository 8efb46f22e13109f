"""Writes report.html: the report as one offline page with interactive charts."""

import base64
import hashlib
from pathlib import Path

import orjson
from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup

from harness.errors import UserError
from harness.system import output
from reports.chart import chart, comparer, series, sweep_chart
from reports.chart.embedded import Embedded
from reports.page import sections
from reports.page.card import Card
from reports.run.results import Results
from reports.summary import glance

NAME = "report.html"
LIMIT = 8_000_000  # bytes of the page
TAGS = 20_000  # of them for HTML tags around figures
SEEN = 400_000  # of them for pictures of the first screen
ROOM = 1_300_000  # of them for pictures to compare and of points; figures get the rest

# Sections that come first, in this order, and those with something interactive.
FIRST = ("summary", "pareto_figure", "sweep_figure", "speedup", "overview", "pictures_figure", "cpu_figure")
GLANCE = "glance"  # the section that the first screen shows
TRIED = {"pareto_figure": chart, "pictures_figure": comparer, "cpu_figure": series, "sweep_figure": sweep_chart}


def write(results: Results, parts: list[tuple[str, str]], out: Path) -> Path:
    """Writes report.html into the folder `out`, beside its figures; returns its path.

    parts: sections, each (name of its module, Markdown).
    """
    pictures, seen = Embedded(ROOM), Embedded(SEEN)
    first = {**glance.data(results, seen), "images": seen.images}
    parts = [(name, text) for name, text in parts if name != GLANCE]
    data = {name: TRIED[name].data(results, pictures) for name, _ in parts if name in TRIED}
    data = {name: values for name, values in data.items() if values}
    shown = {"title": results.facts["title"], "lead": _lead(results), "glance": first, "data": data}
    return _write(shown, sorted(parts, key=_place), out / NAME, pictures.images)


def write_several(
    title: str, lead: str, parts: list[tuple[str, str]], cards: list[tuple[Card, str]], path: Path
) -> Path:
    """Writes a page of several runs to `path`, without anything interactive, with sections in the order of `parts`.

    lead: a line below the title. cards: of the runs, each with the address of its report.
    """
    return _write({"title": title, "lead": lead, "cards": cards}, parts, path, {})


def _write(shown: dict, parts: list[tuple[str, str]], path: Path, images: dict[str, str]) -> Path:
    """Writes a page. shown: values of the template. images: addresses of pictures that the script shows, by key."""
    shown = {"glance": None, "cards": None, "data": {}, **shown}
    block = orjson.dumps({**shown["data"], "images": images}).decode().replace("<", "\\u003c")
    drawing, program = _drawing() if shown["data"] else "", _source("page.js")

    def made(figures: Embedded) -> str:
        page_sections = sections.of(parts, path.parent, figures)
        return _template().render(
            **shown,
            sections=page_sections,
            anchors={section.name: section.anchor for section in reversed(page_sections)},
            titles={section.name: section.title for section in reversed(page_sections)},
            left_out=figures.left_out,
            block=Markup(block),
            look=Markup(_source("page.css")),
            drawing=Markup(drawing),
            program=Markup(program),
            allowed=" ".join(map(_fingerprint, filter(None, (drawing, program)))),
        )

    room = LIMIT - TAGS - len(made(Embedded(0)).encode())
    output.text(path, made(Embedded(room, inline=True)))
    return path


def _template() -> Template:
    return Environment(
        loader=PackageLoader("reports", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
    ).get_template("page/page.html.jinja")  # fmt: skip


def _drawing() -> str:
    """Returns the script of plotly, which an installation packs (build.py). UserError where nothing is installed."""
    try:
        return _source("plotly.min.js")
    except FileNotFoundError as error:
        raise UserError(f"{error.filename}: no such file", remedy="install rayrace: pip install -e .") from None


def _source(name: str) -> str:
    return (Path(__file__).parent / name).read_text(encoding="utf-8")


def _place(part: tuple[str, str]) -> int:
    return FIRST.index(part[0]) if part[0] in FIRST else len(FIRST)


def _fingerprint(script: str) -> str:
    """Returns the hash by which the page's policy allows a script; the browser runs no other script."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def _lead(results: Results) -> str:
    """Returns a line on the run: renderers, configurations (a scene with its swept values), processes and time."""
    facts, places = results.facts, len(results.places)
    counted = (len(results.variants), "renderer"), (places, "configuration"), (len(results.records), "process")
    plural = {"process": "processes"}
    counts = [f"{count} {word if count == 1 else plural.get(word, word + 's')}" for count, word in counted]
    return f"{', '.join(counts)}; begun {facts['started'][:16].replace('T', ' ')} UTC"
