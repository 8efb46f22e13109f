"""The same seed makes the same picture, byte for byte, in another process on another day in another place: with another
clock, time zone, language, seed of hashes, current folder, mask of permissions and number of threads."""

import os

import faulty
import pytest
from feature_scenes import features

from harness.process import process

SIZE = {"width": 19, "height": 13}
# Between them: jittered and adaptive samples, a lens, soft shadows, glossy reflection, glass.
SCENES = "mix: soft shadows and gloss through a lens", "mix: adaptive glass", "mix: jittered glass, soft shadows"
FAMILIES = {
    "python": [("python", 1)],
    "numpy": [("numpy", 1)],
    "cpp": [("cpp", 1), *(("cpp-threads", threads) for threads in (1, 2, 3))],
    "numba": [("numba", 1), *(("numba-parallel", threads) for threads in (1, 2, 3))],
}


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    return features(tmp_path_factory.mktemp("meshes"))


@pytest.fixture
def elsewhere(monkeypatch, tmp_path):
    """elsewhere(number) takes what is started from now on to another place and time."""
    umask = os.umask(0)
    os.umask(umask)

    def go(number):
        days = (-4000, 1, 9000)[number % 3]
        told = {
            **faulty.wrong_clock(tmp_path, days * 86400),
            "TZ": ("Pacific/Kiritimati", "Asia/Kathmandu", "UTC+11")[number % 3],
            "LC_ALL": ("tr_TR.UTF-8", "C", "de_DE.UTF-8")[number % 3],
            "LANG": "ar_EG.UTF-8",
            "PYTHONHASHSEED": str(number),
            "COLUMNS": "7",
        }
        for name, value in told.items():
            monkeypatch.setenv(name, value)
        monkeypatch.setattr(process, "KEPT", (*process.KEPT, *told))
        place = tmp_path / f"a folder, {number} ü"
        place.mkdir()
        monkeypatch.chdir(place)
        os.umask((0o077, 0o000, 0o027)[number % 3])

    yield go
    os.umask(umask)


def pictures(bench, scenes, family, name, elsewhere, injected):
    source, jobs = scenes[name]
    here = bench.result(FAMILIES[family][0][0], source, **SIZE, **jobs)
    for number, (variant, threads) in enumerate(FAMILIES[family]):
        elsewhere(number)
        there = bench.result(variant, source, **SIZE, **jobs, threads=threads)
        assert there.array.tobytes() == here.array.tobytes(), f"{variant} on {threads} threads"
        assert there.said.rays == here.said.rays
    other = bench.result(FAMILIES[family][0][0], source, **SIZE, **{**jobs, "seed": 12345})
    assert "seed" not in jobs or other.array.tobytes() != here.array.tobytes()
    injected("another place and day", len(FAMILIES[family]))


@pytest.mark.parametrize("name", SCENES[:2])
@pytest.mark.parametrize("family", ["numpy", "cpp"])
def test_the_same_bytes(bench, scenes, family, name, elsewhere, injected):
    pictures(bench, scenes, family, name, elsewhere, injected)


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("family", ["python", "numba"])
def test_the_same_bytes_slowly(bench, scenes, family, name, elsewhere, injected):
    pictures(bench, scenes, family, name, elsewhere, injected)
