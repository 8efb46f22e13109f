"""A number with a unit in README, docs and notes is made from a stored run, or docs/numbers.toml names why not."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# These are written whole by a script, and a test holds each to it.
WRITTEN = {"docs/the-study.md": "docs/study.py"}
PAGES = sorted(
    str(path.relative_to(ROOT))
    for path in (ROOT / "README.md", *ROOT.glob("docs/*.md"), *ROOT.glob("renderers/*/NOTES.md"))
    if str(path.relative_to(ROOT)) not in WRITTEN
)
EXCEPTIONS = tomllib.loads((ROOT / "docs" / "numbers.toml").read_text("utf-8"))
KINDS = EXCEPTIONS.pop("kinds")

TIME = r"ns|µs|ms|s|seconds?|min|minutes?|hours?"
AMOUNT = r"bytes|[kMG]B|[KMG]iB|registers|cycles|GFLOPS?|GHz|MHz|W|J|fps"
NUMBER = r"\d[\d,]*(?:\.\d+)?(?:e-?\d+)?"
UNIT = rf"\s?(?:%|×(?!\s?\d)|(?:{TIME}|{AMOUNT}|times)\b)"
INTERVAL = rf" \\?\[-?{NUMBER}, -?{NUMBER}\\?\]"
MEASURED = re.compile(rf"(?<![\w.^-]){NUMBER}{UNIT}|(?<![\w.^])-?{NUMBER}{INTERVAL}")
# Code, and tables made by docs/tables.py, which test_tables.py holds.
OTHER = re.compile(r"<!-- table: .*?<!-- end -->|```.*?```|`[^`\n]*`", re.DOTALL)


def blanked(text: str, spans: list[tuple[int, int]]) -> str:
    """Returns the text with spaces in place of these parts; lines and places stay."""
    for start, end in spans:
        text = text[:start] + re.sub(r"[^\n]", " ", text[start:end]) + text[end:]
    return text


def sections(text: str, title: str) -> list[tuple[int, int]]:
    """Returns where the sections of this title begin and end."""
    pattern = rf"^(#+) {re.escape(title)}\n.*?(?=^#|\Z)"
    return [found.span() for found in re.finditer(pattern, text, re.DOTALL | re.MULTILINE)]


def excepted(page: str, text: str) -> list[tuple[str, str, list[tuple[int, int]]]]:
    """Returns kind, phrase and places of each exception of a page."""
    found = []
    for kind, phrases in EXCEPTIONS.get(page, {}).items():
        for phrase in phrases:
            words = r"\s+".join(map(re.escape, phrase.split()))
            spans = (
                sections(text, phrase.removeprefix("# "))
                if phrase.startswith("# ")
                else [each.span() for each in re.finditer(words, text)]
            )
            found.append((kind, phrase, spans))
    return found


def unnamed(page: str, text: str) -> list[str]:
    """Returns the numbers with units that no exception covers, each with its line."""
    spans = [span for _, _, places in excepted(page, text) for span in places]
    left = blanked(text, [found.span() for found in OTHER.finditer(text)] + spans)
    lines = (text.count("\n", 0, found.start()) + 1 for found in MEASURED.finditer(left))
    return [f"{page}:{line}: {found[0]}" for line, found in zip(lines, MEASURED.finditer(left), strict=True)]


@pytest.mark.parametrize("page", PAGES)
def test_every_number_has_its_run_or_its_reason(page):
    found = unnamed(page, (ROOT / page).read_text("utf-8"))
    remedy = "make them from a stored run (docs/tables.py), or name them in docs/numbers.toml"
    assert not found, f"numbers without a run: {remedy}\n" + "\n".join(found)


@pytest.mark.parametrize("page", sorted(EXCEPTIONS))
def test_every_exception_is_of_a_kind_and_on_its_page(page):
    text = (ROOT / page).read_text("utf-8")
    for kind, phrase, spans in excepted(page, text):
        assert kind in KINDS, f"{page}: no kind of exception: {kind}"
        assert spans, f"{page}: the exception is not on the page: {phrase}"
        within = [place for start, end in spans for place in MEASURED.finditer(text[start:end])]
        assert within, f"{page}: the exception has no number with a unit: {phrase}"


@pytest.mark.parametrize("page", sorted(EXCEPTIONS))
def test_what_holds_or_prints_a_number_is_there(page):
    for kind, phrases in EXCEPTIONS[page].items():
        files = phrases.values() if isinstance(phrases, dict) else ()
        assert (kind in ("held", "printed")) == isinstance(phrases, dict)
        assert all((ROOT / file).is_file() for file in files), f"{page}: {kind}: a file is not there: {list(files)}"


def test_trials_are_in_notes_alone():
    assert [page for page, kinds in EXCEPTIONS.items() if "trial" in kinds and not page.endswith("NOTES.md")] == []


def test_pages_that_a_script_writes_exist():
    assert all((ROOT / page).is_file() and (ROOT / script).is_file() for page, script in WRITTEN.items())


@pytest.mark.parametrize(
    "number",
    [
        "12 %",
        "0.5 s",
        "3.2 times",
        "1.44 ×",
        "48 registers",
        "0.81 [0.79, 0.86]",
        "-0.75 [-0.81, -0.70]",
        "1,024 bytes",
        "2e-3 s",
        "66 GFLOP",
    ],
)
def test_a_number_is_found(number):
    assert unnamed("README.md", f"Before\nit takes {number}, they say.\n") == [f"README.md:2: {number}"]
    assert unnamed("README.md", f"`{number}`\n```\n{number}\n```\n<!-- table: x -->\n{number}\n<!-- end -->\n") == []


@pytest.mark.parametrize(
    "text", ["512 × 512", "8 x 8 pixels", "depth 10", "rule SPH-1 s", "v1.2 s", "float32", "2^-10 %"]
)
def test_what_is_no_measured_number_is_not(text):
    assert unnamed("README.md", text) == []
