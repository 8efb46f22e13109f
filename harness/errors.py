"""Defines errors that the user can correct, and makes messages safe to print."""

LINES, LINE = 20, 1000  # lines of a message, and characters of a line, at most: input can have any number of faults


class UserError(Exception):
    """A fault in the user's input. Only `str()` of it is printed.

    file, line, column: its place, the last two from 1; remedy: what to do. Each may be left out:

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


class Failure(Exception):
    """What was asked for failed, by no fault of the input. output: what the failed program said, "" if nothing."""

    def __init__(self, message: str, output: str = ""):
        super().__init__(message)
        self.output = output


def missing(what: str, extra: str) -> UserError:
    """The error for an optional package that is not installed. extra: rayrace's extra that includes it."""
    return UserError(f"{what} is not installed", remedy=f"pip install 'rayrace[{extra}]'")


def fit(text: str) -> str:
    """`text` for a terminal: unprintable characters are escaped, and long lines and texts are cut."""
    lines = text.split("\n")
    more = [f"and {len(lines) - LINES} more"] if len(lines) > LINES else []
    short = (line if len(line) <= LINE else line[:LINE] + " ..." for line in lines[:LINES])
    return "\n".join(map(printable, (*short, *more)))


def printable(text: str) -> str:
    """`text` with escapes for unprintable characters, which could control a terminal."""
    if text.isprintable():
        return text
    return "".join(letter if letter.isprintable() else letter.encode("unicode_escape").decode() for letter in text)


def of_system(error: OSError, place="system") -> str:
    """The message of an OSError. place: where it happened, if the error names no file."""
    return f"{error.filename or place}: {error.strerror or error}"
