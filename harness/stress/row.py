"""Defines a row of the catalogue of failures: its inputs by level of stress, and where theory says a method breaks."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from harness.process import repetition
from harness.scene.model import Scene

ROUNDOFF = {"float32": 2.0**-24, "float64": 2.0**-53}  # u of NUM-2


@dataclass(frozen=True)
class Finding:
    """The verdict on a result.

    count: how many answers (rays, pixels, bytes) were judged. failures: how many are wrong; NaN is wrong. errors: the
    finite ones, in the row's unit.
    """

    count: int
    failures: int
    errors: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def record(self) -> dict:
        """For JSON; the errors are null if no answer has one."""
        errors = np.sort(self.errors)
        of = (lambda share: float(errors[int(share * (len(errors) - 1))])) if len(errors) else lambda _: None
        counts = {"count": int(self.count), "failures": int(self.failures)}
        return {**counts, "error_median": of(0.5), "error_p99": of(0.99), "error_max": of(1.0)}


@dataclass(frozen=True)
class Trial:
    """The inputs at one level of stress, already numbers of the precision, so that rounding them changes nothing.

    rays: float64 (R, 6) for a job of kind rays; None: the job makes a picture. parameters: values of [image] that the
    level needs. judge: called with the Result of a repetition that is ok; returns its Finding.
    """

    scene: Scene
    judge: Callable[[repetition.Result], Finding]
    rays: np.ndarray | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Row:
    """A row of the catalogue. name: in files and experiments. code: in the catalogue of docs/, S1 to S28.

    stress, failure, error: say in words what the level is, what counts as a failure, and the unit of errors ("" if the
    row has no errors). levels: from mild to extreme. logarithmic: whether charts have a logarithmic axis of levels.
    method: the key of [image] whose values are the naive and robust methods for this row, or "". aligned: the name of
    the row in general position whose axis-aligned twin this is, or "". make(level, precision, rng): returns the Trial,
    which is the same for all renderers and methods. expected(level, u, methods): the error that theory predicts, or
    None. limit(u, methods): the level at which a method breaks by theory, or None. u: unit roundoff (NUM-2); methods:
    the job's parameters by name. source: the literature.
    """

    name: str
    code: str
    title: str
    stress: str
    failure: str
    levels: tuple[float, ...]
    make: Callable[[float, str, np.random.Generator], Trial]
    error: str = ""
    logarithmic: bool = True
    method: str = ""
    aligned: str = ""
    source: str = ""
    expected: Callable[[float, float, Mapping[str, Any]], float | None] = lambda *_: None
    limit: Callable[[float, Mapping[str, Any]], float | None] = lambda *_: None

    def facts(self) -> dict:
        """For run.json: what a report says about the row."""
        names = ("code", "title", "stress", "failure", "error", "logarithmic", "method", "aligned", "source")
        return {name: getattr(self, name) for name in names}


def within(off: np.ndarray, allowed) -> Finding:
    """The Finding for errors `off`; a failure is NaN, or above `allowed`, which is a number or an array like `off`."""
    return Finding(off.size, int((~(off <= allowed)).sum()), off[np.isfinite(off)])


def rounded(values, precision: str) -> np.ndarray:
    """`values` rounded to `precision`, as float64."""
    values = np.asarray(values, dtype=np.float64)
    return values.astype(np.float32).astype(np.float64) if precision == "float32" else values


def in_general_position(rng: np.random.Generator) -> np.ndarray:
    """A random rotation (3, 3), uniform (Haar): nothing lies along an axis."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def directions(rng: np.random.Generator, count: int) -> np.ndarray:
    """Unit vectors (count, 3), uniform on the sphere."""
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
