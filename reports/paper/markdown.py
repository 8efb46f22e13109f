"""Writes Markdown. Text of others (names, reasons, commands) is always escaped, in tables and out of them."""

import html
import re


def escape(text: object) -> str:
    """Text that Markdown and HTML show as it is, on one line."""
    flat = " ".join(html.escape(str(text), quote=False).split())
    return re.sub(r"([\\`*_\[\]|~$])", r"\\\1", flat)


def table(header: list[str], rows: list[list[str]]) -> str:
    """A table of plain text; every cell is escaped."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(
        "| " + " | ".join(cell if cell == "---" else escape(cell) for cell in line) + " |" for line in lines
    )


def bullets(items: list[str]) -> str:
    """A list of items that are Markdown already."""
    return "\n".join(f"- {item}" for item in items)


def figure(name: str, alt: str) -> str:
    """A picture beside the report, with a link to its drawing without pixels."""
    return f"![{escape(alt)}]({name}.png)\n\n[{name}.svg]({name}.svg)"


def slug(text: str) -> str:
    """A file name made of `text`: a-z, 0-9 and hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-") or "unnamed"
