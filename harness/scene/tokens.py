"""Splits text into tokens."""

import io
import re
from typing import NamedTuple

_TOKEN = re.compile(r'#.*|"[^"\n]*"|[(),]|[^\s(),]+')


class Token(NamedTuple):
    """A token with its place; `line` and `column` count from 1, in characters. The end of the file has no text."""

    text: str
    line: int
    column: int

    def __str__(self):
        if not self.text:
            return "the end of the file"
        text = self.text if len(self.text) <= 40 else self.text[:37] + "..."
        return f'"{text}"' if text.isprintable() else ascii(text)


def tokens(text):
    """Yields the tokens of `text`, then the end of the file, directly after the last one.

    Whitespace separates tokens, except between quotes; `(`, `)` and `,` are tokens of their own; `#` at the start of a
    token begins a comment.
    """
    line, column = 1, 1
    for number, content in enumerate(io.StringIO(text, newline=None), 1):
        for match in _TOKEN.finditer(content):
            if not match[0].startswith("#"):
                yield Token(match[0], number, match.start() + 1)
                line, column = number, match.end() + 1
    yield Token("", line, column)
