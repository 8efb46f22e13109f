"""The summary in words: masks, and numbers of threads."""

import matplotlib.pyplot as plt
import pytest

from reports.run import ranking
from reports.summary import summary
from reports.times import times_figure


@pytest.mark.parametrize(("shares", "said"), [((0.1, None), None), ((0.11, 0.02), "11 %"), ((0.05, 0.4), "40 %")])
def test_a_mask_above_a_tenth_is_said(load, record, shares, said):
    """Of the largest, with the places; not of cells without a reference."""
    records = [record(name) for name in ("python", "numpy")]
    for one, share in zip(records, shares, strict=True):
        one["agreement"] = {"unavailable": "no"} if share is None else one["agreement"] | {"mask_fraction": share}
    text = summary.write(load(records))
    assert ("mask of ill-conditioned pixels" in text) == (said is not None)
    assert said is None or f"up to {said}: " in text


@pytest.fixture
def threaded(record):
    """Five rounds of cpp-threads with 1, 2 and 4 threads, which take 0.8, 0.4 and 0.2 s, and cpp, which has one."""

    def row(variant, count, number, **changes):
        time = 0.8 / count * (1 + 0.01 * number)
        more = {"point": {"threads": count}, "parameters": record("")["parameters"] | {"threads": count}}
        more |= {"cell": f"{variant}-{count}", "picture": {"file": f"pictures/{variant}-{count}.npy"}}
        return record(variant, number, frames=[time] * 3, **more | {"series": None} | changes)

    refused = {"status": "unsupported", "reason": "runs one thread", "frames_s": None, "picture": None, "error": None}
    told = [row("cpp-threads", count, number) for count in (1, 2, 4) for number in range(5)]
    told += [row("cpp", 1, number) for number in range(5)]
    return told + [row("cpp", count, number, **refused) for count in (2, 4) for number in range(5)]


def test_numbers_of_threads_are_compared_with_each_other(load, threaded):
    results = load(threaded)
    assert results.places == [("scenes/comparison.txt", "no sweep")]
    text = summary.write(results)
    assert "**cpp-threads (4 threads)** is the fastest" in text and "only" not in text
    assert "cpp-threads (2 threads) 2.00" in text
    assert "- cpp (2 threads): unsupported: runs one thread (comparison)" in text
    of = {cell.name: cell for cell in results.cells}
    ratio = ranking.ratio_to(results, of["cpp-threads (4 threads)"], "cpp-threads")
    assert ratio.value == pytest.approx(1 / 4), "the fewest threads divide"
    assert ranking.ratio_to(results, of["cpp-threads (2 threads)"], "cpp").value == pytest.approx(1 / 2)


def test_all_numbers_of_threads_have_one_panel_of_times(load, threaded):
    figure = times_figure.draw(load(threaded), "scenes/comparison.txt")
    (axes,) = figure.axes
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names[:2] == ["cpp-threads (4 threads)", "cpp-threads (2 threads)"] and len(names) == 4
    plt.close(figure)
