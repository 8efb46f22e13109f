"""The error that is the user's to mend."""


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
        return f"{text}; {self.remedy}" if self.remedy else text
