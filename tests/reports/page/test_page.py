"""report.html: one file that asks for nothing, shows others' text as text, and keeps its size."""

import base64
import hashlib
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from made_up_errors import FACTS

from reports import page
from reports.page import report

EVIL = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"


class Reader(HTMLParser):
    """All elements with their attributes, and the text of scripts."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.scripts, self.text, self._script = [], [], [], False
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        self._script = tag == "script"
        if self._script:
            self.scripts.append("")

    def handle_endtag(self, tag):
        self._script = self._script and tag != "script"

    def handle_data(self, data):
        if self._script:
            self.scripts[-1] += data
        else:
            self.text.append(data)

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture
def read(make_run, tmp_path):
    """read(records, **facts): the page of their report, and its data."""

    def read(records, **facts):
        path = report.write(make_run(records, **facts), tmp_path / "report")
        assert path.name == "report.html" and path.stat().st_size < page.LIMIT
        reader = Reader(path.read_text("utf-8"))
        return reader, json.loads(reader.scripts[0])

    return read


@pytest.fixture
def told(cell, bad):
    """Records of two methods, and of one that failed."""
    good = [*cell("cpp", [1, 1.1, 1.2], 0.01, False), *cell("numba", [2, 2.1, 2.2], 0.001, False, cutoff=2.0**-9)]
    return [*good, bad("numpy", "failed", "no", scene=good[0]["scene"], parameters=good[0]["parameters"])]


def test_it_asks_for_nothing(read, told):
    reader, _ = read(told, **FACTS)
    (policy,) = [meta["content"] for meta in reader.all("meta") if meta.get("http-equiv") == "Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; img-src data: blob:; ")
    assert all("src" not in script for script in reader.all("script")) and not reader.all("link")
    assert all(image.get("src", "data:image/").startswith("data:image/") for image in reader.all("img"))
    links = [link["href"] for link in reader.all("a")]
    assert all(re.match(r"#|[\w.-]+$", link) for link in links), links
    allowed = {base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in reader.scripts[1:]}
    assert set(re.findall(r"'sha256-(.*?)'", policy)) == allowed and len(allowed) == 2


def test_every_section_is_there_and_can_be_jumped_to(read, told, tmp_path):
    reader, _ = read(told, **FACTS)
    headings = re.findall(r"^## (.*)$", (tmp_path / "report" / "report.md").read_text(), re.MULTILINE)
    anchors = [box["id"] for box in reader.all("details") if box.get("class") == "section"]
    assert headings[0] == "At a glance" and len(reader.all("h2")) == len(anchors), "the first screen has no heading"
    assert len(anchors) == len(set(anchors)) == len(headings) - 1 > 10
    links = [link["href"][1:] for link in reader.all("a") if link["href"].startswith("#s")]
    assert links[-len(anchors) :] == anchors and set(links) == set(anchors)
    assert [anchor.split("-", 1)[1] for anchor in anchors[:2]] == ["summary", "speed-against-accuracy"]
    assert {"speed-against-accuracy", "machine-the-study-s-table-2-1", "provenance"} <= {
        a.split("-", 1)[1] for a in anchors
    }


def test_figures_are_inside_and_have_their_size(read, told):
    reader, _ = read(told, **FACTS)
    figures = [image for image in reader.all("img") if image.get("class") == "figure"]
    assert len(figures) >= 4
    for figure in figures:
        assert int(figure["width"]) > 100 and int(figure["height"]) > 50 and figure["alt"], figure["alt"]


def test_the_text_of_others_is_text(read, cell, bad):
    records = [*cell(f"cpp{EVIL}", [1, 1.1], 0.01, False), *cell("numba", [1, 2], 0.1, False, cutoff=0.5)]
    same = {key: records[0][key] for key in ("scene", "parameters")}
    records.append(bad(f"python{EVIL}", "failed", f"reason {EVIL}", **same))
    for record in records:
        record["cell"] = re.sub("[^a-z0-9]", "", record["cell"])[:20]
        record["picture"] = record["series"] = None
    plain, _ = read(
        [*cell("cpp", [1, 1.1], 0.01, False), *cell("numba", [1, 2], 0.1, False, cutoff=0.5)], **FACTS, name="plain"
    )
    reader, data = read(records, **FACTS, title=f"title {EVIL}", name="evil")
    assert len(reader.scripts) == len(plain.scripts) == 3
    assert not [attributes for _, attributes in reader.elements if any(key.startswith("on") for key in attributes)]
    assert all(image.get("src") != "x" for image in reader.all("img"))
    assert data["pareto_figure"]["charts"][0]["points"][0]["variant"] == f"cpp{EVIL}"
    assert EVIL in "".join(reader.text)


def test_the_chart_has_what_the_figure_has(read, told):
    _, data = read(told, **FACTS)
    (chart,) = data["pareto_figure"]["charts"]
    cpp, numba = chart["points"]
    assert (cpp["error"], cpp["time"][0], cpp["number"], cpp["share"]) == (0.01, 1.1, 1, 1.0)
    assert (numba["error"], numba["time"][0], numba["number"]) == (0.001, 2.1, 2)
    assert chart["front"] == [0, 1] and chart["lacking"] == 1
    words = data["pareto_figure"]["words"]
    again = " ".join(words[place] for place in cpp["again"])
    assert cpp["told"][3] == "3.00 MB (no interval, n = 3)" and again.startswith(
        "rayrace run experiments/a.toml --only cpp"
    )
    assert data["images"][cpp["picture"]].startswith("data:image/webp;base64,")


def test_pictures_to_compare(make_run, tmp_path, record):
    rng = np.random.default_rng(3)
    picture = rng.uniform(0, 1, (4, 4, 3))
    files = {"pictures/cpp.npy": picture, "pictures/numba.npy": picture + 1e-6}
    path = report.write(make_run([record("cpp"), record("numba")], files=files), tmp_path / "report")
    data = json.loads(Reader(path.read_text("utf-8")).scripts[0])
    (place,) = data["pictures_figure"]["places"]
    one, two, truth = place["pictures"]
    assert [one["label"], two["label"], truth["label"]] == ["cpp", "numba", "the truth"] and one["size"] == [4, 4]
    assert truth["truth"] and truth["error"] is None and truth["picture"] != one["picture"]
    assert truth["told"] == ["by judge, 1024 samples of a pixel, depth 16, known to 0.001 (RMS)"]
    assert one["told"][-1] == "agreement ✓ outside a mask of 25 % of the pixels"
    assert one["picture"] == two["picture"] != one["error"], "equal to the eye: inside the page once"
    assert one["flip"] is None and {one["error"], two["error"]} <= set(data["images"])


def test_curves_over_time(read, record):
    series = "t,cpu_s,rss_bytes,vms_bytes\n" + "".join(f"{n / 100},{n / 100},{1e6 * n},2e6\n" for n in range(1, 1001))
    _, data = read([record("cpp", wall_s=10.0)], files={"series/cpp.csv": series})
    (told,) = data["cpu_figure"]["places"][0]["processes"]
    assert data["cpu_figure"]["kinds"] == ["CPU use (% of one core)", "resident memory (MB)", "address space (MB)"]
    t, memory = told["curves"]["resident memory (MB)"]
    assert len(t) <= 150 and (t[0], t[-1], memory[0], memory[-1]) == (0.01, 10, 1, 1000)
    assert told["curves"]["CPU use (% of one core)"][1] == pytest.approx(
        [100] * len(told["curves"]["CPU use (% of one core)"][1])
    )


def test_what_has_no_room_is_told(make_run, tmp_path, record):
    """Noise, which no format makes small."""
    rng = np.random.default_rng(4)
    names = [f"v{n}" for n in range(12)]
    files = {f"pictures/{name}.npy": rng.uniform(0, 1, (400, 400, 3)) for name in names}
    files["pictures/r.reference.npy"] = rng.uniform(0, 1, (400, 400, 3))
    parameters = record("x")["parameters"] | {"width": 400, "height": 400, "region": "0,0,400,400"}
    run = make_run([record(name, parameters=parameters) for name in names], files=files)
    path = report.write(run, tmp_path / "report")
    text = path.read_text("utf-8")
    assert path.stat().st_size < page.LIMIT
    data = json.loads(Reader(text).scripts[0])
    (place,) = data["pictures_figure"]["places"]
    held = [one for one in place["pictures"] if not one["truth"]]
    assert 0 < len(held) < 12
    assert f"This page holds {len(held)} of 12 pictures" in text


def test_many_points_are_thinned_and_the_front_is_kept(cell, load, monkeypatch):
    monkeypatch.setattr(page.chart, "MOST", 30)
    monkeypatch.setattr(page.chart, "MOST_SEEN", 5)
    rng = np.random.default_rng(5)
    told = [row for n in range(60) for row in cell("cpp", [rng.uniform(1, 9)], rng.uniform(0.01, 1), False, seed=n)]
    found = page.chart.data(load(told, **FACTS), page.Embedded(10**6))
    (chart,) = found["charts"]
    assert len(chart["points"]) == 30 and sum(point["picture"] is not None for point in chart["points"]) <= 5
    numbers = [chart["points"][n]["number"] for n in chart["front"]]
    assert numbers == list(range(1, len(numbers) + 1)) and len(numbers) > 2
    assert "Shown are 30 of 60 points" in found["says"] and "points have a picture" in found["says"]
