"""The type of number that everything is computed in (NUM-1).

`float64` is the machine's float; `mp60` is mpmath with 60 decimal digits (any number of digits from 16 up will do),
which turns this renderer into an oracle for spot pixels and rays.
"""

import math
from typing import Any, NamedTuple


class Number(NamedTuple):
    real: Any  # makes a number from a float
    sqrt: Any


def number(precision):
    """The Number that the job's `precision` names; ValueError if it names none."""
    if precision == "float64":
        return Number(float, math.sqrt)
    if precision.startswith("mp") and precision[2:].isdigit() and int(precision[2:]) >= 16:
        import mpmath

        mpmath.mp.dps = int(precision[2:])
        return Number(mpmath.mpf, mpmath.sqrt)
    raise ValueError(f'no precision "{precision}": float64 or mp60 (mpmath, any number of digits from 16)')
