"""The points of a sweep: combines swept values."""

import itertools
from collections.abc import Mapping
from typing import Any

from harness.experiment import ladder
from harness.experiment.experiment import Experiment


def points(experiment: Experiment) -> list[tuple[dict, int]]:
    """The swept values of every point, in the order of the file, and the number of the [[points]] table it is from."""
    if isinstance(experiment.sweep, dict):
        axes = [[{key: value} for value in values] for key, values in experiment.sweep.items()]
    else:
        axes = [_zipped(table) for table in experiment.sweep]
    tables = [(list(_product(table)), number) for number, table in enumerate(experiment.points)] or [([{}], 0)]
    if experiment.ladder:
        tables = [([point], number) for number, point in enumerate(rungs(experiment))]
    return [
        ({key: value for part in (own, *parts) for key, value in part.items()}, number)
        for some, number in tables
        for own, *parts in itertools.product(some, *axes)
    ]


def rungs(experiment: Experiment) -> list[dict]:
    """The swept values of every point of the ladders."""
    return ladder.points(experiment.ladder, experiment.image.model_dump())


def climbers(experiment: Experiment, table: int) -> set[str] | None:
    """The variants that have cells at the points of a table; None for all."""
    if not experiment.ladder:
        return None
    return ladder.climbers(experiment.ladder, experiment.image.model_dump(), rungs(experiment)[table])


def _zipped(table: dict) -> list[dict]:
    return [dict(zip(table, values, strict=True)) for values in zip(*table.values(), strict=True)]


def _product(table: dict):
    lists = [value if isinstance(value, tuple) else (value,) for value in table.values()]
    return (dict(zip(table, values, strict=True)) for values in itertools.product(*lists))


def filled(point: dict, experiment: Experiment, values: Mapping[str, Any]) -> dict:
    """`point` with all that any [[points]] table or rung sweeps, taken from `values` where its own table does not.

    All points of an experiment then say the same things, and one that two tables hold is one.
    """
    tables = rungs(experiment) if experiment.ladder else experiment.points
    keys = dict.fromkeys(key for table in tables for key in table)
    return {**{key: values[key] for key in keys if values.get(key) is not None}, **point}
