"""A hook of mkdocs: the pages of the site are files of the repository, at the paths that they have there.

So a link between two of them works in the repository and on the site.
"""

import re
from pathlib import Path

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
LINK = re.compile(r"\]\(([^)#:]+)")  # to a file: no address, no anchor alone


def on_files(files, config):
    """The pages of the nav with what they link to, and what the theme brings."""
    wanted = set(_pages(config["nav"]))
    for page in sorted(wanted):
        text = (ROOT / page).read_text("utf-8")
        linked = {(ROOT / page).parent.joinpath(link).resolve() for link in LINK.findall(text)}
        wanted |= {str(path.relative_to(ROOT)) for path in linked if path.is_file() and path.is_relative_to(ROOT)}
    kept = [file for file in files if not (ROOT / "docs" / file.src_uri).exists()]
    made = [File(path, str(ROOT), config["site_dir"], config["use_directory_urls"]) for path in sorted(wanted)]
    return Files([*kept, *made])


def _pages(nav):
    for entry in nav:
        for value in entry.values():
            yield from _pages(value) if isinstance(value, list) else [value]
