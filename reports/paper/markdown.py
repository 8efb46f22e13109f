"""Writes Markdown. Foreign text (names, reasons, commands) is always escaped, inside tables and outside."""

import html
import re


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
    """Returns a table; cells are plain text, which is escaped, or `Ready`."""
    lines = [map(escape, header), ["---"] * len(header)]
    lines += [[cell if isinstance(cell, Ready) else escape(cell) for cell in row] for row in rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


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
    """Returns a file name made of `text`: a-z, 0-9 and hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-") or "unnamed"
