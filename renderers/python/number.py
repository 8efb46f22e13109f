"""The type of number that everything is computed in (NUM-1).

`float64` is the machine's float; `mp60` is mpmath with 60 decimal digits (any number of digits from 16 up will do),
which turns this renderer into an oracle for spot pixels and rays.
"""

import math
from typing import Any, NamedTuple


class Number(NamedTuple):
    real: Any  # makes a number from a float
    sqrt: Any
    cos: Any
    sin: Any
    log: Any
    expm1: Any
    pi: Any
    roundoff: Any  # u of NUM-2
    splitter: Any  # 2^⌈p/2⌉ + 1 for numbers of p bits, which cuts one in halves (exact.py)


def number(precision):
    """The Number that the job's `precision` names; ValueError if it names none."""
    if precision == "float64":
        functions = math.sqrt, math.cos, math.sin, math.log, math.expm1
        return Number(float, *functions, math.pi, 2.0**-53, 2.0**27 + 1)
    if precision.startswith("mp") and precision[2:].isdigit() and int(precision[2:]) >= 16:
        import mpmath

        digits = mpmath.mp.dps = int(precision[2:])
        roundoff = mpmath.mpf(10) ** (1 - digits) / 2
        splitter = mpmath.mpf(2) ** ((mpmath.mp.prec + 1) // 2) + 1
        functions = mpmath.sqrt, mpmath.cos, mpmath.sin, mpmath.log, mpmath.expm1
        return Number(mpmath.mpf, *functions, +mpmath.pi, roundoff, splitter)
    raise ValueError(f'no precision "{precision}": float64 or mp60 (mpmath, any number of digits from 16)')
