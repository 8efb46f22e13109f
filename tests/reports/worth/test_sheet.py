"""The contact sheet of `rayrace needs`: what a reader sees, for one leave-out and for more than it can hold."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from figure_lint import faults

from reports.paper import style
from reports.worth import sheet

NAME = "constant Fresnel share, no refraction, of the material of the ellipsoid of line 123 and 45 more"


@pytest.mark.parametrize("shape", [(30, 40, 3), (40, 10, 3), (10, 40, 3)])
@pytest.mark.parametrize("count", [1, 6, 30])
def test_it_can_be_read(shape, count):
    full = np.linspace(0, 1, np.prod(shape)).reshape(shape)
    found = [(NAME if k % 2 else "shadows", f"{0.123456 / k:.3g}", full + k / 100) for k in range(1, count + 1)]
    with style.styled():
        figure = sheet.draw(full, found)
        try:
            assert not faults(figure)
            words = [text.get_text() for axes in figure.axes for text in axes.texts]
        finally:
            plt.close(figure)
    assert len(words) == 1 + min(count, sheet.MOST)
    assert ("first 23 of 30" in words[0]) == (count == 30)
    assert words[1] == "shadows\nRMSE 0.123" or words[1].endswith(", RMSE 0.123")
