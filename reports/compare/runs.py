"""Lists differences of two runs other than times: machine, software, renderers, parameters."""

import json

from harness.machine import fingerprint
from harness.machine.fingerprint import MACHINE, SOFTWARE
from harness.renderer.parameters import NOT_IN_THE_PICTURE
from reports.run.results import Cell, Results

STATE = "governor", "turbo", "commit"


def machine(a: Results, b: Results) -> list[str]:
    """Lists the differences between the machines of A and B; [] if they are the same."""
    return _changes(a.facts["environment"], b.facts["environment"], MACHINE)


def software(a: Results, b: Results) -> list[str]:
    """Lists the differences between the software of A and B; [] if it is the same."""
    return _changes(a.facts["environment"], b.facts["environment"], SOFTWARE)


def others(a: Results, b: Results, pairs: list[tuple[Cell, Cell]]) -> list[str]:
    """Lists other differences: software, state, order, renderers; parameters of the `pairs` of cells."""
    lines = software(a, b) + _changes(a.facts["environment"], b.facts["environment"], STATE)
    lines += _changes(a.facts, b.facts, ("order",))
    versions = [{cell["variant"]: cell["renderer_version"] for cell in run.facts["cells"]} for run in (a, b)]
    common = tuple(name for name in versions[0] if name in versions[1])
    lines += [f"renderer of {line}" for line in _changes(*versions, common)]
    for cell, other in pairs:
        names = {*cell.parameters, *other.parameters} - set(changed_picture(cell, other))
        lines += [
            f"{cell.variant}: {line}" for line in _changes(cell.parameters, other.parameters, tuple(sorted(names)))
        ]
    return list(dict.fromkeys(lines))


def changed_picture(a: Cell, b: Cell) -> list[str]:
    """Returns the names of parameters, known to both cells, that make their pictures different."""
    return [
        name for name, value in a.parameters.items()
        if name not in NOT_IN_THE_PICTURE and value != b.parameters.get(name, value)
    ]  # fmt: skip


def _changes(before: dict, now: dict, names: tuple[str, ...]) -> list[str]:
    """Returns a line for each value that differs, also inside tables."""
    return [f"{name}: {_text(old)} -> {_text(new)}" for name, old, new in fingerprint.changes(before, now, names)]


def _text(value) -> str:
    if value is None:
        return "unknown"
    return value if isinstance(value, str) else json.dumps(value)
