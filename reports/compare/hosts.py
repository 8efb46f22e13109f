"""Groups runs by machine, describes the machines, and lists differences between runs of one machine."""

import itertools
import json
from collections import Counter
from dataclasses import dataclass

from reports.compare import runs as compare_runs
from reports.paper import markdown
from reports.run.results import Results, grouped
from reports.times import machine_table


@dataclass(frozen=True, eq=False)
class Member:
    """A run among several. name: of its folder in the report, unique. host: the name of its machine."""

    name: str
    host: str
    results: Results


def members(runs: list[tuple[str, Results]]) -> list[Member]:
    """Returns members for runs, each (name, run), grouped by machine; the order given is kept otherwise."""

    def machine(one: tuple[str, Results]) -> str:
        environment = one[1].facts["environment"]
        return json.dumps({key: environment.get(key) for key in compare_runs.MACHINE}, sort_keys=True)

    machines = grouped(runs, machine)
    labels = _labels([mine[0][1].facts["environment"] for mine in machines.values()])
    names = _distinct([name for mine in machines.values() for name, _ in mine])
    return [
        Member(names.pop(0), label, run)
        for label, mine in zip(labels, machines.values(), strict=True)
        for _, run in mine
    ]


def _labels(environments: list[dict]) -> list[str]:
    """Names machines by their hosts, and by processor and a number where hosts have the same name."""
    hosts = Counter(one["host"] for one in environments)
    return _distinct([one["host"] + f", {one['cpu']}" * (hosts[one["host"]] > 1) for one in environments])


def _distinct(names: list[str]) -> list[str]:
    """Returns the names, with a number appended to each repeated one."""
    found: list[str] = []
    for name in names:
        number, made = 2, name
        while made in found:
            number, made = number + 1, f"{name}-{number}"
        found.append(made)
    return found


def by_host(found: list[Member]) -> dict[str, list[Member]]:
    return grouped(found, lambda member: member.host)


def write(found: list[Member]) -> str:
    """Returns the section of the report: a table of the machines, and the changes on each from run to run."""
    hosts = by_host(found)
    environments = [mine[0].results.facts["environment"] for mine in hosts.values()]
    tables = [{what: ours for what, ours, _ in machine_table.rows(environment)} for environment in environments]
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
