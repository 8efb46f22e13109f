"""Exports a run to the format of another tool: one module a format, which reads result files as all reports do.

The formats for times (pyperf, hyperfine, github) have no place for a reason: a cell that takes part in no comparison is
left out, and told of. parquet has every repetition, with status and reason; packed is the run itself in one file.
hyperfine, which times commands, has whole processes unless frames are asked for; pyperf and github have frames, with
the instructions of a frame where they were counted. budget has these alone.
"""

from pathlib import Path

from harness.errors import UserError
from harness.store import packed, store
from harness.system import output
from reports.exporters import budget, github, hyperfine, parquet, pyperf
from reports.run import naming, results

TEXTS = {"pyperf": pyperf.text, "hyperfine": hyperfine.text, "github": github.text}
# What each format can hold, the usual first, in words.
HOLDS = {
    "pyperf": {"frame": "the durations of the steady frames of each process"},
    "hyperfine": {
        hyperfine.PROCESS: "whole processes, from start to exit, with all frames; --what frame has the steady frame",
        hyperfine.FRAME: "the steady frame of each process",
    },
    "github": {"frame": "the steady frame, the median over processes, and its instructions if they were counted"},
    "budget": {"instructions": "the instructions of a steady frame of each cell"},
    "parquet": {"all": "every repetition, with the times of its process, phases and frames"},
    "packed": {"all": "the run itself"},
}
FORMATS = tuple(HOLDS)


def chosen(form: str, what: str = "") -> str:
    """What an export holds: `what`, or the usual of the format. UserError if one of them is unknown."""
    if form not in FORMATS:
        raise UserError(f'no format "{form}"; known: {", ".join(FORMATS)}')
    if what and what not in HOLDS[form]:
        raise UserError(f'{form} has no "{what}"; it holds: {", ".join(HOLDS[form])}')
    return what or next(iter(HOLDS[form]))


def write(
    run: Path,
    form: str,
    out: Path | None,
    pictures: bool = True,
    host: str = "",
    what: str = "",
    truths: bool = True,
) -> list[str]:
    """Export the run in the folder `run` as `form` to the file `out`, or to standard output if that is None.

    pictures, truths: of a packed run, whether they are in it. host: of a run on several, the one whose rows are meant;
    a packed run has all. what: of HOLDS; "": the usual of the format.
    A line for all that is left out, with the reason. UserError if the format is unknown or nothing is left.
    """
    what = chosen(form, what)
    if form in ("parquet", "packed") and out is None:
        raise UserError(f"{form} is no text", remedy="name a file with -o FILE")
    if form == "packed":
        if not out.name.endswith(packed.SUFFIX):
            raise UserError(f"{out}: expected a name that ends in {packed.SUFFIX}")
        packed.pack(run, out, pictures, truths)
        return []
    loaded = results.load(run, store.named(run, host))
    if form == "parquet":
        parquet.write(loaded, out)
        return []
    if form == "budget":
        text, left_out = budget.text(loaded)
        _put(text, out)
        return left_out
    cells = dict(zip(naming.names(loaded.cells), loaded.cells, strict=True))
    verdicts = {name: cell.unranked or cell.verdict for name, cell in cells.items()}
    left_out = [f"{name}: {why}" for name, why in verdicts.items() if why != "ok"]
    ranked = {name: cell for name, cell in cells.items() if not cell.unranked}
    if not ranked:
        raise UserError("\n  ".join([f"{run}: nothing to export", *left_out]))
    text = TEXTS[form](loaded, ranked, *([what] if form == "hyperfine" else []))
    _put(text, out)
    return left_out


def _put(text: str, out: Path | None) -> None:
    if out is None:
        print(text, end="")
    else:
        output.text(out, text, own=False)
