"""Writes the section on provenance: command, commit, versions, and the state of the machine."""

import json
import re
import shlex
from pathlib import Path

from reports.paper import markdown
from reports.run.results import Results

RENDERER_HEADER = ["renderer", "source", "reference", "built with", "versions", "methods"]


def write(results: Results, _: Path | None = None) -> str:
    """Returns the section of the report."""
    facts = results.facts
    environment, experiment = facts["environment"], facts["experiment"]
    rows = [
        ["title", facts["title"]],
        ["started", facts["started"]],
        ["command", shlex.join(facts["command"])],
        ["commit", environment["commit"]],
        ["host", environment["host"]],
        ["processes per cell, unless overridden", str(experiment["processes"])],
        ["steady frames per process, unless overridden", str(experiment["frames"])],
        ["overrides", json.dumps(experiment["override"]) if experiment.get("override") else "none"],
        ["image", json.dumps(experiment["image"])],
        ["measurer's interval (s)", str(experiment["measure"]["interval"])],
        ["measurer's audit", _audit(results)],
        *([["device", _devices(results)]] if any(cell.gpu for cell in results.cells) else []),
        ["repetitions", f"{len(results.records)}, {_order(facts)}"],
        *([f"left out: {entry['constraint']}", f"{entry['cells']} cells"] for entry in facts.get("left_out", [])),
        ["ended", _ended(facts)],
    ]
    doubts = disturbances(environment) + changes(environment, facts.get("ended", {}))
    return "\n\n".join(
        [
            "## Provenance",
            markdown.table(["what", "this run"], rows),
            "### Renderers",
            markdown.table(RENDERER_HEADER, _renderers(results)),
            "### State of the machine",
            markdown.bullets(list(map(markdown.escape, doubts))) if doubts else "Nothing disturbs timings.",
            "Every process, one row each: [repetitions.csv](repetitions.csv)",
        ]
    )


def _order(facts: dict) -> str:
    if facts.get("order") == "sequential":
        return "one cell after the other: if the machine drifts, cells differ"
    return f"interleaved, shuffled with seed {facts['experiment']['seed']}"


def _ended(facts: dict) -> str:
    """Returns the end of the run and the state of the machine then, to which the run contributes."""
    if "ended" not in facts:
        return "unavailable: the run was interrupted, or is of an older version"
    load, pressure = facts["ended"]["load"], str(facts["ended"]["pressure"]).partition("\n")[0]
    loads = load if isinstance(load, str) else ", ".join(f"{value:.2f}" for value in load)
    return f"{facts['ended']['at']}; load {loads}; waiting for a core: {pressure}"


def changes(begun: dict, ended: dict) -> list[str]:
    """Lists the machine's settings that changed during the run."""
    names = {"governor": "frequency governor", "turbo": "turbo"}
    return [
        f"{name}: {begun[key]} when the run began, {ended[key]} when it ended"
        for key, name in names.items()
        if key in ended and ended[key] != begun[key]
    ]


def _renderers(results: Results) -> list[list[str]]:
    """Returns a row for each variant, from its first record with versions or methods."""
    rows = []
    for variant in results.variants:
        records = [record for record in results.records if record["variant"] == variant]
        record = next((record for record in records if record["versions"] or record["used"]), None)
        if record is None:
            rows.append([variant, *["unavailable: no process reported it"] * 5])
            continue
        build, agreement = record["build"], record["agreement"] or {}
        rows.append(
            [
                variant,
                record["renderer_version"],
                agreement.get("reference") or f"unavailable: {agreement.get('unavailable', record['reason'])}",
                f"{build['compiler']}: {shlex.join(build['command'])}" if build else "nothing is built",
                _pairs(record["versions"]),
                _pairs((record["used"] or {}).get("methods")),
            ]
        )
    return rows


def _pairs(values) -> str:
    if not values:
        return "unavailable: not reported"
    if not isinstance(values, dict):
        return str(values)
    return ", ".join(f"{name} {'not reported' if value is None else value}" for name, value in values.items())


def _devices(results: Results) -> str:
    """Returns the devices that renderers reported, each once."""
    devices = [record.get("device") for record in results.records]
    names = (_device(device) for device in filter(None, devices))
    return "; ".join(dict.fromkeys(names)) or "unavailable: no renderer reported it"


def _device(device: dict) -> str:
    capability = device.get("compute_capability")
    words = [device["name"], *([f"compute capability {'.'.join(map(str, capability))}"] if capability else [])]
    words += [f"driver {device.get('driver') or 'unknown'}", *(["a processor"] if device.get("type") == "cpu" else [])]
    return ", ".join(words)


def _audit(results: Results) -> str:
    """Says how well the measurer kept its interval."""
    audits = [record["measurer"] for record in results.records if record["measurer"]]
    ticks, missed = (sum(audit[name] for audit in audits) for name in ("ticks", "missed"))
    late = [audit["interval_p99_s"] for audit in audits if audit["interval_p99_s"]]
    if not late:
        return "unavailable: no series has two ticks"
    cpu = sum(audit["cpu_s"] for audit in audits)
    return f"{ticks} ticks, {missed} missed; worst p99 of the interval {max(late):.3g} s; it used {cpu:.3g} s of CPU"


def disturbances(environment: dict) -> list[str]:
    """Lists the states of the machine that disturb timings or could not be read."""
    states = []
    cores = environment["cores"]["usable"]
    load, pressure = environment["load"], environment["pressure"]
    if environment["virtual_machine"] == "yes":
        states.append("a virtual machine: cores may vanish for seconds; trust interleaved ratios, not single times")
    if isinstance(load, str):
        states.append(f"load {load}")
    elif load[0] > 0.1 * cores:
        states.append(f"load {load[0]:.2f} on {cores} cores when the run began: other programs were running")
    if pressure.startswith("unavailable"):
        states.append(f"waiting for a core: {pressure}")
    elif not (share := re.search(r"\bavg10=(\d+(?:\.\d+)?)(?!\S)", pressure)):
        states.append("waiting for a core: unavailable: the file of the system has no avg10")
    elif float(share[1]) >= 1:
        states.append(f"programs waited for a core when the run began: {pressure.splitlines()[0]}")
    governor, turbo = environment["governor"], environment["turbo"]
    if governor != "performance":
        states.append(f"frequency governor: {governor}")
    if turbo != "off":
        states.append(f"turbo: {turbo}")
    if environment["swap_bytes"]:
        states.append(f"swap of {environment['swap_bytes'] / 1e6:.0f} MB is on")
    return states
