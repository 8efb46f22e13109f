"""The files of pictures."""

import os

import numpy as np
import pytest
import tifffile

from harness.errors import UserError
from harness.picture import picture


@pytest.mark.parametrize("dtype", ["float64", "float32"])
@pytest.mark.parametrize("shape", [(1, 1), (8, 12), (256, 512), (300, 517), (701, 33)])
def test_files_of_linear_numbers(shape, dtype, tmp_path):
    pixels = np.random.default_rng(3).normal(size=(*shape, 3)).astype(dtype)
    pixels[0, 0] = 1e30, np.nan, -np.inf
    for suffix in (".npy", ".tif"):
        picture.save(tmp_path / f"a{suffix}", pixels)
    np.save(tmp_path / "b.npy", pixels)
    assert (tmp_path / "a.npy").read_bytes() == (tmp_path / "b.npy").read_bytes()
    with tifffile.TiffFile(tmp_path / "a.tif") as tif:
        page = tif.pages[0]
        assert page.dtype == dtype and not tif.is_bigtiff and "Software" not in page.tags
        assert page.photometric == tifffile.PHOTOMETRIC.RGB and tif.byteorder == "<"
        assert np.array_equal(page.asarray(), pixels, equal_nan=True)


@pytest.mark.parametrize("suffix", picture.SUFFIXES)
def test_a_file_is_whole_or_not_there(suffix, tmp_path, monkeypatch):
    out = tmp_path / f"a{suffix}"
    out.write_text("before")
    monkeypatch.setattr(os, "rename", full_disk)
    with pytest.raises(OSError, match="no space left"):
        picture.save(out, np.zeros((10, 10, 3)))
    assert out.read_text() == "before" and list(tmp_path.iterdir()) == [out]


def full_disk(*_, **__):
    raise OSError("no space left")


@pytest.mark.parametrize(("suffix", "remedy"), [(".tif", "rayrace[tiff]"), (".exr", "rayrace[exr]"), (".png", None)])
def test_a_library_that_lacks_is_told_before_rendering(suffix, remedy, tmp_path, monkeypatch):
    monkeypatch.setattr(picture, "find_spec", lambda module: None)
    if remedy:
        with pytest.raises(UserError, match=f"which writes {suffix}, is not installed") as told:
            picture.check_suffix(tmp_path / f"a{suffix}")
        assert told.value.remedy == f"pip install '{remedy}'"
    else:
        picture.check_suffix(tmp_path / f"a{suffix}")
