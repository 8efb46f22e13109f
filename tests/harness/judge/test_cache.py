"""Pictures that runs share."""

import hashlib
import io
import os

import numpy as np
import pytest

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


@pytest.fixture
def key(tmp_path, monkeypatch):
    """The key of a user of its own, in a folder beside the cache."""
    monkeypatch.setattr(cache, "state_folder", lambda: tmp_path / "state")
    cache._secret.cache_clear()
    yield tmp_path / "state" / "references.key"
    cache._secret.cache_clear()


def test_what_a_renderer_wrote_is_not_believed(tmp_path, key):
    """Neither a file without a checksum, nor one with the checksum of a guess, nor a good one under another name."""
    here, picture = Kept(tmp_path / "cache"), np.random.default_rng(4).random((4, 5, 3))
    here.put("a", {"maker": "cpp"}, {"picture": picture})
    path = tmp_path / "cache" / "a.npz"
    good = path.read_bytes()
    other = io.BytesIO()
    np.savez(other, facts=np.array('{"maker": "cpp"}'), picture=picture + 1)
    for checksum in (b"", bytes(32), good[-32:], hashlib.sha256(other.getvalue()).digest()):
        path.write_bytes(other.getvalue() + checksum)
        assert here.get("a") is None
    (tmp_path / "cache" / "b.npz").write_bytes(good)
    assert here.get("b") is None
    path.write_bytes(good)
    assert np.array_equal(here.get("a")[1]["picture"], picture)
    assert key.read_bytes() not in good and len(key.read_bytes()) == 32


def test_a_user_has_one_key(tmp_path, key):
    first = cache._secret()
    cache._secret.cache_clear()
    assert cache._secret() == first and [path.name for path in key.parent.iterdir()] == [key.name]
    assert key.stat().st_mode & 0o777 == 0o600
    key.write_bytes(b"short")
    cache._secret.cache_clear()
    assert cache._secret() != first


def test_without_a_home_nothing_of_others_is_taken(tmp_path, monkeypatch, key):
    """And what this process has put is."""
    (tmp_path / "state").write_text("no folder")
    here = Kept(tmp_path / "cache")
    here.put("a", {}, {})
    assert here.get("a") is not None
    cache._secret.cache_clear()
    assert here.get("a") is None
