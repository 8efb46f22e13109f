"""Says whether a run, or a comparison of two, passes its gates, fails them, or cannot tell.

A gate on times passes only if a slowdown of so many per cent would have been seen: the upper end of the ratio's
interval is below it. It fails if the lower end is above it. Between the two, where nothing could be compared, or where
the machine may have drifted by as much, it cannot tell, and says what it could have seen.
"""

import math
from dataclasses import dataclass

from harness.statistics import statistics
from harness.statistics.statistics import Estimate
from harness.store.record import failed
from reports.compare import budget, compare, versions
from reports.compare.compare import Comparison
from reports.paper import quantity
from reports.run.results import Results

PASS, FAIL, UNKNOWN = "pass", "fail", "cannot tell"
STATUS = {PASS: 0, FAIL: 1, UNKNOWN: 2}  # exit status
REMEDY = "more processes, a quiet machine, or a budget of instructions"
COUNT = "count in both runs, --set measure.count=true, on machines where `rayrace doctor` names the same tool"
NEW_BUDGET = "write a new budget if the tool has changed: rayrace export RUN --format budget"


@dataclass(frozen=True)
class Answer:
    """The answer of a cell. text: why. sees: the smallest slowdown that its interval excludes; None if it has none."""

    verdict: str
    text: str = ""
    sees: float | None = None


@dataclass(frozen=True)
class Gate:
    """A gate and its answers. passed: what is said if it passes."""

    answers: list[Answer]
    passed: str

    @property
    def verdict(self) -> str:
        verdicts = {answer.verdict for answer in self.answers}
        return FAIL if FAIL in verdicts else UNKNOWN if UNKNOWN in verdicts or not verdicts else PASS

    @property
    def why(self) -> str:
        """The reason of the verdict in a sentence: what is worst, of the answers that have it."""
        answers = [answer for answer in self.answers if answer.verdict == self.verdict]
        sees = max((answer.sees for answer in answers if answer.sees is not None), default=None)
        if self.verdict == PASS:
            return self.passed + (f": at most {_up(sees)}" if sees and sees > 0 else "")
        reasons = [answer.text for answer in answers if answer.verdict == FAIL or answer.sees is None]
        if reasons:
            return reasons[0] + (f", and {len(answers) - 1} more" if len(answers) > 1 else "")
        return f"this run can only see {_up(sees)} or more: {REMEDY}"


def verdict(gates: list[Gate]) -> str:
    """Returns the verdict of several gates: it fails if one does, and passes if all do."""
    verdicts = [gate.verdict for gate in gates]
    return next(word for word in (FAIL, UNKNOWN, PASS) if word in verdicts)


def line(gates: list[Gate]) -> str:
    """Returns the verdict of several gates and why, in a line."""
    word = verdict(gates)
    return f"gate: {word}: {'; '.join(gate.why for gate in gates if gate.verdict == word)}"


def details(gates: list[Gate]) -> list[str]:
    """Returns a line for each cell that does not pass."""
    return [answer.text for gate in gates for answer in gate.answers if answer.verdict != PASS and answer.text]


def of(results: Results, limits: dict | None) -> list[Gate]:
    """Returns the gates of a run. limits: {slower_percent, budget}, as run.json has them; without any, []."""
    percent, lines = (limits or {}).get("slower_percent"), (limits or {}).get("budget")
    gates = []
    if percent is not None:
        gates.append(of_versions(versions.comparisons(results), percent))
    if lines is not None:
        kept = budget.parse(lines, results.folder / "run.json")
        gates.append(of_budget(budget.hold(results, kept), kept.percent))
    bad = sum(map(failed, results.records))
    if gates and bad:
        gates.append(Gate([Answer(FAIL, f"{bad} repetition{'s' * (bad > 1)} failed")], ""))
    return gates


def of_versions(rows: list[versions.Held], percent: float) -> Gate:
    """Returns the gate of cells that were held against another version."""
    answers = [_of_version(row, percent) for row in rows if row.wanted]
    return _of_times(answers, percent, "; ".join(row.text for row in rows))


def of_comparison(comparison: Comparison, percent: float) -> Gate:
    """Returns the gate of two runs."""
    answers = [_of_row(row, comparison, percent) for row in comparison.rows if row.wanted and not row.only]
    return _of_times(answers, percent, "see the reasons above")


def of_instructions(comparison: Comparison, percent: float) -> Gate:
    """Returns the gate of the instructions of two runs."""
    answers = [Answer(FAIL, f"no longer ok: {row.name}: {row.reason}") for row in comparison.broken]
    for row in comparison.rows:
        if row.counts is None or row.broken or not row.wanted:
            continue
        if row.counts.ratio is None:
            answers.append(Answer(UNKNOWN, f"{row.name}: {row.counts.text}; {COUNT}"))
        elif row.counts.more(percent):
            answers.append(Answer(FAIL, f"more instructions, by more than {percent:g} %: {row.name}"))
        else:
            answers.append(Answer(PASS))
    answers = answers or [Answer(UNKNOWN, f"none of the runs counted any instructions; {COUNT}")]
    return Gate(answers, f"no cell takes over {percent:g} % more instructions")


def of_budget(rows: list[budget.Held], percent: float) -> Gate:
    """Returns the gate of cells that were held to a budget."""
    answers = []
    for row in rows:
        if row.over:
            answers.append(Answer(FAIL, f"over the budget, by more than {percent:g} %: {row.text}"))
        elif row.counts.ratio is not None:
            answers.append(Answer(PASS))
        elif row.both:
            answers.append(Answer(UNKNOWN, f"{row.text}; {NEW_BUDGET}"))
    if not answers:
        why = "; ".join(row.text for row in rows) or "the budget has no cell"
        answers = [Answer(UNKNOWN, f"nothing could be compared: {why}; {NEW_BUDGET}")]
    return Gate(answers, f"no cell takes over {percent:g} % more instructions than its budget")


def _of_times(answers: list[Answer], percent: float, why: str) -> Gate:
    answers = answers or [Answer(UNKNOWN, f"no cell could be compared: {why}")]
    return Gate(answers, f"no slowdown of {percent:g} % or more")


def _of_version(row: versions.Held, percent: float) -> Answer:
    if row.broken:
        return Answer(FAIL, f"no longer ok: {row.text}")
    if row.verdict == versions.INCOMPARABLE:
        return Answer(UNKNOWN, row.text)
    answer, least = _of_ratio(row.text, row.ratio, percent, row.floor), 1 + percent / 100
    if row.wall is None or row.wall.low is None:
        return answer
    apart = row.wall.low > least if answer.verdict == PASS else row.wall.high < least
    if answer.verdict != UNKNOWN and apart:  # as it waits, say, which takes no CPU time
        return Answer(UNKNOWN, f"CPU time and wall time disagree: {row.text}")
    return answer


def _of_row(row: compare.Row, comparison: Comparison, percent: float) -> Answer:
    if row.broken:
        return Answer(FAIL, f"no longer ok: {row.name}: {row.reason}")
    if row.time == compare.INCOMPARABLE:
        return Answer(UNKNOWN, f"{row.name}: {row.time}: {row.reason}")
    if row.unchanged:  # what its time does is drift
        return Answer(PASS)
    moved = comparison.drift.value
    if moved is None:
        return Answer(UNKNOWN, f"{row.name}: drift of the machine between the runs: {comparison.drift.source}")
    return _of_ratio(row.name, row.ratio, percent, row.floor, moved)


def _of_ratio(name: str, ratio: Estimate, percent: float, floor: float | None, moved: float = 0.0) -> Answer:
    """moved: what the machine may have drifted by meanwhile, either way."""
    least, low, high = 1 + percent / 100, ratio.low / (1 + moved), ratio.high * (1 + moved)
    if high < least:
        return Answer(PASS, sees=high - 1)
    noise = floor or 0.0
    if low > least and statistics.difference(ratio.value) > noise:
        return Answer(FAIL, f"slower by more than {percent:g} %: {name}")
    sees = max(high - 1, noise if low > least else 0.0)
    return Answer(UNKNOWN, f"slower by {percent:g} % or not: {name}; only {_up(sees)} or more could be seen", sees)


def _up(share: float) -> str:
    """Returns a share in per cent to two digits, rounded up: what is seen is never said to be less."""
    unit = 10.0 ** (math.floor(math.log10(100 * share)) - 1)
    return f"{quantity.plain(math.ceil(100 * share / unit - 1e-9) * unit, 2)} %"
