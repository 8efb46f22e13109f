"""Whatever is done to a good scene, reading it gives a scene that can be rendered or a UserError."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from harness.errors import UserError
from harness.renderer.parameters import Parameters
from harness.scene import load, text
from harness.scene.flatten import flatten
from harness.scene.needs import needs
from harness.scene.tokens import tokens

VALID = (Path(__file__).parents[3] / "experiments" / "scenes" / "local.txt").read_text()
SOLIDS = """CAMERA (0,0,1) (1,0,0) (0,1,0) 2
OR BOX (0,0,-4) (1,0,0) (0,1,0) (0,0,1) AND SPHERE (0.5,0.5,-3.5) 0.7 NOT SPHERE (0.5,0.5,3) 4 END END END
(0.9,0.2,0.1) 0.3 50 (1,0.5,1) 2 1
NOT OR ELLIPSOID (0,0,0) (1,0,0) (0,1,0) (0,0,1) AND SPHERE (0,0,-3.5) 0.7 END END END (0,0,0) 1 5 (1,1,1) 2.25 1
MESH "a b.obj" (0,0,0) (30,45,60) 2 (0.9,0.2,0.1) 0.3 50 (0,0,0) 1e6 1
"""
PIECES = [token.text for token in tokens(VALID)] + [
    "nan", "1e999", "-1", "0", "1e-320", "1e30", "-1e-30", "POLYGON", "999999999", "((", "#", "\r", "\u2028",
    "OR", "AND", "NOT", "END", "MESH", "a.obj", '"',
]  # fmt: skip


@st.composite
def mutations(draw):
    """A valid scene with some of its tokens lost, doubled, replaced or made 0, or its characters damaged."""
    valid = draw(st.sampled_from([VALID, VALID.replace("(2.1,4,7.2)", "8.5"), SOLIDS, SOLIDS]))
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


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A place with the mesh that SOLIDS asks for."""
    folder = tmp_path_factory.mktemp("mutations")
    (folder / "a b.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    return folder


@settings(max_examples=1000, deadline=None, derandomize=True, print_blob=True)
@example(VALID)
@example(SOLIDS)
@given(content=mutations())
def test_a_scene_or_a_user_error(folder, content):
    try:
        scene = text.read(content, folder / "a.txt")
    except UserError as error:
        assert error.line >= 1 and error.column >= 1
        return
    arrays = flatten(scene)
    assert all(np.isfinite(array).all() for array in arrays.values())
    with np.errstate(all="raise", under="ignore"):
        for frame in (*arrays["boxes"], *arrays["ellipsoids"]):
            assert np.isfinite(np.linalg.inv(frame[3:].reshape(3, 3))).all()
    needs(scene, Parameters(depth=5, shadows=True))


@settings(max_examples=200, deadline=None, derandomize=True, print_blob=True)
@given(st.binary(max_size=40))
def test_any_file_is_text_or_a_user_error(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "any.txt"
    path.write_bytes(content)
    with suppress(UserError):
        load(path)
