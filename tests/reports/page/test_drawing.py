"""Drawings on a dark page: greys are turned over, renderers keep their colours, pictures are left alone."""

import re

import matplotlib.pyplot as plt
import numpy as np

from reports.page import drawing
from reports.paper import style


def contrast(colour, other="#1e2328"):
    """WCAG's contrast of two colours, 1 to 21."""

    def luminance(text):
        channels = [int(text[n : n + 2], 16) / 255 for n in (1, 3, 5)]
        linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
        return float(np.dot(linear, (0.2126, 0.7152, 0.0722)))

    light, deep = sorted((luminance(colour), luminance(other)), reverse=True)
    return (light + 0.05) / (deep + 0.05)


def test_greys_are_turned_over_and_renderers_keep_their_colour():
    assert (drawing.dark("#000000"), drawing.dark("#ffffff")) == ("#e6e9ec", "#1e2328")
    greys = [contrast(drawing.dark(f"#{level:02x}" * 1 + f"{level:02x}" * 2)) for level in (0, 64, 128, 192, 255)]
    assert greys == sorted(greys, reverse=True)
    for colour in (*style.COLOURS.values(), *style.SPARE):
        assert contrast(drawing.dark(colour.lower())) > 2.5, colour
    kept = [name for name, colour in style.COLOURS.items() if drawing.dark(colour.lower()) == colour.lower()]
    assert set(style.COLOURS) - set(kept) == {"cpp-threads"}, "which would be too dark"
    assert drawing.dark(style.FIXED_WHITE) == style.FIXED_WHITE


def test_text_over_phases_can_be_read():
    for name, colour in style.PHASES.items():
        assert contrast(drawing.dark("#000000"), drawing.dark(colour.lower())) > 3, name


def test_a_drawing_has_a_rule_for_each_colour_and_no_other_change(tmp_path):
    with style.styled():
        figure, axes = plt.subplots()
        axes.plot([1, 2], color=style.COLOURS["cpp"])
        axes.imshow(np.zeros((2, 2, 3)))
        axes.set_title("black text")
        style.save(figure, tmp_path / "f")
    plain = (tmp_path / "f.svg").read_bytes()
    made = drawing.for_page(plain)
    rules = re.search(rb"<style>(@media \(prefers-color-scheme: dark\).*?)</style></defs>", made)
    assert made.replace(b"<style>" + rules[1] + b"</style>", b"") == plain
    assert b'[style*="fill: #ffffff"]{fill:#1e2328!important}' in rules[1] and b"svg{fill:#e6e9ec}" in rules[1]
    assert style.COLOURS["cpp"].lower().encode() not in rules[1] and b"filter" not in made
