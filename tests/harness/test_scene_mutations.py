"""Whatever is done to a good scene, reading it gives a scene that can be rendered or a UserError."""

from contextlib import suppress
from pathlib import Path

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from harness.errors import UserError
from harness.scene import load, text
from harness.scene.flatten import flatten
from harness.scene.needs import needs
from harness.scene.tokens import tokens

VALID = (Path(__file__).parents[2] / "experiments" / "scenes" / "local.txt").read_text()
PIECES = [token.text for token in tokens(VALID)] + [
    "nan", "1e999", "-1", "0", "1e-320", "1e30", "-1e-30", "POLYGON", "999999999", "((", "#", "\r", "\u2028",
]  # fmt: skip


@st.composite
def mutations(draw):
    """A valid scene with some of its tokens lost, doubled, replaced or made 0, or its characters damaged."""
    valid = draw(st.sampled_from([VALID, VALID.replace("(2.1,4,7.2)", "8.5")]))
    words = [token.text for token in tokens(valid) if token.text]
    for _ in range(draw(st.integers(1, 3))):
        vectors = [i for i, word in enumerate(words) if word == "("]
        start = draw(st.sampled_from(vectors) | st.integers(0, len(words) - 1))
        end = start + draw(st.sampled_from([0, 1, 3, 7]))  # 7: a vector
        pieces = st.lists(st.sampled_from(PIECES) | st.text(max_size=5), max_size=4)
        zeros = ["0" if word[-1:].isdigit() else word for word in words[start:end]]
        words[start:end] = draw(st.just(zeros) | st.just(words[start:end] * 2) | pieces)
    content = " ".join(words)
    if draw(st.booleans()):
        at = draw(st.integers(0, len(content)))
        content = content[:at] + draw(st.characters()) + content[at + draw(st.integers(0, 3)) :]
    return content


@settings(max_examples=1000, deadline=None, derandomize=True, print_blob=True)
@example(VALID)
@given(mutations())
def test_a_scene_or_a_user_error(content):
    try:
        scene = text.read(content)
    except UserError as error:
        assert error.line >= 1 and error.column >= 1
        return
    arrays = flatten(scene)
    assert all(np.isfinite(array).all() for array in arrays.values())
    with np.errstate(all="raise", under="ignore"):
        for frame in (*arrays["boxes"], *arrays["ellipsoids"]):
            assert np.isfinite(np.linalg.inv(frame[3:].reshape(3, 3))).all()
    needs(scene, 5, True)


@settings(max_examples=200, deadline=None, derandomize=True, print_blob=True)
@given(st.binary(max_size=40))
def test_any_file_is_text_or_a_user_error(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "any.txt"
    path.write_bytes(content)
    with suppress(UserError):
        load(path)
