"""Makes a table of texts small: what is the same in all rows is said above it, reasons below it, each once."""

import re
from collections import Counter
from itertools import count
from string import ascii_lowercase

# A status with its reason: "unavailable: no driver", "ok, but 2 of 10 processes not: timeout".
REASONED = re.compile(
    r"(unavailable|unsupported|failed|timeout|killed|wrong picture|not run|ok)(?:: |, but |; )(.+)", re.DOTALL
)
NO_INTERVAL = re.compile(r"(.+) \((no interval, n = \d+)\)(.*)")
UNAVAILABLE = "unavailable"  # where the row has the reason elsewhere
FEW = 3  # columns: of things with a value, where a reason stands well beside its thing


def same(header: list[str], rows: list[list[str]]) -> dict[int, str]:
    """Returns the columns that have one text in all rows, with it; {} of fewer than two rows, or if all columns have.

    A column may be unavailable in rows without a result, which are so in most of their columns.
    """
    alive = [row for row in rows if 2 * row.count(UNAVAILABLE) < len(row)]
    if len(alive) < 2:
        return {}
    dead = [row for row in rows if row not in alive]
    shared = {
        column: alive[0][column]
        for column in range(len(header))
        if len({row[column] for row in alive}) == 1 and all(row[column] == UNAVAILABLE for row in dead)
    }
    return shared if len(shared) < len(header) else {}


def with_notes(header: list[str], rows: list[list[str]]) -> tuple[list[list[str]], list[tuple[str, str]]]:
    """Returns rows with a mark in place of each reason, and the notes, each (mark, reason).

    Reasons: why a value is unavailable, has no interval, or is doubtful. Of few columns only a reason that occurs twice
    becomes a note.
    """
    parts_by_text = {text: parts for row in rows for text in row if (parts := _parts(text))}
    often = Counter(parts_by_text[text][1] for row in rows for text in row if text in parts_by_text)
    marks: dict[str, str] = {}
    names = _marks()

    def short(text: str) -> str:
        if text not in parts_by_text or (len(header) <= FEW and often[parts_by_text[text][1]] < 2):
            return text
        before, reason, after = parts_by_text[text]
        if reason not in marks:
            marks[reason] = next(names)
        return f"{before} ({marks[reason]}){after}"

    made = [[short(text) for text in row] for row in rows]
    return made, [(mark, reason) for reason, mark in marks.items()]


def _parts(text: str) -> tuple[str, str, str] | None:
    """Returns a text as (what stays, reason, what follows); None if it has no reason."""
    if match := NO_INTERVAL.fullmatch(text):
        return match.groups()
    match = REASONED.fullmatch(text)
    return (*match.groups(), "") if match else None


def _marks():
    """Yields a, b, .., z, a2, b2, .."""
    for lap in count(1):
        yield from (letter if lap == 1 else f"{letter}{lap}" for letter in ascii_lowercase)
