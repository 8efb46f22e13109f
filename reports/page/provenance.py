"""The section on provenance: command, commit, versions, and what disturbed the machine."""

import json
import shlex

from reports.paper import markdown
from reports.run.results import Results

RENDERER_HEADER = ["variant", "source", "reference", "built with", "versions", "methods"]


def write(results: Results) -> str:
    """The section of the report."""
    facts = results.facts
    environment = facts["environment"]
    experiment = facts["experiment"]
    rows = [
        ["title", facts["title"]],
        ["started", facts["started"]],
        ["command", shlex.join(facts["command"])],
        ["commit", environment["commit"]],
        ["host", environment["host"]],
        ["processes a cell, unless overridden", str(experiment["processes"])],
        ["steady frames a process, unless overridden", str(experiment["frames"])],
        ["overrides", json.dumps(experiment["override"]) if experiment.get("override") else "none"],
        ["image", json.dumps(experiment["image"])],
        ["measurer's interval (s)", str(experiment["measure"]["interval"])],
        ["measurer's audit", _audit(results)],
        *([["CUDA device", _devices(results)]] if any(cell.gpu for cell in results.cells) else []),
        ["repetitions", f"{len(results.records)}, {_order(facts)}"],
        *([f"left out: {told['constraint']}", f"{told['cells']} cells"] for told in facts.get("left_out", [])),
        ["ended", _ended(facts)],
    ]
    doubts = disturbances(environment) + changes(environment, facts.get("ended", {}))
    return "\n\n".join(
        [
            "## Provenance",
            markdown.table(["what", "of this run"], rows),
            "### Renderers",
            markdown.table(RENDERER_HEADER, _renderers(results)),
            "### State of the machine",
            markdown.bullets(list(map(markdown.escape, doubts))) if doubts else "Nothing found that disturbs.",
        ]
    )


def _order(facts: dict) -> str:
    if facts.get("order") == "sequential":
        return "one cell after the other: a drift of the machine makes its cells differ"
    return f"interleaved, shuffled with seed {facts['experiment']['seed']}"


def _ended(facts: dict) -> str:
    """When, and the state of the machine then, which the run itself has a part in."""
    if "ended" not in facts:
        return "unavailable: it was cut off, or is of an older version"
    load, pressure = facts["ended"]["load"], str(facts["ended"]["pressure"]).splitlines()[0]
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
    """One row a variant, from its first record that says versions."""
    rows = []
    for variant in results.variants:
        mine = [record for record in results.records if record["variant"] == variant]
        said = next((record for record in mine if record["versions"] or record["used"]), None)
        if said is None:
            rows.append([variant, *["unavailable: it never told"] * 5])
            continue
        build, accuracy = said["build"], said["accuracy"] or {}
        rows.append(
            [
                variant,
                said["renderer_version"],
                accuracy.get("reference") or f"unavailable: {accuracy.get('unavailable', said['reason'])}",
                f"{build['compiler']}: {shlex.join(build['command'])}" if build else "nothing is built",
                _told(said["versions"]),
                _told((said["used"] or {}).get("methods")),
            ]
        )
    return rows


def _told(values) -> str:
    if not values:
        return "unavailable: it does not tell"
    if not isinstance(values, dict):
        return str(values)
    return ", ".join(f"{name} {'not told' if value is None else value}" for name, value in values.items())


def _devices(results: Results) -> str:
    """The devices as renderers told them, each once."""
    told = [record.get("device") for record in results.records]
    names = (
        f"{device['name']}, compute capability {'.'.join(map(str, device.get('compute_capability') or ['not told']))}, "
        f"driver {device.get('driver') or 'not told'}"
        for device in filter(None, told)
    )
    return "; ".join(dict.fromkeys(names)) or "unavailable: no renderer told it"


def _audit(results: Results) -> str:
    """How well the measurer kept its interval."""
    audits = [record["measurer"] for record in results.records if record["measurer"]]
    ticks, missed = (sum(audit[name] for audit in audits) for name in ("ticks", "missed"))
    late = [audit["interval_p99_s"] for audit in audits if audit["interval_p99_s"]]
    if not late:
        return "unavailable: no series has two ticks"
    cpu = sum(audit["cpu_s"] for audit in audits)
    return f"{ticks} ticks, {missed} missed; worst p99 of the interval {max(late):.3g} s; it used {cpu:.3g} s of CPU"


def disturbances(environment: dict) -> list[str]:
    """Lists what in the state of the machine disturbs timings, or could not be read."""
    found = []
    cores = environment["cores"]["usable"]
    load, pressure = environment["load"], environment["pressure"]
    if environment["virtual_machine"] == "yes":
        found.append("a virtual machine: cores may vanish for seconds; trust interleaved ratios, not single times")
    if isinstance(load, str):
        found.append(f"load {load}")
    elif load[0] > 0.1 * cores:
        found.append(f"load {load[0]:.2f} on {cores} cores when the run began: other programs were running")
    if pressure.startswith("unavailable"):
        found.append(f"waiting for a core: {pressure}")
    elif float(pressure.split("avg10=")[1].split()[0]) >= 1:
        found.append(f"programs waited for a core when the run began: {pressure.splitlines()[0]}")
    governor, turbo = environment["governor"], environment["turbo"]
    if governor != "performance":
        found.append(f"frequency governor: {governor}")
    if turbo != "off":
        found.append(f"turbo: {turbo}")
    if environment["swap_bytes"]:
        found.append(f"swap of {environment['swap_bytes'] / 1e6:.0f} MB is on")
    return found
