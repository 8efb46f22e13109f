"""The report of a stranger's run: written, or an error that names the run; a browser does nothing that it says."""

import re
from html.parser import HTMLParser

import hostile
import matplotlib.pyplot as plt
import numpy as np
import pytest
from stored_run import facts, rows, write

from harness.errors import UserError
from reports.page import several

EVIL = "<script>alert(1)</script><img src=x onerror=alert(2)>[a](javascript:alert(3))`</style>\"'&"
SERIES = "t,cpu_s,rss_bytes\n0.0,0.0,1e6\n0.5,0.4,2e6\n1.5,1.0,3e6\n"
SEED = 3


def report(folder, out):
    (folder / "pictures").mkdir(exist_ok=True)
    (folder / "series").mkdir(exist_ok=True)
    picture = np.linspace(0, 1, 48).reshape(4, 4, 3)
    for name in ("cpp", "numba", "r.reference", "t.truth"):
        np.save(folder / "pictures" / f"{name}.npy", picture)
        (folder / "series" / f"{name}.csv").write_text(SERIES)
    try:
        return several.make([folder], out)
    finally:
        plt.close("all")


@pytest.mark.slow
@pytest.mark.parametrize("number", range(max(10, hostile.CASES // 1000)))
def test_of_a_bent_run(number, place):
    import random

    drawn = random.Random(f"{SEED} {number}")
    told, records = facts(), rows()
    what = told if drawn.randint(0, 1) else drawn.choice(records)
    hostile.bent(drawn, what)
    write(place / "run", told, records)
    try:
        report(place / "run", place / "out")
    except UserError as error:
        assert "run" in str(error)


class Page(HTMLParser):
    """Elements, with their attributes."""

    def __init__(self, text):
        super().__init__()
        self.elements = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))


def evil(told):
    """Every text of a tree with EVIL behind it, but for those that have to be of a form."""
    kept = {"region", "status", "pass", "format", "cell", "file", "series", "started", "point", "kind"}
    if isinstance(told, dict):
        return {key: value if key in kept or key.endswith("_file") else evil(value) for key, value in told.items()}
    if isinstance(told, list):
        return [evil(value) for value in told]
    return told + EVIL if isinstance(told, str) and told else told


@pytest.mark.slow
def test_no_text_does_anything(place):
    """Title, scenes, keys and values of points, reasons, warnings, versions, devices, hosts, commands: all of them."""
    told, records = evil(facts()), evil(rows())
    told["command"] = facts()["command"]
    for place_of in (told["cells"], records):
        for row in place_of:
            row["point"] = {f"depth{EVIL}": f"3{EVIL}"}
            row["cell"] = re.sub(r"\W", "", row["cell"])
    told["pair"]["cell"] = told["cells"][0]["cell"]
    for row, plain in zip(records, rows(), strict=True):
        if plain["picture"]:
            row["picture"]["sha256"] = plain["picture"]["sha256"]  # a row with another text there is refused
    write(place / "run", told, records)
    page = report(place / "run", place / "out").read_text("utf-8")
    write(place / "plain", facts(), rows())
    plain = report(place / "plain", place / "plain-out").read_text("utf-8")
    found = Page(page)
    assert len([tag for tag, _ in found.elements if tag == "script"]) == len(re.findall("<script", plain))
    assert not [told for _, told in found.elements if any(key.startswith("on") for key in told)]
    addresses = [told[key] for _, told in found.elements for key in ("href", "src") if told.get(key)]
    assert not [address for address in addresses if re.match(r"\s*(javascript|vbscript|data:text)", address, re.I)]
    assert all(told.get("src", "data:image/").startswith("data:image/") for tag, told in found.elements if tag == "img")
