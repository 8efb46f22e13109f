"""report.html in a real browser without a network: what moves, at the width of a desk and of a hand."""

import shutil
import time

import numpy as np
import pytest
from made_up_errors import FACTS

from reports.page import LIMIT, report

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
QUIET = ("--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run")


@pytest.fixture(scope="module")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright")
    if CHROMIUM is None:
        pytest.skip("no Chromium here (Debian: apt install chromium)")
    with sync_api.sync_playwright() as playwright:
        made = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu", *QUIET])
        yield made
        made.close()


@pytest.fixture
def visit(browser):
    """visit(path, width): the page, which may ask for nothing and complain of nothing."""
    opened, heard = [], []

    def visit(path, width, scheme="light"):
        context = browser.new_context(viewport={"width": width, "height": 800}, offline=True, color_scheme=scheme)
        opened.append(context)
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


@pytest.fixture
def path(make_run, cell, record, tmp_path):
    """A report with a chart, pictures and series."""
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


def until(page, condition):
    """Wait until an expression is true. (The page's policy lets it evaluate no text itself.)"""
    for _ in range(50):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(100)
    raise AssertionError(f"never true: {condition}")


def centre(page, number):
    """Where a point of the chart is drawn."""
    box = page.locator("#chart-plot .scatterlayer .points path").nth(number).bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


@pytest.mark.parametrize("width", [1280, 390])
def test_the_page(visit, path, width):
    page = visit(path, width)
    assert page.evaluate("document.documentElement.scrollWidth") <= width, "nothing is wider than the page"
    _chart(page)
    _comparer(page)
    _series(page)
    before = page.evaluate("getComputedStyle(document.body).backgroundColor")
    page.click("#theme")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") != before


def _chart(page):
    page.locator("#chart-plot").scroll_into_view_if_needed()
    assert page.locator("#point-picture").is_hidden()
    page.mouse.move(*centre(page, 0))
    page.wait_for_selector("#point-picture:not([hidden])")
    assert page.evaluate("document.getElementById('point-picture').naturalWidth") > 1
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


def _comparer(page):
    page.locator("#compare-canvas").scroll_into_view_if_needed()
    assert page.evaluate(
        "[document.getElementById('compare-canvas').width, document.getElementById('compare-canvas').height]"
    ) == [80, 60]
    assert page.eval_on_selector("#compare-b", "one => one.selectedOptions[0].textContent") == "the truth"
    seen = {}
    for at in (0, 100):
        page.evaluate(f"document.getElementById('compare-at').value = {at}")
        page.dispatch_event("#compare-at", "input")
        page.wait_for_timeout(200)
        seen[at] = _pixels(page).reshape(60, 80, 3)
    assert (seen[0][:, 5:-5] != seen[100][:, 5:-5]).mean() > 0.5, "A and B are two pictures"
    page.select_option("#compare-mode", "difference")
    page.evaluate("document.getElementById('compare-times').value = 0")
    page.dispatch_event("#compare-times", "input")
    page.wait_for_timeout(200)
    expected = np.abs(seen[0].astype(int) - seen[100].astype(int))[:, 5:-5]
    np.testing.assert_array_equal(_pixels(page).reshape(60, 80, 3)[:, 5:-5], expected)
    page.select_option("#compare-mode", "error-a")
    page.wait_for_timeout(200)
    assert len(np.unique(_pixels(page), axis=0)) > 3
    page.select_option("#compare-mode", "error-b")
    until(page, "document.getElementById('compare-told').textContent.includes('B is the truth, which has no error')")
    page.select_option("#compare-mode", "flip-a")
    until(page, "document.getElementById('compare-told').textContent.includes('FLIP map of A is unavailable')")
    page.select_option("#compare-mode", "swipe")
    page.locator("#compare-stage").press("ArrowRight")
    until(page, "document.getElementById('compare-lens-told').textContent.startsWith('pixel 41, 30: A (')")


def _series(page):
    page.locator("#series-plot").scroll_into_view_if_needed()
    assert page.locator("#series-plot .scatterlayer .trace").count() == 1
    page.select_option("#series-kind", "1")
    page.wait_for_timeout(200)
    assert page.evaluate("document.getElementById('series-plot').data[0].y") == [1, 2, 3, 3]


@pytest.fixture
def swept(cell):
    """Records of two variants at three depths; at each depth one is faster, and they cross between 2 and 4."""
    told = []
    for name, times in (("cpp", (0.1, 0.2, 0.4)), ("numba", (0.25, 0.25, 0.25))):
        for depth, time_s in zip((1, 2, 4), times, strict=True):
            told += cell(name, [time_s * (1 + 0.001 * n) for n in range(5)], 0.01 * depth, False, depth=depth)
    return told


@pytest.mark.parametrize("width", [1280, 390])
def test_the_chart_of_sweeps(visit, make_run, swept, tmp_path, width):
    page = visit(report.write(make_run(swept, **FACTS), tmp_path / "report"), width)
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
def test_two_thousand_points_are_drawn_nearly_as_soon_as_three(visit, path, make_run, cell, tmp_path):
    """A page of three points is as long in loading as the library that draws."""
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
        start = time.perf_counter()
        page = visit(file, 1280)
        page.wait_for_selector("#chart-plot .scatterlayer .points path")
        took[file].append(time.perf_counter() - start)
    print(list(took.values()))
    assert page.locator("#chart-plot .scatterlayer .points path").count() >= 2000
    assert many.stat().st_size < LIMIT
    assert min(took[many]) < 2 * min(took[path])
