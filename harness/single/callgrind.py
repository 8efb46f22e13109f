"""Reads what Valgrind's callgrind counted, instruction by instruction, as stacks of functions of the source.

A program that was built with -g -no-pie has its addresses in the file, so addr2line names, for each instruction, the
function it is in and those it was inlined into. Callers of a function that was not inlined are callgrind's, up to
DEEP. Sources: Valgrind's manual, "Callgrind Format Specification"; addr2line(1).
"""

import re
import subprocess
from collections import Counter
from itertools import pairwise
from pathlib import Path

DEEP = 6  # callers that are told apart
MAIN = "main"  # which everything but other threads is under; what calls it is no part of the program
OPTIONS = "-g", "-no-pie"
LAMBDA = re.compile(r"\{lambda\(.*?\)#\d+\}")
OPERATOR = re.compile(
    r" (new|delete)(\[\])?|\(\)|\[\]|->\*?|[^\w\s(<]+|<=>|<<=?|<=|<| [\w:]+|"
)  # what follows the word
POSITION = re.compile(r"0x[0-9a-f]+ ")
Stack = tuple[str, ...]
Costs = dict[tuple[str, str, int], int]  # instructions by object file, function with its callers, and address


def words(folder: Path) -> list[str]:
    """The words before a command that leave a file in the folder for each process."""
    plain = ["--compress-strings=no", "--compress-pos=no", "--dump-instr=yes", f"--separate-callers={DEEP}"]
    out = f"--callgrind-out-file={folder}/%p.callgrind"
    return ["valgrind", "--tool=callgrind", *plain, "--trace-children=yes", out, f"--log-file={folder}/%p.log"]


def read(folder: Path) -> Costs:
    """The instructions that all processes executed, without what they called."""
    costs: Counter = Counter()
    for path in sorted(folder.glob("*.callgrind*")):
        with path.open(encoding="utf-8", errors="replace") as lines:
            _add(lines, costs)
    return dict(costs)


def _add(lines, costs: Counter) -> None:
    binary = function = ""
    called = False  # the next line is what a call took, with all that it called
    for line in lines:
        if line.startswith("ob="):
            binary = line[3:].rstrip()
        elif line.startswith("fn="):
            function = line[3:].rstrip()
        elif line.startswith("calls="):
            called = True
        elif POSITION.match(line):
            if not called:
                address, *_, cost = line.split()
                costs[binary, function, int(address, 16)] += int(cost)
            called = False


def stacks(costs: Costs) -> dict[Stack, float]:
    """Instructions by stack, the outermost function first.

    Callgrind names DEEP callers and no more. Those further out are the usual ones of the outermost that it names, so
    that all stacks begin where the program does.
    """
    places = {binary: sorted({at for file, _, at in costs if file == binary}) for binary in {key[0] for key in costs}}
    named = {
        (binary, at): names for binary, addresses in places.items() for at, names in _named(binary, addresses).items()
    }
    usual = _usual_callers(costs)
    totals: Counter = Counter()
    for (binary, function, address), cost in costs.items():
        own, *callers = _whole(function.split("'"), usual)
        names = [short(name) for name in reversed(callers)]
        names += named.get((binary, address)) or [Path(binary).name if own.startswith("0x") else short(own)]
        totals[tuple(names)] += cost
    return dict(totals)


def _usual_callers(costs: Costs) -> dict[str, list[str]]:
    """The callers of each function, that under which it executes most first."""
    weights: dict[str, Counter] = {}
    for (_, function, _), cost in costs.items():
        for callee, caller in pairwise(function.split("'")):
            weights.setdefault(callee, Counter())[caller] += cost
    return {callee: [caller for caller, _ in counts.most_common()] for callee, counts in weights.items()}


def _whole(chain: list[str], usual: dict[str, list[str]]) -> list[str]:
    """A function and its callers up to `main`, or as far as they are known; a function stands in what is added once."""
    chain = list(chain)
    while chain[-1] != MAIN:
        caller = next((name for name in usual.get(chain[-1], []) if name not in chain), None)
        if caller is None:
            break
        chain.append(caller)
    return chain[: chain.index(MAIN) + 1] if MAIN in chain else chain


def _named(binary: str, addresses: list[int]) -> dict[int, list[str]]:
    """The functions of each address, the outermost first; {} for a file that does not say."""
    if not Path(binary).is_file():
        return {}
    request = "".join(f"{address:#x}\n" for address in addresses)
    try:
        done = subprocess.run(
            ["addr2line", "-a", "-f", "-i", "-C", "-e", binary],
            input=request,
            capture_output=True,
            text=True,
            timeout=600,
        )
    except (OSError, subprocess.TimeoutExpired):
        return {}
    functions: dict[int, list[str]] = {}
    lines = iter(done.stdout.splitlines())
    address = None
    for line in lines:
        if line.startswith("0x"):
            address = int(line, 16)
            functions[address] = []
        elif address is not None:
            next(lines, "")  # file and line
            if line != "??":
                functions[address].insert(0, short(line))
    return functions


def short(name: str) -> str:
    """The name of a function without its arguments, those of templates, and the type that it returns."""
    text = name.replace("(anonymous namespace)::", "").partition(" [clone")[0]
    text = LAMBDA.sub("lambda", text).replace(") const", ")")
    head, operator, tail = text.partition("operator")
    if operator and not tail[:1].isalnum() and tail[:1] != "_":
        symbol = OPERATOR.match(tail)[0]
        return _scope(head) + operator + symbol
    return _scope(text).partition("@@")[0] or name


def _scope(text: str) -> str:
    """The last word outside of brackets, without brackets: "Walker::chain" of "void Walker<double>::chain(int)"."""
    plain, deep = "", 0
    for letter in text:
        deep += letter in "<(["
        plain += letter if deep == 0 else ""
        deep -= letter in ">)]"
    return plain.rpartition(" ")[2]
