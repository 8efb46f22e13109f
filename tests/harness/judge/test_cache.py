"""Pictures that runs share."""

import os

import numpy as np

from harness.judge import cache
from harness.judge.cache import Kept


def test_what_was_put_is_there(tmp_path):
    here = Kept(tmp_path / "new")
    assert here.get("a") is None
    picture = np.random.default_rng(3).random((4, 5, 3))
    here.put("a", {"maker": "cpp", "rays": None}, {"picture": picture})
    facts, arrays = Kept(tmp_path / "new").get("a")
    assert facts == {"maker": "cpp", "rays": None}
    np.testing.assert_array_equal(arrays["picture"], picture)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["a.npz"]


def test_a_torn_file_is_not_believed(tmp_path):
    here = Kept(tmp_path)
    here.put("a", {}, {"picture": np.zeros((64, 64))})
    whole = (tmp_path / "a.npz").read_bytes()
    for length in (0, 1, 30, len(whole) // 2, len(whole) - 1):
        (tmp_path / "a.npz").write_bytes(whole[:length])
        assert here.get("a") is None


def test_the_longest_unused_goes_first(tmp_path, monkeypatch):
    here = Kept(tmp_path)
    mine = [tmp_path / name for name in ("mine.npz", f"{'e' * 17}.npz")]
    for path in mine:
        np.savez(path, picture=np.zeros(1000))
        os.utime(path, (0, 0))
    a, b, c, d = (digit * 16 for digit in "abcd")
    for number, key in enumerate((a, b, c)):
        here.put(key, {}, {"picture": np.zeros(1000)})
        os.utime(tmp_path / f"{key}.npz", (number, number))
    assert here.get(a)  # is used now
    monkeypatch.setattr(cache, "LIMIT", 3 * (tmp_path / f"{a}.npz").stat().st_size)
    here.put(d, {}, {"picture": np.zeros(1000)})
    assert {path.stem for path in tmp_path.iterdir()} == {a, c, d, *(path.stem for path in mine)}


def test_without_a_folder_nothing_is_kept():
    Kept(None).put("a", {}, {})
    assert Kept(None).get("a") is None
