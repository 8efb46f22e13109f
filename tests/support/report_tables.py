"""Reads the tables of a report back: with what is the same in all rows, and with reasons in place of their marks."""

import re

SAME = "The same in all rows: "
NOTE = re.compile(r"\(([a-z]\d*)\) (.*?)(?:; (?=\([a-z]\d*\) )|\.$)")


def tables(text: str) -> list[list[dict[str, str]]]:
    """Returns the tables of a Markdown text, each as rows by title of the column."""
    parts = [part for part in text.split("\n\n") if part.strip()]
    return [
        _table(part, parts[place - 1], parts[place + 1] if place + 1 < len(parts) else "")
        for place, part in enumerate(parts)
        if part.lstrip().startswith("|")
    ]


def _table(part: str, above: str, below: str) -> list[dict[str, str]]:
    header, _, *rows = [
        [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in part.strip().splitlines()
    ]
    same = above.removeprefix(SAME).removesuffix(".").split("; ") if above.startswith(SAME) else []
    known = dict(pair.split(": ", 1) for pair in same)
    notes = dict(NOTE.findall(below)) if below.startswith("(a) ") else {}
    return [{**known, **{title: _full(cell, notes) for title, cell in zip(header, row, strict=True)}} for row in rows]


def _full(cell: str, notes: dict[str, str]) -> str:
    found = re.fullmatch(r"(.*) \(([a-z]\d*)\)(.*)", cell)
    if found is None or found[2] not in notes:
        return cell
    before, mark, after = found.groups()
    reason = notes[mark]
    if reason.startswith("no interval"):
        return f"{before} ({reason}){after}"
    return f"{before}, but {reason}" if before == "ok" else f"{before}: {reason}"
