"""Sections of the page: which figures get its room."""

import numpy as np
from PIL import Image

from reports.chart.embedded import Embedded
from reports.page import sections


def test_charts_get_room_before_grids_of_pictures(tmp_path):
    """Two figures of noise, of which one fits: the chart, though the grid of pictures comes first on the page."""
    rng = np.random.default_rng(3)
    for name in ("grid.png", "chart.png"):
        Image.fromarray(rng.integers(0, 256, (120, 120, 3), np.uint8), "RGB").save(tmp_path / name)
    parts = [
        ("pictures_figure", "## Pictures\n\n![grid](grid.png)"),
        ("times_figure", "## Times\n\n![chart](chart.png)"),
    ]
    alone = Embedded(10**6, inline=True)
    sections.of(parts[:1], tmp_path, alone)
    figures = Embedded(int(1.5 * (10**6 - alone.room)), inline=True)
    pictures, times = sections.of(parts, tmp_path, figures)
    assert (pictures.title, times.title) == ("Pictures", "Times") and figures.left_out == 1
    assert "Too large for this page" in pictures.body and "<img" in times.body


def test_a_long_caption_shows_its_first_sentence_and_folds_the_rest(tmp_path):
    """Of the whole text nothing is lost; items of a list and short paragraphs stay as they are."""
    rest = " ".join(f"Sentence {number} has *{number}* & more." for number in range(30))
    text = f"## Times\n\nShort. Two.\n\nFirst of all <b>. {rest}\n\n- {rest}"
    (section,) = sections.of([("times_figure", text)], tmp_path, Embedded(0))
    before, _, folded = section.body.partition("<details>")
    assert "<p>Short. Two.</p>" in before and "<p>First of all &lt;b&gt;.</p>" in before
    inside = folded.partition("</details>")[0]
    assert inside.count("Sentence") == 30 and "<em>29</em> &amp; more." in inside and "<b>" not in section.body
    assert section.body.count("<details>") == 1
