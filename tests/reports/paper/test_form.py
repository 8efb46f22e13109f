"""Figures and tables have the width that is asked for, and letters that can be read there."""

import re
import shutil
import subprocess
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from figure_lint import texts
from PIL import Image

from harness.errors import UserError
from harness.store import packed
from reports import page
from reports.page import report, several
from reports.paper import form, latex, style

RUNS = Path(__file__).parents[3] / "results" / "reference"
FAR = "emerald-rapids-2x/gallery", "epyc-2x/accuracy", "cascade-lake-2x/stability", "h200-16x/gpu"


def _chart():
    figure, axes = plt.subplots(figsize=(9.3, 3.1), layout="constrained")
    axes.plot([1, 2, 3], [3, 1, 2], label="50 % of a_b & c")
    axes.set_xlabel("time (µs), 10⁻³ ≤ x", fontsize=3)
    axes.tick_params(labelsize=4)
    axes.legend(fontsize=5)
    return figure


def _points(figure) -> float:
    """Returns the size of the smallest letters of a drawn figure where it is as wide as a text column."""
    figure.canvas.draw()
    return min(text.get_size() for text in texts(figure)) * form.COLUMN / form.INCH / figure.get_figwidth()


def _wide(path: Path) -> float:
    """Returns the width of a file of a figure, mm."""
    if path.suffix == ".png":
        with Image.open(path) as opened:
            return opened.width / opened.info["dpi"][0] * form.INCH
    patterns = {".svg": rb'<svg [^>]*width="([\d.]+)pt"', ".pdf": rb"/MediaBox \[ 0 0 ([\d.]+)", ".pgf": rb"% (\d+) mm"}
    value = float(re.search(patterns[path.suffix], path.read_bytes())[1])
    return value if path.suffix == ".pgf" else value / 72 * form.INCH


@pytest.mark.parametrize(("text", "width"), [("thesis", 150), ("slides", 300), ("87.5", 87.5)])
def test_all_files_of_a_figure_have_the_width(text, width, tmp_path):
    with form.written_in(form.parse(text)):
        style.figure(tmp_path / "chart", "", _chart)
    files = sorted(path for path in tmp_path.iterdir() if path.suffix != ".json")
    assert [path.suffix for path in files] == [".pdf", ".pgf", ".png", ".svg"]
    assert [_wide(path) for path in files] == [pytest.approx(width, abs=0.51 if path.suffix == ".pgf" else 0.1)
                                               for path in files]  # fmt: skip
    assert b"/Type3" not in (tmp_path / "chart.pdf").read_bytes()
    pgf = (tmp_path / "chart.pgf").read_text("utf-8")
    assert r"50 \% of a\_b \& c" in pgf and r"\textsuperscript{-3}" in pgf and "\\input{chart.pgf}" in pgf


def test_a_page_has_figures_as_they_are_drawn_and_no_pgf(tmp_path):
    style.figure(tmp_path / "chart", "", _chart)
    assert {path.suffix for path in tmp_path.iterdir()} == {".png", ".svg", ".pdf", ".json"}
    assert _wide(tmp_path / "chart.pdf") == pytest.approx(9.3 * form.INCH)


def test_small_letters_are_raised():
    with style.styled():
        figure = _chart()
        assert _points(figure) < 3
        form.legible(figure)
        assert _points(figure) == pytest.approx(form.LEAST)
    plt.close(figure)


@pytest.mark.slow
@pytest.mark.parametrize("run", FAR)
def test_no_letter_of_a_report_is_too_small_in_a_column(run, tmp_path, monkeypatch):
    sizes = {}

    def measured(figure, path):
        sizes[path.name] = _points(figure)
        plt.close(figure)

    monkeypatch.setattr(style, "save", measured)
    monkeypatch.setattr(page, "write", lambda *_: None)
    with packed.opened(RUNS / f"{run}.tar.xz") as folder:
        report.write(folder, tmp_path / "report")
    assert sizes and {name: size for name, size in sizes.items() if size < form.LEAST - 1e-6} == {}


@pytest.mark.parametrize("text", ["thesi", "0", "-150", "nan", "inf", "1e9", ""])
def test_what_is_no_form_is_refused(text):
    with pytest.raises(UserError, match="give page, thesis, slides, or a width from 50 to 1000"):
        form.parse(text)


def test_numbers_are_aligned_at_the_point_and_texts_are_not(tmp_path):
    rows = [["a_1", "12.5 [12.1, 13.0] ms", "ok"], ["b", "233 [229, 235] ns", "failed: 3 < 4 & x"]]
    latex.table(["who", "steady frame", "status"], rows, tmp_path / "t.tex")
    text = (tmp_path / "t.tex").read_text("utf-8")
    assert "% In the preamble: \\usepackage{booktabs}" in text.splitlines()[1] and "\\begin{tabular}{lr@{}ll}" in text
    assert "a\\_1 & 12 & .5 [12.1, 13.0] ms & ok" in text and "b & 233 &~[229, 235] ns & " in text
    assert r"3 \ensuremath{<} 4 \& x" in text and r"\multicolumn{2}{l}{steady frame}" in text


def test_a_wide_table_comes_in_parts_that_name_their_rows(tmp_path):
    header = ["who", *(f"number {place}" for place in range(12))]
    rows = [[name, *(f"{place}.{place} [{place}.1, {place}.9] ms" for place in range(12))] for name in ("one", "two")]
    rows[1][1:] = [text.replace("ms", "s") for text in rows[1][1:]]
    for width in (80.0, 150.0, 300.0):
        with form.written_in(form.Form(width)):
            latex.table(header, rows, tmp_path / "t.tex")
        text = (tmp_path / "t.tex").read_text("utf-8")
        parts = text.count("\\begin{tabular}{lr@{}l")
        letters = 25 * latex.EM * latex.SIZE + 2 * latex.GAP  # of a column of numbers, at most
        assert parts >= 12 * 0.7 * letters / (width * latex.POINT) and text.count("\none &") == parts


@pytest.mark.slow
def test_latex_takes_a_report(tmp_path):
    if not shutil.which("pdflatex"):
        pytest.skip("no program pdflatex (apt install texlive-latex-recommended texlive-pictures)")
    out = tmp_path / "out"
    several.make([RUNS / "epyc-2x" / "comparison.tar.xz"], out, shape=form.parse("thesis"))
    parts = [rf"\input{{{path.name}}}\clearpage" for path in sorted([*out.glob("*.tex"), *out.glob("*.pgf")])]
    assert len(parts) > 5
    head = (
        "\\documentclass{article}\\usepackage[textwidth=150.1mm,textheight=290mm,paperheight=330mm]{geometry}"
        "\\usepackage{booktabs,pgf}\\setlength{\\parindent}{0pt}\\begin{document}"
    )
    (out / "all.tex").write_text("\n".join([head, *parts, "\\end{document}"]))
    words = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "all.tex"]
    done = subprocess.run(words, cwd=out, capture_output=True, text=True, errors="replace")
    assert done.returncode == 0, done.stdout[-3000:]
    assert "Overfull \\hbox" not in done.stdout
