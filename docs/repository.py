"""A hook of mkdocs: the pages of the site are files of the repository, at the paths that they have there.

So a link between two of them works in the repository and on the site. Beside them are the reports of the reference
results, made here.
"""

import re
from itertools import count
from pathlib import Path

from mkdocs.structure.files import File, Files

from reports.page import index

ROOT = Path(__file__).parents[1]
LINK = re.compile(r"\]\(([^)#:]+)")  # to a file: no address, no anchor alone
REFERENCE = "results/reference"
MADE = ROOT / "build" / "reference"  # kept from one build to the next, which makes only what has changed
TO_REPORTS = "\n\n[Their reports](reports/index.html), with the result of each at a glance.\n\n"


def on_files(files, config):
    """The pages of the nav with what they link to, what the theme brings, and the reports of the reference results."""
    wanted = set(_pages(config["nav"]))
    for page in sorted(wanted):
        text = (ROOT / page).read_text("utf-8")
        linked = {(ROOT / page).parent.joinpath(link).resolve() for link in LINK.findall(text)}
        wanted |= {str(path.relative_to(ROOT)) for path in linked if path.is_file() and path.is_relative_to(ROOT)}
    kept = [file for file in files if not (ROOT / "docs" / file.src_uri).exists()]
    made = [File(path, str(ROOT), config["site_dir"], config["use_directory_urls"]) for path in sorted(wanted)]
    return Files([*kept, *made, *_reports(config)])


def _reports(config):
    runs = len(index.runs(ROOT / REFERENCE, MADE / REFERENCE / "reports")[0])
    done = count(1)
    index.make(
        ROOT / REFERENCE,
        MADE / REFERENCE / "reports",
        say=lambda text: print(f"[{next(done)} of {runs} at most] {text}", flush=True),
    )
    found = (path for path in sorted(MADE.rglob("*")) if path.is_file() and path.suffix not in ("", ".md"))
    return [File(path.relative_to(MADE).as_posix(), str(MADE), config["site_dir"], False) for path in found]


def on_page_markdown(markdown, page, config, files):
    """On the page of the reference results a link to their reports, which are only on the site."""
    if page.file.src_uri != f"{REFERENCE}/README.md":
        return markdown
    title, _, text = markdown.partition("\n")
    return title + TO_REPORTS + text


def _pages(nav):
    for entry in nav:
        for value in entry.values():
            yield from _pages(value) if isinstance(value, list) else [value]
