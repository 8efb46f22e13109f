"""Writes Markdown. Foreign text (names, reasons, commands) is always escaped, inside tables and outside."""

import hashlib
import html
import re

from reports.paper import compact

LONGEST = 100  # characters of a name; a file system has room for 255 bytes, and a figure's name has more than one part
UNAVAILABLE = r"## (?P<title>[^\n]+)\n\nunavailable: (?P<reason>[^\n]+)\n*"  # matches a section of `unavailable`


class Ready(str):
    """Text that is Markdown already: a table takes it as it is."""


def escape(text: object) -> str:
    """Returns text, on one line, that Markdown and HTML show unchanged."""
    flat = " ".join(html.escape(str(text), quote=False).split())
    return re.sub(r"([\\`*_\[\]|~$])", r"\\\1", flat)


def code(text: str) -> Ready:
    """Returns a command as code in a cell of a table."""
    fence = "`" * (1 + max((len(run) for run in text.replace("`", " `").split() if set(run) == {"`"}), default=0))
    pad = " " * ("`" in text)
    return Ready(f"{fence}{pad}{text}{pad}{fence}".replace("|", "\\|"))


def table(header: list[str], rows: list[list[str]]) -> str:
    """Returns a table; cells are plain text, which is escaped, or `Ready`.

    Above it stand the columns that have one text in all rows, below it the reasons that cells point at.
    """
    left_out = compact.same(header, rows)
    above = "; ".join(f"{escape(header[column])}: {_cell(text)}" for column, text in left_out.items())
    header, *rows = (
        [text for column, text in enumerate(line) if column not in left_out] for line in [list(header), *rows]
    )
    rows, notes = compact.with_notes(header, rows)
    lines = [map(escape, header), ["---"] * len(header), *(map(_cell, row) for row in rows)]
    below = "; ".join(f"({mark}) {escape(reason)}" for mark, reason in notes)
    parts = [f"The same in all rows: {above}."] if above else []
    parts.append("\n".join(f"| {' | '.join(line)} |" for line in lines))
    return "\n\n".join(parts + [f"{below}."] * bool(below))


def _cell(text: str) -> str:
    return text if isinstance(text, Ready) else escape(text)


def unavailable(title: str, reason: str) -> str:
    """Returns a section that has only a reason; a report says all of these in one place."""
    return f"## {escape(title)}\n\nunavailable: {escape(reason)}"


def bullets(items: list[str]) -> str:
    """Returns a list of items that are Markdown already."""
    return "\n".join(f"- {item}" for item in items)


def listed(heading: str, items: list[str]) -> list[str]:
    """Returns a line of heading and a list of plain texts, as two parts of a section; [] without items."""
    return [heading, bullets(list(map(escape, items)))] if items else []


def figure(name: str, alt: str) -> str:
    """Returns a picture that lies beside the report, with a link to its vector drawing."""
    return f"![{escape(alt)}]({name}.png)\n\n[{name}.svg]({name}.svg)"


def slug(text: str) -> str:
    """Returns a file name made of `text`: a-z, 0-9 and hyphens; of a long text its beginning and a hash of it."""
    name = re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-") or "unnamed"
    if len(name) <= LONGEST:
        return name
    return f"{name[: LONGEST - 9]}-{hashlib.sha256(text.encode('utf-8', 'replace')).hexdigest()[:8]}"
