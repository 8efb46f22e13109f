"""Cleans what is read of a stored run, which may be a stranger's: the gate that all its texts pass.

A control character could steer a terminal, and no XML may contain one; values within values without end would exhaust
the stack of whoever walks them.
"""

import re

import orjson

from harness.errors import UserError

DEEPEST = 50  # values within values
# Bytes that a value takes in memory at least, by the bytes of JSON that begin or separate values.
WEIGHTS = {b",": 32, b"[": 64, b"{": 240}
# C0 without tab and newline, DEL and C1, marks of direction, and what is no character of XML.
CONTROL = re.compile(
    "[\0-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufeff\ufffe\uffff]"
)
DOUBTFUL = re.compile(rb"\\[bfru]|[\x7f-\xff]")  # without these, JSON has no such character


def parsed(text: bytes):
    """Returns the value of a JSON text, cleaned. ValueError if it is no JSON, or values lie too deep in it."""
    value = orjson.loads(text)
    if text.count(b"[") + text.count(b"{") > DEEPEST or DOUBTFUL.search(text):
        value = cleaned(value)
    return value


def weight(text: bytes) -> int:
    """Estimates the bytes of memory that the values of a JSON text take."""
    return sum(weight * text.count(sign) for sign, weight in WEIGHTS.items())


def cleaned(value, deep: int = 0):
    """Returns a value of JSON with visible escapes in place of control characters, also in names.

    ValueError if values lie more than DEEPEST within each other.
    """
    if isinstance(value, str):
        return CONTROL.sub(_escaped, value)
    if not isinstance(value, list | dict):
        return value
    if deep > DEEPEST:
        raise ValueError(f"values lie more than {DEEPEST} deep")
    if isinstance(value, list):
        return [cleaned(item, deep + 1) for item in value]
    return {CONTROL.sub(_escaped, name): cleaned(item, deep + 1) for name, item in value.items()}


def _escaped(match: re.Match) -> str:
    return match[0].encode("unicode_escape", "surrogatepass").decode()


def refuse_heavy(text: bytes, most: int, place) -> None:
    """UserError if the values of a JSON text would take more than `most` bytes of memory."""
    if weight(text) > most:
        raise UserError(f"{place}: more values than rayrace reads", remedy="it is damaged, or not a run of rayrace")
