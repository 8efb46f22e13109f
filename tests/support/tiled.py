"""What tests of pictures in tiles share."""

import json

from harness.single import single, tiles

EMPTY = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"


def image(**values):
    """The Image of the options of `render`."""
    return single.image(**{"width": 37, "height": 23, "region": "", "depth": 3, "shadows": True, **values})


def folder_of(path, bounds, side):
    """A folder of tiles with a spec of so much as its grid needs."""
    path.mkdir()
    spec = {"format": tiles.FORMAT, "picture": {"parameters": {"region": bounds}, "tiles": side}}
    (path / "spec.json").write_text(json.dumps(spec))
    return tiles.Folder(path)
