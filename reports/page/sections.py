"""Converts the Markdown of a report to HTML sections with anchors and embedded figures."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from markdown_it import MarkdownIt
from markdown_it.token import Token
from markupsafe import Markup, escape
from PIL import Image

from reports.chart.embedded import Embedded, smaller
from reports.page import drawing
from reports.paper import markdown

# Bytes of an SVG file; a larger one is embedded as pixels.
LARGEST_DRAWING, LARGEST_WITH_PICTURES = 700_000, 220_000
LONGEST = 1400  # pixels of such a figure
LONG, REST = 70, "How to read this, in full"  # words of a paragraph that is shown whole; what the rest is under
POINT = 96 / 72  # pixels of a page
LAST = "pictures_figure", "gallery_figure"  # modules whose figures get the room that all others leave


@dataclass(frozen=True)
class Section:
    """A section of the page.

    name: of the module that wrote it. anchor, title: of its heading. body: HTML without the heading.
    """

    name: str
    anchor: str
    title: str
    body: Markup


def of(parts: list[tuple[str, str]], folder: Path, figures: Embedded) -> list[Section]:
    """Returns the sections of pairs (name of a module, Markdown); text without a heading joins the section before.

    folder: of the figures. figures: they are added to it.
    """
    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    reader.add_render_rule("image", lambda self, tokens, n, *_: _image(tokens[n], folder, figures))
    reader.add_render_rule("table_open", lambda *_: '<div class="wide" tabindex="0"><table>\n')
    reader.add_render_rule("table_close", lambda *_: "</table></div>\n")
    pieces = [(name, title, body) for name, text in parts for title, body in _parts(text)]
    order = sorted(range(len(pieces)), key=lambda number: pieces[number][0] in LAST)
    rendered = {number: Markup(_html(reader, pieces[number][2])) for number in order}
    sections: list[Section] = []
    for number, (name, title, _) in enumerate(pieces):
        html = rendered[number]
        if title is None and sections:
            html, title = sections[-1].body + html, sections[-1].title
            sections[-1] = Section(sections[-1].name, sections[-1].anchor, title, html)
        else:
            anchor = f"s{len(sections)}-{markdown.slug(title or name)}"
            sections.append(Section(name, anchor, _plain(reader, title or name), html))
    return sections


def _html(reader: MarkdownIt, text: str) -> str:
    """Returns Markdown as HTML; of a paragraph with more than LONG words the first sentence, and the rest folded."""
    tokens = reader.parse(text)
    for number, token in enumerate(tokens):
        if token.type == "inline" and tokens[number - 1].type == "paragraph_open" and token.level == 1:
            first, _, rest = token.content.partition(". ")
            if rest and len(token.content.split()) > LONG:
                token.children = reader.parseInline(f"{first}.")[0].children
                folded = f"<details><summary>{REST}</summary><p>{reader.renderInline(rest)}</p></details>\n"
                tokens[number + 1] = Token("html_block", "", 0, content=f"</p>\n{folded}")
    return reader.renderer.render(tokens, reader.options, {})


def _parts(text: str) -> Iterator[tuple[str | None, str]]:
    """Splits a text at its headings of the second level into pairs (heading or None, text below it)."""
    pieces = re.split(r"^## (.*)$", text, flags=re.MULTILINE)
    if pieces[0].strip():
        yield None, pieces[0]
    yield from zip(pieces[1::2], pieces[2::2], strict=True)


def _plain(reader: MarkdownIt, title: str) -> str:
    """Returns a heading without its escapes."""
    (inline,) = (token for token in reader.parse(title) if token.type == "inline")
    return "".join(child.content for child in inline.children)


def _image(token, folder: Path, figures: Embedded) -> str:
    """Returns the HTML of a figure: its vector drawing, else its pixels, or a link to its file if neither fits."""
    name, alt = token.attrs["src"], "".join(child.content for child in token.children)
    embedded = None
    if figures.room > 0:
        embedded = _drawing((folder / name).with_suffix(".svg"), figures) or _pixels(folder / name, figures)
    if embedded is None:
        return f'<p class="note">Too large for this page: <a href="{escape(name)}">{escape(alt)}</a></p>'
    kind, key, (wide, high) = embedded
    return (
        f'<img class="{kind}" src="{figures.images[key]}" alt="{escape(alt)}" width="{wide}" height="{high}" '
        'loading="lazy" decoding="async">'
    )


def _drawing(path: Path, figures: Embedded) -> tuple[str, str, tuple[int, int]] | None:
    """Adds a vector drawing; returns its class, key and size. None without one, or if it is too large."""
    data = drawing.for_page(path.read_bytes()) if path.exists() else b""
    if not 0 < len(data) <= (LARGEST_WITH_PICTURES if b"<image" in data else LARGEST_DRAWING):
        return None
    key = figures.add(data, "image/svg+xml", counted=False)
    return ("figure", key, _size(data)) if key else None


def _pixels(path: Path, figures: Embedded) -> tuple[str, str, tuple[int, int]] | None:
    """Adds the pixels of a figure; returns the same."""
    with Image.open(path) as opened:
        made = smaller(np.asarray(opened.convert("RGB")), LONGEST)
    key = figures.add_pixels(made)
    return ("figure pixels", key, (made.shape[1], made.shape[0])) if key else None


def _size(svg: bytes) -> tuple[int, int]:
    """Returns width and height of a drawing, pixels of the page."""
    head = ElementTree.fromstring(svg)
    return tuple(round(float(head.get(side).removesuffix("pt")) * POINT) for side in ("width", "height"))
