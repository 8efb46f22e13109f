"""report.html in a real browser without a network, at the width of a desk and of a hand: what shows, what moves."""

import io
import re
import shutil
import time

import numpy as np
import pytest
from made_up_errors import FACTS
from PIL import Image

from reports.page import LIMIT, index, report

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
PATIENCE = 60.0  # s, where the page is about to do something: it takes a moment, or long on a busy machine
QUIET = ("--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run")


@pytest.fixture(scope="module")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright")
    if CHROMIUM is None:
        pytest.skip("no Chromium here (Debian: apt install chromium)")
    with sync_api.sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--disable-gpu", *QUIET]
        made = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments, timeout=2000 * PATIENCE)
        yield made
        made.close()


@pytest.fixture
def visit(browser):
    """visit(path, width): the page, which may ask for nothing and complain of nothing."""
    opened, heard = [], []

    def visit(path, width, scheme="light"):
        context = browser.new_context(viewport={"width": width, "height": 900}, offline=True, color_scheme=scheme)
        opened.append(context)
        context.set_default_timeout(2000 * PATIENCE)
        page = context.new_page()
        page.on("console", lambda message: heard.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: heard.append(str(error)))
        page.on(
            "request", lambda asked: heard.append(asked.url) if not asked.url.startswith(("data:", "file:")) else None
        )
        page.goto(path.as_uri())
        return page

    yield visit
    assert heard == []
    for context in opened:
        context.close()


@pytest.fixture(scope="module")
def once():
    """once(name, write): what `write` returns, called once for all tests of this file."""
    made = {}

    def find(name, write):
        if name not in made:
            made[name] = write()
        return made[name]

    return find


@pytest.fixture
def path(once, make_run, cell, tmp_path):
    """A report with a chart, pictures and series."""
    return once("path", lambda: _with_pictures(make_run, cell, tmp_path))


def _with_pictures(make_run, cell, tmp_path):
    rng = np.random.default_rng(2)
    told, files = [], {}
    for name, error, time_s, exponent in (("cpp", 0.01, 1.0, 5), ("numba", 0.001, 2.0, 9), ("python", 0.02, 50.0, 5)):
        told += cell(name, [time_s, 1.1 * time_s, 1.2 * time_s], error, False, cutoff=2.0**-exponent)
        files[told[-1]["picture"]["file"]] = np.clip(rng.uniform(0, 1, (60, 80, 3)) ** 2 + error, 0, 1)
        files[f"series/{name}.csv"] = "t,cpu_s,rss_bytes\n0,0,1e6\n0.5,0.4,2e6\n1,0.9,3e6\n1.5,1.4,3e6\n"
    for row in told:
        row["series"] = f"series/{row['variant']}.csv"
        row["parameters"] = row["parameters"] | {"width": 80, "height": 60, "region": "0,0,80,60"}
    files |= dict.fromkeys(("pictures/r.reference.npy", "pictures/t.npy"), np.full((60, 80, 3), 0.5))
    return report.write(make_run(told, files=files, **FACTS), tmp_path / "report")


@pytest.fixture
def race(once, make_run, cell, tmp_path):
    """A report of twelve methods of six variants, five processes each, with pictures."""
    return once("race", lambda: _of_many_methods(make_run, cell, tmp_path))


def _of_many_methods(make_run, cell, tmp_path):
    told, files = [], {}
    for n, name in enumerate(("cpp", "numba", "numpy", "python", "numba-parallel", "cpp-threads")):
        for vector, speed in (("off", 1.0), ("on", 8.0)):
            times = [0.02 * 3**n / speed * (1 + 0.01 * k) for k in range(5)]
            told += cell(name, times, 0.01, False, vector=vector)
            files[told[-1]["picture"]["file"]] = np.random.default_rng(n).uniform(0, 1, (60, 80, 3))
    for row in told:
        row["parameters"] = row["parameters"] | {"width": 80, "height": 60, "region": "0,0,80,60"}
    return report.write(make_run(told, name="race", files=files, **FACTS), tmp_path / "race-report")


def until(page, condition):
    """Wait until an expression is true. (The page's policy lets it evaluate no text itself.)"""
    end = time.monotonic() + PATIENCE
    while not page.evaluate(condition):
        assert time.monotonic() < end, f"never true: {condition}"
        page.wait_for_timeout(100)


def processor_s(page):
    """Processor time of the page's process so far, s."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable")
    found = {one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]}
    return found["ProcessTime"]


def centre(page, number):
    """Where a point of the chart is drawn."""
    box = page.locator("#chart-plot .scatterlayer .points path").nth(number).bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


WIDTHS, SCHEMES = pytest.mark.parametrize("width", [1280, 390]), pytest.mark.parametrize("scheme", ["light", "dark"])


def wide(page):
    return page.evaluate("document.documentElement.scrollWidth")


def opened(page, selector):
    """Open the section that holds an element, and what else holds it."""
    page.evaluate(f"""(() => {{ let box = document.querySelector('{selector}');
        while (box = box.parentElement.closest('details')) box.open = true; }})()""")
    page.wait_for_timeout(200)


def brightness(page, selector, what="color"):
    """Of a colour of an element, 0 to 255."""
    text = page.evaluate(f"getComputedStyle(document.querySelector('{selector}')).getPropertyValue('{what}')")
    return sum(map(float, re.findall(r"[\d.]+", text)[:3])) / 3


@WIDTHS
@SCHEMES
def test_the_first_screen_has_the_sentence_and_the_bars(visit, race, width, scheme):
    page = visit(race, width, scheme)
    assert wide(page) <= width, "nothing is wider than the page"
    for what in (".won", ".raced", ".seen img", ".bars tbody tr:visible .time", ".bars tbody tr:visible .bar"):
        box = page.locator(what).last.bounding_box()
        assert box["y"] >= 0 and box["y"] + box["height"] <= 900 and box["x"] + box["width"] <= width, what
    assert page.inner_text(".won").startswith(
        "cpp is the fastest, 20.4 ms a frame; numba takes 3.000 times as long, numpy"
    )
    rows = page.locator(".bars tbody tr:not(.gap):visible")
    assert rows.count() == 10 and page.locator(".bars tbody tr:not(.gap)").count() == 12
    ends = [rows.locator(".bar").nth(n).bounding_box()["width"] for n in range(10)]
    assert ends == sorted(ends) and ends[0] < 0.5 * ends[9], "the fastest first"
    page.click("#every")
    assert rows.count() == 12
    assert (brightness(page, "body", "background-color") < brightness(page, ".won")) == (scheme == "dark")
    assert page.locator("details.section[open]").count() == 0, "all else is closed"


@WIDTHS
def test_with_every_section_open_nothing_is_wider_than_the_page(visit, path, width):
    page = visit(path, width)
    page.evaluate("document.querySelectorAll('details').forEach(one => one.open = true)")
    page.wait_for_selector("#chart-plot .scatterlayer .points path")
    assert wide(page) <= width
    if width > 1000:
        script = (
            "Array.from(document.querySelectorAll('.wide')).filter(box => box.scrollWidth > box.clientWidth).length"
        )
        assert page.evaluate(script) == 0, "tables fit"


@WIDTHS
@SCHEMES
def test_the_page_of_a_folder_of_runs(once, visit, make_run, record, tmp_path, width, scheme):
    def write():
        for number in range(3):
            make_run([record("cpp"), record("numba")], name=f"lab/{number}", title=f"run {number}" + " long" * 20)
        (tmp_path / "lab" / "not a run").mkdir()
        return index.make(tmp_path / "lab", tmp_path / "site")

    page = visit(once("folder of runs", write), width, scheme)
    assert wide(page) <= width and page.locator(".cards li").count() == 3
    assert page.locator(".cards img").first.evaluate("image => image.naturalWidth") > 100
    assert (brightness(page, "body", "background-color") < 128) == (scheme == "dark")
    page.locator("details.section summary").click()
    assert "not a run: holds no run" in page.inner_text("details.section")
    page.locator(".cards a").first.click()
    page.wait_for_selector(".won")


def test_a_link_into_a_closed_section_opens_it(visit, path):
    page = visit(path, 1280)
    link = page.locator("nav a", has_text="Measurement warnings")
    place = link.get_attribute("href")
    assert page.locator(f"details{place}[open]").count() == 0
    link.click()
    page.wait_for_selector(f"details{place}[open]")
    inside = page.evaluate("""(() => { const heading = document.querySelector('details.section .tried h3');
        return heading.id; })()""")
    page.goto(f"{path.as_uri()}#{inside}")
    page.reload()
    page.wait_for_selector(f"details.section[open] #{inside}", state="visible")


def test_figures_suit_the_page_and_pictures_stay_as_they_are(visit, path):
    """A drawing is light or dark as the page is, also after the button; pixels of pictures are the same in both."""
    shot = {}
    for scheme in ("light", "dark"):
        page = visit(path, 1280, scheme)
        for state in (scheme, "light" if scheme == "dark" else "dark"):
            if state != scheme:
                page.click("#theme")
            opened(page, "img.figure:not(.pixels)")
            figure = page.locator("details.section[open] img.figure:not(.pixels)").first
            figure.scroll_into_view_if_needed()
            page.wait_for_timeout(300)
            shot[scheme, state] = np.asarray(Image.open(io.BytesIO(figure.screenshot())).convert("L")).mean()
    assert all((value > 150) == (state == "light") for (_, state), value in shot.items()), shot
    seen = [np.asarray(Image.open(io.BytesIO(visit(path, 1280, scheme).locator(".seen img").first.screenshot())))
            for scheme in ("light", "dark")]  # fmt: skip
    np.testing.assert_array_equal(*(pixels[8:-8, 8:-8] for pixels in seen), "but for round corners")


@WIDTHS
def test_the_page(visit, path, width):
    page = visit(path, width)
    for part in ("#chart", "#comparer", "#series"):
        opened(page, part)
    page.wait_for_selector("#chart-plot .scatterlayer .points path")
    page.wait_for_selector("#series-plot .scatterlayer .trace", state="attached")
    _chart(page)
    _comparer(page)
    _series(page)
    assert wide(page) <= width
    before = page.evaluate("getComputedStyle(document.body).backgroundColor")
    page.click("#theme")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") != before


def _chart(page):
    page.locator("#chart-plot").scroll_into_view_if_needed()
    assert page.locator("#point-picture").is_hidden()
    end = time.monotonic() + PATIENCE
    while page.locator("#point-picture").is_hidden():  # a chart that is still being drawn does not see the mouse
        assert time.monotonic() < end
        x, y = centre(page, 0)
        page.mouse.move(x + 1, y)
        page.mouse.move(x, y)
        page.wait_for_timeout(200)
    until(page, "document.getElementById('point-picture').naturalWidth > 1")
    assert page.inner_text("#point-name").startswith("1. cpp, ") and "1.10" in page.inner_text("#point-told")
    page.mouse.click(*centre(page, 0))
    page.wait_for_selector("#point-commands code")
    assert page.inner_text("#point-commands code >> nth=0").startswith("rayrace render ")
    shown = page.locator("#chart-plot .scatterlayer .points path").count()
    page.locator("#chart-plot .legendtoggle").first.click()
    until(page, f"document.querySelectorAll('#chart-plot .scatterlayer .points path').length < {shown}")
    # By the keyboard too.
    page.locator("#chart-list summary").press("Enter")
    page.locator("#chart-list button").nth(1).focus()
    assert page.inner_text("#point-name").startswith("2. numba, ")
    page.keyboard.press("Enter")
    assert "rayrace run" in page.inner_text("#point-commands")


def _pixels(page, canvas="compare-canvas"):
    script = f"""(() => {{ const c = document.getElementById('{canvas}');
        return Array.from(c.getContext('2d').getImageData(0, 0, c.width, c.height).data); }})()"""
    return np.array(page.evaluate(script)).reshape(-1, 4)[:, :3]


def _drawn(page, is_done):
    """The comparer's picture when it is_done, or as it is after all that time."""
    end = time.monotonic() + PATIENCE
    while not is_done(picture := _pixels(page).reshape(60, 80, 3)) and time.monotonic() < end:
        page.wait_for_timeout(100)
    return picture


def _comparer(page):
    page.locator("#compare-canvas").scroll_into_view_if_needed()
    for what, length in (("width", 80), ("height", 60)):
        until(page, f"document.getElementById('compare-canvas').{what} === {length}")
    assert page.eval_on_selector("#compare-b", "one => one.selectedOptions[0].textContent") == "the truth"
    seen, last = {}, _drawn(page, np.any)
    for at in (0, 100):
        page.evaluate(f"document.getElementById('compare-at').value = {at}")
        page.dispatch_event("#compare-at", "input")
        seen[at] = last = _drawn(page, lambda now, last=last: (now != last).any())
    assert (seen[0][:, 5:-5] != seen[100][:, 5:-5]).mean() > 0.5, "A and B are two pictures"
    page.select_option("#compare-mode", "difference")
    page.evaluate("document.getElementById('compare-times').value = 0")
    page.dispatch_event("#compare-times", "input")
    expected = np.abs(seen[0].astype(int) - seen[100].astype(int))[:, 5:-5]
    found = _drawn(page, lambda now: np.array_equal(now[:, 5:-5], expected))
    np.testing.assert_array_equal(found[:, 5:-5], expected)
    page.select_option("#compare-mode", "error-a")

    def is_a_map(now):
        return (now != found).any() and len(np.unique(now.reshape(-1, 3), axis=0)) > 3

    assert is_a_map(_drawn(page, is_a_map))
    page.select_option("#compare-mode", "error-b")
    until(page, "document.getElementById('compare-told').textContent.includes('B is the truth, which has no error')")
    page.select_option("#compare-mode", "flip-a")
    until(page, "document.getElementById('compare-told').textContent.includes('FLIP map of A is unavailable')")
    page.select_option("#compare-mode", "swipe")
    page.locator("#compare-stage").press("ArrowRight")
    until(page, "document.getElementById('compare-lens-told').textContent.startsWith('pixel 41, 30: A (')")


def _series(page):
    page.locator("#series-plot").scroll_into_view_if_needed()
    assert page.locator("#series-plot .scatterlayer .trace").count() == 2  # of the place with most renderers
    page.select_option("#series-kind", "1")
    until(page, "document.getElementById('series-plot').data[0].y.join() === '1,2,3,3'")


@pytest.fixture
def swept(cell):
    """Records of two variants at three depths; at each depth one is faster, and they cross between 2 and 4."""
    told = []
    for name, times in (("cpp", (0.1, 0.2, 0.4)), ("numba", (0.25, 0.25, 0.25))):
        for depth, time_s in zip((1, 2, 4), times, strict=True):
            told += cell(name, [time_s * (1 + 0.001 * n) for n in range(5)], 0.01 * depth, False, depth=depth)
    return told


@pytest.mark.parametrize("width", [1280, 390])
def test_the_chart_of_sweeps(once, visit, make_run, swept, tmp_path, width):
    page = visit(once("sweeps", lambda: report.write(make_run(swept, **FACTS), tmp_path / "report")), width)
    page.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
    page.wait_for_selector("#sweep-plot .scatterlayer .trace")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    lines = "document.getElementById('sweep-plot').data.filter((one) => one.name)"
    assert page.evaluate(f"{lines}.map((one) => [one.name, one.x])") == [["cpp", [1, 2, 4]], ["numba", [1, 2, 4]]]
    times = np.array(page.evaluate(f"{lines}.map((one) => one.y)"))
    np.testing.assert_allclose(times, [[100.2, 200.4, 400.8], [250.5] * 3])  # ms
    assert page.inner_text("#sweep-told").startswith("numba overtakes cpp at about depth 2.")
    bands = "document.getElementById('sweep-plot').data.filter((one) => one.fill === 'toself').length"
    assert page.evaluate(bands) == 2
    page.uncheck("#sweep-bands")
    until(page, f"{bands} === 0")
    page.select_option("#sweep-kind", "1")
    until(page, f"{lines}[0].y[2] === 0.04")
    assert page.inner_text("#sweep-told") == ""
    page.check("#sweep-log")
    until(page, "document.getElementById('sweep-plot').layout.yaxis.type === 'log'")


@pytest.mark.nightly("it takes about 30 s with nothing beside it")
@pytest.mark.slow
@pytest.mark.alone
def test_two_thousand_points_can_be_used_within_three_seconds(visit, path, make_run, cell, tmp_path):
    """Of processor time, from a click on the section of the chart on; three points take nearly as long."""
    rng = np.random.default_rng(9)
    told = []
    for n in range(500):
        for name in ("python", "numpy", "numba", "cpp"):
            told += cell(name, [rng.uniform(0.01, 10)], 10 ** rng.uniform(-6, -1), False, seed=n)
    for row in told:
        row["series"] = row["picture"] = None
    many = report.write(make_run(told, name="many", **FACTS), tmp_path / "many-report")
    took = {path: [], many: []}
    for file in [path, many] * 3:
        page = visit(file, 1280)
        start = processor_s(page)
        opened(page, "#chart")
        page.wait_for_selector("#chart-plot .scatterlayer .points path")
        page.locator("#chart-plot").scroll_into_view_if_needed()
        page.mouse.move(*centre(page, 0))
        until(page, "document.getElementById('point-told').children.length > 0")
        took[file].append(processor_s(page) - start)
    print(list(took.values()))
    assert page.locator("#chart-plot .scatterlayer .points path").count() >= 2000
    assert many.stat().st_size < LIMIT
    assert min(took[many]) < 3 and min(took[many]) < 2 * min(took[path])
