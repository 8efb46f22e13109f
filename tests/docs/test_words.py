"""One meaning of a word: an error is the distance from the truth of the scene, agreement a gate (ERR-1, ERR-2)."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = "README.md", "CONTRIBUTING.md", "renderers/SPEC.md", "docs/*.md", "experiments/*.toml"
PROGRAMS = "reports/**/*.py", "rayrace/*.py", "reports/page/page.js", "reports/*/*.jinja"
ERROR = r"\b(?:errors?|RMSE|FLIP|SSIM|PSNR)\b"
OTHER = r"(?:(?:the|a|its|another|other) )?(?:(?<!\[)reference|twin|judge|other renderer|another renderer)"
FORBIDDEN = {
    "an error is not from a reference": [
        rf"{ERROR}[^.;|]{{0,110}}\b(?:from|against|to|with|beside)\b [^.:;|]{{0,40}}{OTHER}",
        rf"{OTHER}(?:'s)? [^.:;|]{{0,20}}{ERROR}",
    ],
    "an error is over all pixels": [
        rf"{ERROR}s? (?:outside|inside) (?:the|it|its|of)",
        r"error_max_outside|rmse_outside",
    ],
    "an error needs no word for the truth beside it": [
        r"(?:RMSE|errors?)[^.;|]{0,30} (?<!held )(?:against|to) the truth"
    ],
    "what a cut-off or an arithmetic changes is no error": [
        r"error ÷ bound",
        r"bound of (?:its|the) error",
        r"cut-off[^.|]{0,40}\berrs\b",
        r"median error",
        r"errors? (?:of|in) (?:float32|relaxed)",
    ],
    "how far a model is off is no error": [r"error of \{\}|relative error of (?:a|each) model"],
    "old columns": [r"\blargest_error\b|\btruth_pictures\b|agreement_outside_mask|\bmax_inside\b|\bno_ssim\b"],
}
# A sentence that says what an error is not, or tells agreement beside it; the truth of hits is another renderer's.
SAYS_SO = re.compile(r"\bnot? |\bnor\b|agree|a tick|hits")
# What the reports said before.
RELAPSES = [
    "Errors are differences in linear RGB from the reference, which another renderer made, over all pixels",
    "Errors are over all pixels, in linear RGB, from the float64 picture of another renderer: RMSE, the largest",
    "error against the truth: RMSE, linear RGB",
    "error against the truth (RMSE, linear RGB)",
    "Error: RMSE over all pixels against the truth, linear RGB",
    "error outside the mask",
    "FLIP: the mean difference beside the reference",
    "largest error of A from another renderer's picture",
    "The error of a pixel is the largest absolute difference in any channel of linear RGB from another renderer's",
    "error ÷ bound",
    "A picture with a cut-off comes with a proven bound of its error, pixel by pixel",
    "a cut-off of 2^-10 keeps 20 % of the rays and errs by 0.0009 at most",
    "the reference's errors",
    "standard_error,truth_pictures,error_max_outside",
    "median error of a bounce's light (linear RGB)",
    "Draws errors of float32 and relaxed arithmetic by depth of reflection",
]


def faults(text):
    """The forbidden phrases in a text, each with its rule; not those of a sentence that says what an error is not."""
    flat = " ".join(text.split())
    for rule, patterns in FORBIDDEN.items():
        for pattern in patterns:
            for found in re.finditer(pattern, flat, re.IGNORECASE):
                start = max(flat.rfind(mark, 0, found.start()) for mark in (". ", "; ", "| ")) + 1
                end = min(
                    (at for mark in (". ", "; ", "| ") if (at := flat.find(mark, found.end())) >= 0), default=None
                )
                if not SAYS_SO.search(flat[start:end]):
                    yield f"{rule}: {found[0]}"


def strings(file):
    """The texts of a Python file: docstrings, captions, titles, labels, names of columns; values are {}."""
    tree = ast.parse(file.read_text("utf-8"))
    inside = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inside:
            yield node.value


def texts(file):
    if file.suffix == ".py":
        return strings(file)
    return re.split(r"\n\s*\n|\n(?=[-|#])", file.read_text("utf-8"))


def files(*patterns):
    found = sorted(file for pattern in patterns for file in ROOT.glob(pattern))
    return [pytest.param(file, id=str(file.relative_to(ROOT))) for file in found]


@pytest.mark.parametrize("text", RELAPSES)
def test_a_relapse_is_noticed(text):
    assert list(faults(text))


@pytest.mark.parametrize("file", files(*PAGES, *PROGRAMS))
def test_an_error_is_the_distance_from_the_truth(file):
    assert [fault for text in texts(file) for fault in faults(text)] == []


@pytest.mark.parametrize("command", ["run", "render", "report", "compare", "export", "trace", "check"])
def test_the_help_says_the_same(rayrace, command):
    assert list(faults(rayrace(command, "--help", code=0).stdout)) == []
