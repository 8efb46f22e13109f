"""Differences of two runs beside their times: machine, software, renderers, parameters."""

import json

from harness.machine import fingerprint
from harness.machine.fingerprint import MACHINE, SOFTWARE
from harness.renderer.parameters import NOT_IN_THE_PICTURE
from reports.run.results import Cell, Results

STATE = "governor", "turbo", "commit"


def machine(a: Results, b: Results) -> list[str]:
    """How the machine of B is another than that of A, a line each; none if it is the same."""
    return _changes(a.facts["environment"], b.facts["environment"], MACHINE)


def others(a: Results, b: Results, pairs: list[tuple[Cell, Cell]]) -> list[str]:
    """Lists what else differs, a line each: software, state, order, renderers; parameters of the `pairs` of cells."""
    found = _changes(a.facts["environment"], b.facts["environment"], SOFTWARE + STATE)
    found += _changes(a.facts, b.facts, ("order",))
    versions = [{cell["variant"]: cell["renderer_version"] for cell in run.facts["cells"]} for run in (a, b)]
    common = tuple(name for name in versions[0] if name in versions[1])
    found += [f"renderer of {line}" for line in _changes(*versions, common)]
    for one, other in pairs:
        names = {*one.parameters, *other.parameters} - set(changed_picture(one, other))
        found += [f"{one.variant}: {line}" for line in _changes(one.parameters, other.parameters, tuple(sorted(names)))]
    return list(dict.fromkeys(found))


def changed_picture(a: Cell, b: Cell) -> list[str]:
    """The names of the parameters, known to both, by which the cells are to make different pictures."""
    return [
        name for name, value in a.parameters.items()
        if name not in NOT_IN_THE_PICTURE and value != b.parameters.get(name, value)
    ]  # fmt: skip


def _changes(before: dict, now: dict, names: tuple[str, ...]) -> list[str]:
    """A line for each value that is not the same; tables are looked into."""
    return [f"{name}: {_said(old)} -> {_said(new)}" for name, old, new in fingerprint.changes(before, now, names)]


def _said(value) -> str:
    if value is None:
        return "not told"
    return value if isinstance(value, str) else json.dumps(value)
