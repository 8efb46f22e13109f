"""Writes tables for LaTeX that fit into a text column, with numbers aligned at the decimal point."""

import re
import textwrap
from pathlib import Path

from harness.system import output
from reports.paper import compact, form

SIZE, EM, GAP = 8.0, 0.53, 3.0  # points of \footnotesize; width of a letter over it; points on each side of a column
POINT = 72.27 / form.INCH  # to a millimetre of LaTeX
LONGEST = 26  # letters of a line in a column of texts
KEYS = 2  # columns at most that each part of a wide table begins with: what its rows are
NUMBER = re.compile(r"([-−<≤≈]? ?\d[\d,]*)(\.\d+)?(?![\d.]*[A-Za-z_-])(.*)", re.DOTALL)
MARKS = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "$": r"\$", "&": r"\&", "#": r"\#", "_": r"\_", "%": r"\%",
    "^": r"\textasciicircum{}", "~": r"\textasciitilde{}", '"': "''", "…": r"\dots{}",
}  # fmt: skip
SIGNS = {
    "<": "<", ">": ">", "|": "|", "×": r"\times", "÷": r"\div", "µ": r"\mu", "μ": r"\mu", "·": r"\cdot",
    "∙": r"\cdot", "±": r"\pm", "°": r"^\circ", "−": "-", "≤": r"\leq", "≥": r"\geq", "≈": r"\approx",
    "∝": r"\propto", "∞": r"\infty", "√": r"\surd", "→": r"\rightarrow", "←": r"\leftarrow", "α": r"\alpha",
    "ε": r"\varepsilon", "✓": r"\surd", "✗": r"\times", "●": r"\bullet",
}  # fmt: skip
RAISED = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺ⁿˢ]+")
UP = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺ⁿˢ", "0123456789-+ns")


def escape(text: str) -> str:
    """Returns text that LaTeX shows unchanged. Letters of other scripts stay, which LuaLaTeX and XeLaTeX know."""
    text = "".join(
        rf"\ensuremath{{{SIGNS[letter]}}}" if letter in SIGNS else MARKS.get(letter, letter) for letter in text
    )
    return RAISED.sub(lambda match: rf"\textsuperscript{{{match[0].translate(UP)}}}", text)


def table(header: list[str], rows: list[list[str]], path: Path) -> None:
    """Writes a table of plain texts as one or more `tabular`, each within the width of a column (form.py).

    What is the same in all rows is said above them, reasons below, as in Markdown.
    """
    shared = compact.same(header, rows)
    above = "; ".join(f"{header[column]}: {text}" for column, text in shared.items())
    header, *rows = ([text for place, text in enumerate(line) if place not in shared] for line in [header, *rows])
    rows, notes = compact.with_notes(header, rows)
    columns = [Column(title, [row[place] for row in rows]) for place, title in enumerate(header)]
    room = form.current().column * POINT
    parts = "\n\n\\medskip\n\n".join(_tabular(part, len(rows)) for part in _parts(columns, room))
    said = [f"The same in all rows: {above}."] if above else []
    below = ["; ".join(f"({mark}) {reason}" for mark, reason in notes) + "."] if notes else []
    output.text(path, "\n\n".join([_head(path.name, len(rows)), *map(_text, said), parts, *map(_text, below)]) + "}\n")


def _head(name: str, rows: int) -> str:
    return (
        f"% {rows} rows, at most {form.current().column:g} mm wide; numbers are aligned at the point.\n"
        f"% In the preamble: \\usepackage{{booktabs}}. In the text, alone or in \\begin{{table}}: \\input{{{name}}}\n"
        f"{{\\footnotesize\\setlength{{\\tabcolsep}}{{{GAP:g}pt}}\\setlength{{\\parindent}}{{0pt}}\\raggedright"
    )


def _text(text: str) -> str:
    return f"\\parbox{{{form.current().column:g}mm}}{{\\raggedright {escape(text)}}}"


class Column:
    """A column: of numbers, which have two columns of LaTeX that meet at the point, or of texts, broken into lines."""

    def __init__(self, title: str, texts: list[str]):
        self.texts = texts
        matches = [NUMBER.fullmatch(text) for text in texts]
        self.numeric = 2 * sum(map(bool, matches)) > len(texts)
        self.halves = [(match[1], (match[2] or "") + match[3]) if match and self.numeric else None for match in matches]
        left = max((len(half[0]) for half in self.halves if half), default=0)
        right = max((len(half[1]) for half in self.halves if half), default=0)
        others = [text for text, half in zip(texts, self.halves, strict=True) if half is None]
        self.letters = max([left + right, *(min(len(text), LONGEST) for text in others)])
        self.letters = max(self.letters, *(len(word) for text in [title, *others] for word in text.split()), 1)
        self.title = textwrap.wrap(title, self.letters, break_long_words=False) or [""]

    @property
    def points(self) -> float:
        """The width with the gaps around it."""
        return self.letters * EM * SIZE + 2 * GAP

    @property
    def shape(self) -> str:
        return "r@{}l" if self.numeric else "l"

    def cells(self, row: int) -> list[str]:
        """Returns the lines of a cell, one below the other."""
        if half := self.halves[row]:
            left, right = map(escape, half)
            return [f"{left} &{'~' if right.startswith(' ') else ' '}{right.strip()}"]  # & takes a space that follows
        return [self.whole(line) for line in textwrap.wrap(self.texts[row], self.letters) or [""]]

    def whole(self, text: str) -> str:
        """Returns a text across the column."""
        return rf"\multicolumn{{2}}{{l}}{{{escape(text)}}}" if self.numeric else escape(text)


def _parts(columns: list[Column], room: float) -> list[list[Column]]:
    """Shares out columns to parts of at most `room` points, each with the columns that say what the rows are."""
    count = next((place for place, column in enumerate(columns) if column.numeric), 1)
    keys, parts = columns[: min(count, KEYS)], []
    for column in columns[len(keys) :]:
        if not parts or sum(each.points for each in [*parts[-1], column]) > room:
            parts.append(list(keys))
        parts[-1].append(column)
    return parts or [keys]


def _tabular(columns: list[Column], rows: int) -> str:
    lines = [rf"\begin{{tabular}}{{{''.join(column.shape for column in columns)}}}", r"\toprule"]
    lines += _lines([[column.whole(line) for line in column.title] for column in columns], columns, bottom=True)
    lines.append(r"\midrule")
    for row in range(rows):
        lines += _lines([column.cells(row) for column in columns], columns)
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}"])


def _lines(cells: list[list[str]], columns: list[Column], bottom: bool = False) -> list[str]:
    """Returns the lines of a row whose cells have several. bottom: those with fewer stand below."""
    high = max(map(len, cells))
    filled = []
    for cell, column in zip(cells, columns, strict=True):
        blank = [column.whole("")] * (high - len(cell))
        filled.append([*blank, *cell] if bottom else [*cell, *blank])
    return [" & ".join(line) + r" \\" for line in zip(*filled, strict=True)]
