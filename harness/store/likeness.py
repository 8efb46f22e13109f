"""Compares the hosts of a partition, in kind and in speed."""

import statistics
from collections.abc import Iterable
from pathlib import Path

from harness.machine import fingerprint
from harness.store import store

KIND = tuple(name for name in (*fingerprint.MACHINE, *fingerprint.SOFTWARE) if name != "host")
STATE = "governor", "turbo"
MEMORY = 0.02  # relative difference of memory within one kind: the kernel reserves different amounts at start
SPEED = 0.05  # relative difference from the partition's median up to which hosts are equally fast
RATES = {"float64": "float64 operations a second", "bytes": "bytes a second from memory"}


def of_run(folder: Path) -> list[str]:
    """One sentence for each difference between hosts of one partition, in a run on a cluster."""
    partitions: dict[str, list[dict]] = {}
    for path in sorted(Path(folder).glob("parts/*/run.json")):
        facts = store.facts_of(path.parent)
        partitions.setdefault(facts.get("job", {}).get("partition", ""), []).append(facts)
    return [
        f"partition {name}: {line}" if name else line
        for name, parts in partitions.items()
        for line in (*kinds([part["environment"] for part in parts]), *speeds(parts))
    ]


def kinds(environments: Iterable[dict]) -> list[str]:
    """Lists the differences between environments, each with the hosts that have each value."""
    differences = []
    hosts = list({fingerprint.of(environment): environment for environment in environments}.values())
    for name in (*KIND, *STATE):
        groups: list[tuple[object, list[str]]] = []
        for environment in hosts:
            group = next((group for group in groups if _same(name, group[0], environment.get(name))), None)
            if group is None:
                groups.append((environment.get(name), [environment["host"]]))
            elif environment["host"] not in group[1]:
                group[1].append(environment["host"])
        if len(groups) > 1:
            each = "; ".join(f"{_short(value)} on {', '.join(names)}" for value, names in groups)
            differences.append(f"hosts differ in {name}: {each}")
    return differences


def speeds(parts: list[dict]) -> list[str]:
    """Lists hosts that are significantly slower or faster than the others, by the peaks measured as jobs began."""
    sentences = []
    for key, what in RATES.items():
        takes: dict[str, list[float]] = {}
        for part in parts:
            takes.setdefault(part["environment"]["host"], []).extend(part.get("speed", {}).get(key, []))
        takes = {host: values for host, values in takes.items() if values}
        if len(takes) < 2:
            continue
        middle = statistics.median_high(map(statistics.median, takes.values()))  # of two hosts the faster one
        for host, values in takes.items():
            ratio = statistics.median(values) / middle
            apart = max(values) < middle if ratio < 1 else min(values) > middle
            if abs(ratio - 1) > SPEED and apart:
                sentences.append(f"{host} does {ratio:.2f} of the median host's {what} ({middle:.3g})")
    return sentences


def is_alike(environment: dict, other: dict) -> bool:
    """Whether two environments are of the same kind of host, with the same software."""
    return all(_same(name, environment.get(name), other.get(name)) for name in KIND)


def _same(name: str, value, other) -> bool:
    if name == "memory_bytes" and value and other:
        return abs(value - other) <= MEMORY * max(value, other)
    return value == other


def _short(value) -> str:
    text = "unknown" if value is None else str(value)
    return text if len(text) <= 80 else f"{text[:77]}.."
