"""The files that take pictures of any size."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import tifffile
from tiled import folder_of

from harness.errors import UserError
from harness.picture import picture
from harness.store import store


@pytest.mark.parametrize("dtype", ["float64", "float32"])
@pytest.mark.parametrize("shape", [(1, 1), (8, 12), (256, 512), (300, 517), (701, 33)])
def test_files_of_any_size(shape, dtype, tmp_path):
    pixels = np.random.default_rng(3).normal(size=(*shape, 3)).astype(dtype)
    pixels[0, 0] = 1e30, np.nan, -np.inf
    for suffix in picture.ANY_SIZE:
        picture.save(tmp_path / f"a{suffix}", pixels)
    np.save(tmp_path / "b.npy", pixels)
    assert (tmp_path / "a.npy").read_bytes() == (tmp_path / "b.npy").read_bytes()
    with tifffile.TiffFile(tmp_path / "a.tif") as tif:
        page = tif.pages[0]
        assert page.is_tiled and page.dtype == dtype and not tif.is_bigtiff and "Software" not in page.tags
        assert page.photometric == tifffile.PHOTOMETRIC.RGB and tif.byteorder == "<"
        assert np.array_equal(page.asarray(), pixels, equal_nan=True)


def test_bands_of_a_npy(tmp_path, monkeypatch):
    pixels = np.random.default_rng(4).random((23, 37, 3))
    monkeypatch.setattr(picture, "BAND", 3 * pixels[:1].nbytes + 1)
    asked = []

    def crop(x0, y0, x1, y1):
        asked.append(y1 - y0)
        return pixels[y0:y1, x0:x1]

    picture.write(tmp_path / "a.npy", 23, 37, pixels.dtype, crop)
    assert np.array_equal(np.load(tmp_path / "a.npy"), pixels) and asked == [3] * 7 + [2]


def test_a_large_tif_is_a_bigtiff(tmp_path, monkeypatch):
    pixels = np.random.default_rng(4).random((30, 300, 3))
    monkeypatch.setattr(picture, "CLASSIC", 2 * 32 * 256 * 24 - 1)  # two blocks
    picture.save(tmp_path / "a.tif", pixels)
    with tifffile.TiffFile(tmp_path / "a.tif") as tif:
        assert tif.is_bigtiff and np.array_equal(tif.asarray(), pixels)


@pytest.mark.parametrize("suffix", picture.ANY_SIZE)
def test_a_file_is_whole_or_not_there(suffix, tmp_path):
    out = tmp_path / f"a{suffix}"
    out.write_text("before")

    def crop(x0, y0, x1, y1):
        if y0 > 0:
            raise OSError("no space left")
        return np.zeros((y1 - y0, x1 - x0, 3))

    with pytest.raises(OSError, match="no space left"):
        picture.write(out, 10**4, 10**3, np.dtype(float), crop)
    assert out.read_text() == "before" and list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize(("suffix", "remedy"), [(".tif", "rayrace[tiff]"), (".exr", "rayrace[exr]"), (".png", None)])
def test_a_library_that_lacks_is_told_before_rendering(suffix, remedy, tmp_path, monkeypatch):
    monkeypatch.setattr(picture, "find_spec", lambda module: None)
    if remedy:
        with pytest.raises(UserError, match=f"which writes {suffix}, is not installed") as told:
            picture.check_suffix(tmp_path / f"a{suffix}")
        assert told.value.remedy == f"pip install '{remedy}'"
    else:
        picture.check_suffix(tmp_path / f"a{suffix}")


ASSEMBLE = """
import sys
from pathlib import Path
import numpy as np, tifffile
from harness.errors import UserError
from harness.picture import picture
from harness.single import tiles

def mark():
    told = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return int(told["VmHWM"].split()[0]) * 1024

place, out, how = tiles.Folder(Path(sys.argv[1])), Path(sys.argv[2]), sys.argv[3]
grid, crop = place.grid, place.crop
picture.write(out.with_name("small" + out.suffix), 300, 300, np.dtype(float), crop)  # what all of it imports
before = mark()
if how == "all":
    whole = crop(0, 0, grid.width, grid.height)
    crop = lambda x0, y0, x1, y1: whole[y0:y1, x0:x1]
picture.write(out, grid.height, grid.width, np.dtype(float), crop)
print(mark() - before)
"""


@pytest.mark.alone
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the system does not tell peaks of memory")
def test_a_picture_is_never_all_in_memory(tmp_path):
    """Put together from tiles of 6 MB, a picture of 288 MB takes less than 48 MB; one that is held takes it all."""
    place = folder_of(tmp_path / "tiles", (0, 0, 4000, 3000), 500)
    for number in range(place.grid.count):
        store.save_whole(place.path / f"{number}.npy", np.full(place.grid.shape(number), number + 0.5))

    def grown(suffix, how):
        out = tmp_path / f"a{suffix}"
        command = [sys.executable, "-c", ASSEMBLE, str(place.path), str(out), how]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        assert out.stat().st_size >= 4000 * 3000 * 24
        found = np.load(out, mmap_mode="r") if suffix == ".npy" else tifffile.imread(out)
        assert found[2999, 3999, 0] == place.grid.count - 0.5 and found[499, 500, 2] == 1.5
        out.unlink()
        return int(done.stdout)

    for suffix in picture.ANY_SIZE:
        assert grown(suffix, "tiles") < 48e6
        assert grown(suffix, "all") > 280e6
