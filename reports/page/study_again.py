"""Collects the study's tables and figures by number, each from the run that repeats it, or why there is none."""

import re

from reports.compare.hosts import Member, by_host
from reports.paper import markdown
from reports.run import study

TITLE = "The study again"
HEADING = re.compile(r"^(#+) .*?\bthe study's (table|figure) (\d+\.\d+)\b.*$", re.IGNORECASE | re.MULTILINE)
LINK = re.compile(r"\]\((?=[^)#:]+\))")  # to a file of the report
WHOLE = re.compile(r"^#", re.MULTILINE)


def numbered(texts: list[str]) -> dict[str, str]:
    """Returns the parts of a report that repeat a table or figure of the study, by number ("table 4.1").

    texts: the sections of the report, Markdown. The number is in the heading, which is left out.
    """
    parts = {}
    for text in texts:
        for heading in HEADING.finditer(text):
            level, kind, number = heading.groups()
            end = re.compile(rf"^#{{1,{len(level)}}} ", re.MULTILINE).search(text, heading.end())
            parts.setdefault(f"{kind} {number}", text[heading.end() : end.start() if end else None].strip())
    return parts


def write(members: list[Member], texts: dict[Member, list[str]]) -> str:
    """Returns the section of the report. texts: the sections of each run."""
    by_member = {member: numbered(texts[member]) for member in members}
    parts = [f"## {TITLE}"]
    for name, (what, experiment) in study.NUMBERED.items():
        parts.append(f"### {name.capitalize()}: {what}")
        repeats = [
            _from(member, by_member[member][name], several=len(by_host(members)) > 1)
            for group in by_host(members).values()
            if (member := _best(name, [run for run in group if name in by_member[run]])) is not None
        ]
        parts += repeats or [markdown.escape(_missing(name, experiment))]
    return "\n\n".join(parts)


def _best(name: str, members: list[Member]) -> Member | None:
    """Returns the run of a machine that repeats most of the study's cases in a table or figure; None if none does.

    Tables and figures of the machine or of our own scenes need no case.
    """
    free = not name.endswith(("4.1", "4.2", "4.3"))
    cases = {member: sum(study.case(cell) is not None for cell in member.results.cells) for member in members}
    able = [member for member in members if free or cases[member]]
    return max(able, key=cases.__getitem__, default=None)


def _from(member: Member, text: str, several: bool) -> str:
    """Returns a text with its headings a level deeper and its links into the folder of the run."""
    text = LINK.sub(f"]({member.name}/", WHOLE.sub("##", text))
    where = f", {markdown.escape(member.host)}" if several else ""
    return f"From [{markdown.escape(member.name)}]({member.name}/report.html){where}.\n\n{text}"


def _missing(name: str, experiment: str) -> str:
    need = " on a machine with a GPU, or with PoCL" if name in study.ON_A_GPU else ""
    return f"unavailable: none of these runs has it; experiments/{experiment}.toml{need} makes one"
