"""Prints the result of a run: who is how fast, what that costs and from when on it pays, and a sentence."""

import sys
from pathlib import Path

from rich import box
from rich.markup import escape
from rich.table import Table

from harness.statistics.digits import earned
from harness.store import store
from rayrace.terminal import console
from reports.paper import quantity

MOST = 20  # rows


def show(folder: Path, records: list[dict]) -> None:
    """Prints the ranking of a run, what each variant would buy, and the sentence.

    Nothing where fewer than two cells have a result, or where several hosts ran them, whose times are not compared.
    """
    if len({record["cell"] for record in records if record["status"] == "ok"}) < 2 or len(store.hosts(folder)) > 1:
        return
    from reports.run import results
    from reports.times import headline

    loaded = results.load(folder)
    ranking = headline.of(loaded)
    notes: dict[str, None] = {}
    if len(ranking.bars) > 1:
        steady = ranking.clock == headline.STEADY
        console.print(_ranking(loaded, ranking, steady, notes))
        if steady:
            console.print(_purchase(loaded, ranking.bars, notes))
    measured = {record["variant"] for record in records if record["status"] == "ok"}
    notes |= dict.fromkeys(f"{name}: not ranked: {reason}" for name, reason in ranking.lacking if name in measured)
    for text in [*notes, ranking.sentence]:
        print(text)


def compared(folder: Path, limits: dict | None) -> int | None:
    """Prints how a run compares with another version and with its budget, and the verdict of its gates, last.

    Returns the exit status of the gates, None without any. limits: what run.json says of them.
    """
    from reports.compare import budget, gate, versions
    from reports.run import results

    two = len(store.hosts(folder)) == 1 and store.read(folder)[0].get("against")  # --against is of one machine
    if not two and not limits:
        return None
    run = results.load(folder)
    if two:
        rows = versions.comparisons(run)
        for line in [*(row.text for row in rows if len(rows) > 1), f"this version: {versions.verdict(rows)}"]:
            print(line)
    if limits and limits["budget"]:
        for row in budget.hold(run, budget.parse(limits["budget"], folder / "run.json")):
            print(row.text)
    gates = gate.of(run, limits)
    return conclude(gates) if gates else None


def conclude(gates: list, stream=None) -> int:
    """Prints why cells do not pass, and the verdict of gates, last; returns their exit status."""
    from reports.compare import gate

    sys.stdout.flush()
    for line in gate.details(gates):
        print(line, file=sys.stderr, flush=True)
    print(gate.line(gates), file=stream)
    return gate.STATUS[gate.verdict(gates)]


def _ranking(loaded, ranking, steady: bool, notes: dict[str, None]) -> Table:
    """The contestants, the fastest first. steady: by steady frames, of one place. notes: gets what is said below."""
    from reports.accuracy import accuracy_columns

    of = [f"one of {len(loaded.places)} configurations"] * (steady and len(loaded.places) > 1)
    base = next(bar for bar in ranking.bars if bar.ratio is None)
    table = _table(
        ", ".join([ranking.where, *ranking.shared, *of]), "", ranking.clock, f"÷ {base.name}", "RMSE", "agrees"
    )
    for bar in ranking.bars[:MOST]:
        ratio = "1" if bar.ratio is None else earned(bar.ratio)
        if bar.ratio and bar.ratio.low is not None and not bar.resolved:
            ratio += ", not resolved"
        rmse, _, _, agrees = accuracy_columns.brief(bar.cell)
        time = bar.time.value if bar.time.low is None else bar.time  # the sentence says that processes are too few
        table.add_row(*map(escape, (bar.name, quantity.seconds(time), ratio, rmse, agrees)))
    if len(ranking.bars) > MOST:
        notes[f"and {len(ranking.bars) - MOST} more: rayrace report {loaded.folder}"] = None
    return table


def _purchase(loaded, bars: list, notes: dict[str, None]) -> Table:
    """What each contestant would buy in place of `python`, else of the slowest, and what it costs."""
    from reports.times import startup_table

    compared = [bar for bar in bars if bar.compared]
    base = next((bar for bar in compared if bar.cell.variant == "python"), compared[-1])
    table = _table(
        f"compared with {base.name}, from an empty compile cache",
        "",
        "speed-up",
        "compile, build",
        "breaks even",
        "lines",
        "memory",
    )
    for bar in bars[:MOST]:
        table.add_row(
            escape(bar.name),
            f"{quantity.plain(base.time.value / bar.time.value)} ×" if bar is not base else "",
            _in_short(startup_table.cold(bar.cell), notes),
            _pays(startup_table, bar, base) if bar is not base else "",
            str((loaded.record(bar.cell) or {}).get("lines") or "unavailable"),
            _in_short(bar.cell.median("peak_bytes", "the system does not tell it"), notes, quantity.size),
        )
    return table


def _pays(startup_table, bar, base) -> str:
    """The frames for which compiling, from nothing, and rendering them takes less time than with `base`."""
    starts = startup_table.start_s(bar.cell, warm=False), startup_table.start_s(base.cell, warm=False)
    if None in starts:
        return "unavailable"
    span = startup_table.lead(starts[0], bar.time.value, starts[1], base.time.value)
    if span is None:
        return "never"
    return f"at frame {span[0]}" + (f" to {span[1]}" if span[1] else "")


def _table(title: str, first: str, *numbers: str) -> Table:
    table = Table(first, title=escape(title), title_justify="left", box=box.SIMPLE)
    for name in numbers:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def _in_short(value, notes: dict[str, None], show=quantity.seconds) -> str:
    """The median of an Estimate, or a text; why it is unavailable is a note."""
    if isinstance(value, quantity.Missing):
        notes[str(value)] = None
        return "unavailable"
    return show(getattr(value, "value", value))
