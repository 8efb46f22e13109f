"""Renderers that cheat (bad_renderers/cheats.py), and what is to be said of each.

By contract 1 nobody knows of later frames: each such row says so. By contract 2 each cheat is found.
"""

import shutil
from pathlib import Path

PROGRAMS = Path(__file__).parents[1] / "harness" / "bad_renderers"
SCENE = """CAMERA (0,0.1,0) (1.2,0,0) (0,1.2,0) (0.1,0.2,4)
BACKGROUND (0.2,0.5,0.7)
AMBIENT (0.2,0.2,0.2)
LIGHT (4,5,6) (0.7,0.7,0.6) 0
SPHERE (-0.3,0.1,-0.5) 0.8 (0.7,0.5,0.3) 0.4 20 (0,0,0) 1e6 1
SPHERE (0.7,-0.3,0.4) 0.4 (0.3,0.5,0.8) 0.3 30 (0,0,0) 1e6 1
SPHERE (0,-101,0) 100 (0.5,0.6,0.5) 0.2 10 (0,0,0) 1e6 1
"""
OTHER, WRONG = "had another picture than that of the place of its sample", "is wrong: "
# By contract 2: the status of the row, and part of the reason why it failed or has no rank.
CHEATS = {
    "copies": ("ok", OTHER),
    "memo": ("ok", OTHER),
    "ninth": ("ok", OTHER),
    "other-rows": ("ok", OTHER),
    "cached": ("ok", WRONG),
    "shm": ("ok", WRONG),
    "touched": ("ok", OTHER),
    "set-up": ("ok", OTHER),
    "in-save": ("failed", "the checksum of frame 0 is not that of its picture"),
    "helper": ("ok", OTHER),
    "prerendered": ("failed", "asked for the places of the samples of its later frames before it said frame 0"),
    "less-deep": ("ok", OTHER),
    "unlit": ("ok", OTHER),
    "single": ("ok", OTHER),
    "half": ("ok", OTHER),
    "backdated": ("failed", "begins before the place of its sample was known"),
    "false-checksum": ("ok", OTHER),
    "first-checksum": ("ok", OTHER),
    "silent": ("failed", "frame 0 has no checksum of its picture"),
    "unasked": ("failed", "did not ask for the places of the samples of its later frames"),
    "own-places": ("ok", OTHER),
    "centred": ("ok", OTHER),
    "unmoved": ("ok", WRONG),
    "recognising": ("ok", WRONG),
    "rewriting": ("failed", "before it said frame 0, or said others then"),
    "last-of-batch": ("ok", OTHER),
    "short": ("ok", "the memory: frame "),
}
OUTSIDE = "between", "going-on", "halved", "late-start"  # whose frames are right, and done outside of their times
DOUBTED = {  # that make the check impossible: the row says so
    "failing": "the job of frame ",
    "noisy": "two processes make other bytes of one picture",
}
# By contract 1, where that has the cheat: what is found though nobody checks frames; "": nothing, which the row says.
FIRST = {
    **dict.fromkeys(("copies", "memo", "ninth", "other-rows", "less-deep", "unlit", "single", "half", "unmoved"), ""),
    **dict.fromkeys(("cached", "shm", "helper"), ""),
    **{"touched": "the processor: ", "set-up": "the processor: ", "in-save": "the memory: frame "},
    **{"short": "the memory: frame "},
}


def folder(place: Path, contract: int, *names: str) -> Path:
    """A new renderer of the variants cheat-NAME, by a version of the contract."""
    place.mkdir()
    shutil.copy(PROGRAMS / "cheats.py", place)
    tables = [
        f'[[variant]]\nname = "cheat{contract}-{name}"\ncommand = ["{{python}}", "-S", "{{folder}}/cheats.py"]\n'
        for name in names
    ]
    features = '["sphere", "ambient", "diffuse", "phong", "shadows", "reflection", "region"]'
    head = f'contract = {contract}\nname = "{place.name}"\ntechnology = "NumPy, misused"\ndescription = "cheats"\n'
    (place / "renderer.toml").write_text(f"{head}features = {features}\n" + "".join(tables))
    return place
