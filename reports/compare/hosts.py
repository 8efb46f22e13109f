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

    def machine(run: tuple[str, Results]) -> str:
        environment = run[1].facts["environment"]
        return json.dumps({key: environment.get(key) for key in compare_runs.MACHINE}, sort_keys=True)

    machines = grouped(runs, machine)
    labels = _labels([group[0][1].facts["environment"] for group in machines.values()])
    names = _distinct([name for group in machines.values() for name, _ in group])
    return [
        Member(names.pop(0), label, run)
        for label, group in zip(labels, machines.values(), strict=True)
        for _, run in group
    ]


def _labels(environments: list[dict]) -> list[str]:
    """Names machines by their hosts, and by processor and a number where hosts have the same name."""
    hosts = Counter(facts["host"] for facts in environments)
    return _distinct([facts["host"] + f", {facts['cpu']}" * (hosts[facts["host"]] > 1) for facts in environments])


def _distinct(names: list[str]) -> list[str]:
    """Returns the names, with a number appended to each repeated one."""
    distinct: list[str] = []
    for name in names:
        number, made = 2, name
        while made in distinct:
            number, made = number + 1, f"{name}-{number}"
        distinct.append(made)
    return distinct


def by_host(all_members: list[Member]) -> dict[str, list[Member]]:
    return grouped(all_members, lambda member: member.host)


def write(all_members: list[Member]) -> str:
    """Returns the section of the report: a table of the machines, and the changes on each from run to run."""
    hosts = by_host(all_members)
    environments = [group[0].results.facts["environment"] for group in hosts.values()]
    tables = [{what: ours for what, ours, _ in machine_table.rows(environment)} for environment in environments]
    body = [[what, *(table[what] for table in tables)] for what in tables[0]]
    parts = ["## Machines", markdown.table(["what", *hosts], body)]
    for host, group in hosts.items():
        changed = [
            f"{markdown.escape(after.name)} against {markdown.escape(before.name)}: {markdown.escape(line)}"
            for before, after in itertools.pairwise(group)
            for line in compare_runs.others(before.results, after.results, [])
        ]
        if changed:
            parts += [f"### Changed on {markdown.escape(host)} from run to run", markdown.bullets(changed)]
    return "\n\n".join(parts)
