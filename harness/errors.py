"""Errors that the user can mend, and how messages are made safe to print."""

LINES, LINE = 20, 1000  # of a message, and characters of one: what was given may say any number of things wrongly


class UserError(Exception):
    """A fault in what the user gave. `str()` of it is all that is printed.

    `file`, `line` and `column` (both from 1) say where, `remedy` what to do about it; each may be left out:

        scenes/a.txt:12:7: expected a number for the radius, found "abc"
        scenes/a.txt:3:1: unknown keyword "SHPERE"; did you mean SPHERE?
    """

    def __init__(self, message, *, file=None, line=None, column=None, remedy=None):
        super().__init__(message)
        self.message = message
        self.file = file
        self.line = line
        self.column = column
        self.remedy = remedy

    def __str__(self):
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part is not None)
        text = f"{place}: {self.message}" if place else self.message
        return fit(f"{text}; {self.remedy}" if self.remedy else text)


def missing(what: str, extra: str) -> UserError:
    """The error of a package that only some need, which is not installed. extra: that of rayrace which brings it."""
    return UserError(f"{what} is not installed", remedy=f"pip install 'rayrace[{extra}]'")


def fit(text: str) -> str:
    """`text` as a terminal can show it and a person read it: what is not printable is escaped, what is too long cut."""
    lines = text.split("\n")
    more = [f"and {len(lines) - LINES} more"] if len(lines) > LINES else []
    short = (line if len(line) <= LINE else line[:LINE] + " ..." for line in lines[:LINES])
    return "\n".join(map(printable, (*short, *more)))


def printable(text: str) -> str:
    """`text` with escapes for what would do something to a terminal, or cannot be printed."""
    if text.isprintable():
        return text
    return "".join(letter if letter.isprintable() else letter.encode("unicode_escape").decode() for letter in text)


def of_system(error: OSError, place="system") -> str:
    """Returns the message of an OSError. place: where it happened, if the error does not say."""
    return f"{error.filename or place}: {error.strerror or error}"
