"""Parses the fields of scene text: numbers, vectors, materials. Errors name line and column."""

import re
from typing import NamedTuple

from harness.errors import UserError
from harness.scene import check
from harness.scene.model import Material
from harness.scene.tokens import tokens

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
_COUNT = re.compile(r"\d{1,9}", re.ASCII)
_LONGEST = 1000  # characters of a path, at most


class Range(NamedTuple):
    low: float
    high: float
    words: str


ANY = Range(-check.LARGEST, check.LARGEST, f"a number of at most {check.LARGEST:g} in size")
POSITIVE = Range(check.SMALLEST, check.LARGEST, f"a number from {check.SMALLEST:g} to {check.LARGEST:g}")
NOT_NEGATIVE = Range(0, check.LARGEST, f"a number from 0 to {check.LARGEST:g}")
FRACTION = Range(0, 1, "a number from 0 to 1")


class Fields:
    """Takes one token after another; `self.token` is the next one. UserError, with its place, for a faulty one."""

    def __init__(self, text, file):
        self.file = file
        self.tokens = tokens(text)
        self.token = next(self.tokens)
        if not self.token.text:
            raise self.error("the file is empty", self.token)

    def take(self):
        """The next token, which is consumed, except at the end of the file."""
        token = self.token
        if token.text:
            self.token = next(self.tokens)
        return token

    def numeric(self):
        """Whether the next token is meant as a number, valid or not."""
        text = self.token.text
        return bool(text[:1] in tuple("+-.0123456789") or _NOT_FINITE.fullmatch(text))

    def number(self, name, within=ANY):
        """A number. name: what errors call it."""
        token = self.take()
        if not _NUMBER.fullmatch(token.text):
            kind = "a finite number" if _NOT_FINITE.fullmatch(token.text) else "a number"
            raise self.error(f"expected {kind} for {name}, found {token}", token)
        value = float(token.text)
        if not within.low <= value <= within.high:
            raise self.error(f"expected {within.words} for {name}, found {token}", token)
        return value

    def count(self):
        """A number of vertices."""
        token = self.take()
        if not _COUNT.fullmatch(token.text) or int(token.text) < 3:
            raise self.error(f"expected a whole number of vertices, 3 or more, found {token}", token)
        return int(token.text)

    def vector(self, name, within=ANY):
        """Three numbers (x,y,z)."""
        if self.token.text != "(":
            raise self.error(f"expected a vector (x,y,z) for {name}, found {self.token}", self.token)
        numbers = []
        for _ in range(3):
            self.mark("," if numbers else "(", name)
            numbers.append(self.number(name, within))
        self.mark(")", name)
        return tuple(numbers)

    def vectors(self, names):
        """The vectors with these names, and the first token of each."""
        vectors, places = [], []
        for name in names:
            places.append(self.token)
            vectors.append(self.vector(name))
        return tuple(vectors), places

    def mark(self, mark, name):
        """Consumes a parenthesis or comma."""
        token = self.take()
        if token.text != mark:
            raise self.error(f'expected "{mark}" in the vector for {name}, found {token}', token)

    def path(self, name):
        """A word, or words between quotes, without them; and its token."""
        token = self.take()
        if token.text in ("", "(", ")", ","):
            raise self.error(f"expected {name}, found {token}", token)
        if len(token.text) > _LONGEST:
            raise self.error(f"expected {name} of at most {_LONGEST} characters, found {token}", token)
        if not token.text.startswith('"'):
            return token.text, token
        if len(token.text) < 3 or not token.text.endswith('"'):
            remedy = 'close it with " on the same line'
            raise self.error(f"expected {name} between quotes, found {token}", token, remedy)
        return token.text[1:-1], token

    def colour(self):
        return self.vector("the colour", NOT_NEGATIVE)

    def material(self):
        diffuse = self.vector("the diffuse colour", NOT_NEGATIVE)
        k_s = self.number("k_s", NOT_NEGATIVE)
        exponent = self.number("the exponent", NOT_NEGATIVE)
        attenuation = self.vector("the attenuation", FRACTION)
        eps_r = self.number("eps_r", POSITIVE)
        mu_r = self.number("mu_r", POSITIVE)
        roughness = self.roughness() if self.numeric() else 0.0
        return Material(diffuse, k_s, exponent, attenuation, eps_r, mu_r, roughness)

    def roughness(self):
        token = self.token
        value = self.number("the roughness")
        if value == 0 or check.SMOOTHEST <= value <= 1:
            return value
        wanted = f"expected 0 or a number from {check.SMOOTHEST:g} to 1 for the roughness, found {token}"
        lobe = "0 is a perfect mirror; a glossy lobe of the exponent m has the roughness sqrt(2 / (m + 2)), GLO-2"
        raise self.error(wanted, token, lobe)

    def blame(self, fault, places):
        """Raises a `check.Fault`, if there is one. places: the token of each vector."""
        if fault:
            raise self.error(fault.text, places[fault.index], fault.remedy)

    def error(self, message, token, remedy=None):
        return UserError(message, file=self.file, line=token.line, column=token.column, remedy=remedy)
