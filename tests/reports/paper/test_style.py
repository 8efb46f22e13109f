"""Figures have letters for any name, and say nothing on standard error; long names become files."""

import os
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest
from figure_lint import faults, ticks

from reports.paper import markdown, style


def test_letters_that_the_font_lacks(tmp_path):
    """In a process of its own: matplotlib warns once."""
    code = (
        "import matplotlib.pyplot as plt\nfrom pathlib import Path\nfrom reports.paper import style\n"
        "with style.styled():\n"
        "    figure, axes = plt.subplots()\n"
        "    axes.set_title('\u573a\u666f \U0001f98a \u0627\u0644', fontweight='bold')\n"
        "    axes.set_xlabel('\u5834\u666f \U0001f680')\n"
        "    style.save(figure, Path('figure'))\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.getcwd(), "PYTHONIOENCODING": "utf-8"}
    words = [sys.executable, "-W", "always::UserWarning", "-c", code]
    done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    assert {path.suffix for path in tmp_path.iterdir()} == {".png", ".svg", ".pdf", ".json"}
    pdf = (tmp_path / "figure.pdf").read_bytes()
    assert b"/Subtype /CIDFontType2" in pdf and b"/Type3" not in pdf  # TrueType


def test_the_first_font_is_the_same_everywhere():
    assert style.RC["font.family"][0] == "DejaVu Sans"


def test_names_of_files_are_short_and_differ():
    assert markdown.slug("A scene, 2 of 3") == "a-scene-2-of-3" and markdown.slug("\u573a\u666f") == "unnamed"
    long = [markdown.slug("a" * 245 + end) for end in ("", "b", "\udcff")]
    assert len(set(long)) == 3 and all(len(name) == markdown.LONGEST for name in long)
    assert markdown.slug("a" * markdown.LONGEST) == "a" * markdown.LONGEST


@pytest.mark.parametrize("seed", range(12))
def test_a_logarithmic_axis_has_two_numbers_at_least(seed):
    """Of any ends, and of decades as before; none lies over another."""
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    low, span = 10 ** rng.uniform(-3, 3), 10 ** (10 ** rng.uniform(-1.5, 0.5))
    for narrow in (False, True):
        with style.styled():
            figure, axes = plt.subplots(figsize=(5, 2), layout="constrained")
            axes.plot([low, low * span], [0, 1])
            axes.set(xscale="log", xlim=(low, low * span))
            style.log_ticks(axes.xaxis, narrow)
            figure.canvas.draw()
        labels = [label.get_text() for label in ticks(axes.xaxis) if label.get_text()]
        print(low, low * span, labels)
        assert len(set(labels)) == len(labels) >= 2
        assert faults(figure) == []
        plt.close(figure)
