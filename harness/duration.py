"""Parses durations, sizes and shares, from files and the command line: "50 ms", "10 min", "2 GB", "64 MiB", "2 %"."""

import re
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

UNITS = {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}
SIZES = {"B": 1, **{f"{letter}B": 1000**n for n, letter in enumerate("kMGT", 1)}}
SIZES |= {f"{letter}iB": 1024**n for n, letter in enumerate("KMGT", 1)}


def quantity(value: Any, units: dict, what: str, examples: str) -> Any:
    """The number that a text such as "50 ms" stands for; other values are returned unchanged.

    units: factors by name; what, examples: for the message. ValueError for another text.
    """
    if isinstance(value, str):
        match = re.fullmatch(r"\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*([a-zA-Z]+)\s*", value)
        if not match or match[2] not in units:
            raise ValueError(f'expected a {what} such as {examples}, found "{value}"')
        return float(match[1]) * units[match[2]]
    return value


def duration(value: Any) -> Any:
    """Seconds from "50 ms", "10 min" or a plain number of seconds."""
    return quantity(value, UNITS, "time", '"50 ms", "30 s", "10 min" or "2 h"')


def size(value: Any) -> Any:
    """Bytes from "2 GB", "64 MiB" or a plain number of bytes."""
    number = quantity(value, SIZES, "size", '"500 kB", "64 MiB" or "2 GB"')
    return round(number) if isinstance(number, float) and number.is_integer() else number


def share(value: Any) -> Any:
    """A share from "2 %" or "2%"; a number alone is refused, as it may be of either."""
    match = re.fullmatch(r"\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*%\s*", value) if isinstance(value, str) else None
    if match:
        return float(match[1]) / 100
    if value is None:
        return value
    raise ValueError(f'expected per cent such as "2 %", found {value!r}')


Seconds = Annotated[float, BeforeValidator(duration), Field(gt=0, allow_inf_nan=False)]
Share = Annotated[float, BeforeValidator(share), Field(gt=0, lt=1)]
Bytes = Annotated[int, BeforeValidator(size), Field(gt=0, lt=2**63)]
