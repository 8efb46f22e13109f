"""Groups runs by machine: what the machines are, and what differs between runs of one machine."""

import itertools
import json
from dataclasses import dataclass

from reports.compare import runs as compare_runs
from reports.paper import markdown
from reports.run.results import Results
from reports.times import machine_table


@dataclass(frozen=True, eq=False)
class Member:
    """A run among several. name: of its folder in the report, no other run's. host: what its machine is called."""

    name: str
    host: str
    results: Results


def members(runs: list[tuple[str, Results]]) -> list[Member]:
    """Runs, each (name, run), those of one machine together; machines and runs of one stay in the order given."""
    machines: dict[str, list[tuple[str, Results]]] = {}
    for name, run in runs:
        environment = run.facts["environment"]
        known = json.dumps({key: environment.get(key) for key in compare_runs.MACHINE}, sort_keys=True)
        machines.setdefault(known, []).append((name, run))
    labels = _labels([mine[0][1].facts["environment"] for mine in machines.values()])
    names = _distinct([name for mine in machines.values() for name, _ in mine])
    return [
        Member(names.pop(0), label, run)
        for label, mine in zip(labels, machines.values(), strict=True)
        for _, run in mine
    ]


def _labels(environments: list[dict]) -> list[str]:
    """Names of machines: those of hosts; with the processor, and then with a number, where these are the same."""
    hosts = [told["host"] for told in environments]
    full = [
        told["host"] if hosts.count(told["host"]) == 1 else f"{told['host']}, {told['cpu']}" for told in environments
    ]
    return _distinct(full)


def _distinct(names: list[str]) -> list[str]:
    """The names, with a number behind each that was there before."""
    found: list[str] = []
    for name in names:
        number, made = 2, name
        while made in found:
            number, made = number + 1, f"{name}-{number}"
        found.append(made)
    return found


def by_host(found: list[Member]) -> dict[str, list[Member]]:
    hosts: dict[str, list[Member]] = {}
    for member in found:
        hosts.setdefault(member.host, []).append(member)
    return hosts


def write(found: list[Member]) -> str:
    """The section of the report: machines beside each other, and what changed on each from run to run."""
    hosts = by_host(found)
    tables = [dict(_rows(mine[0])) for mine in hosts.values()]
    body = [[what, *(table[what] for table in tables)] for what in tables[0]]
    parts = ["## Machines", markdown.table(["what", *hosts], body)]
    for host, mine in hosts.items():
        changed = [
            f"{markdown.escape(after.name)} against {markdown.escape(before.name)}: {markdown.escape(line)}"
            for before, after in itertools.pairwise(mine)
            for line in compare_runs.others(before.results, after.results, [])
        ]
        if changed:
            parts += [f"### Changed on {markdown.escape(host)} from run to run", markdown.bullets(changed)]
    return "\n\n".join(parts)


def _rows(member: Member) -> list[tuple[str, str]]:
    """Returns the rows of its machine as in table 2.1, without the study's."""
    return [(what, ours) for what, ours, _ in machine_table.rows(member.results.facts["environment"])]
