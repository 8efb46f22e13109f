"""Renderers that tell the time truly or falsely (bad_renderers/liar.py), and what is to be said of each."""

import shutil
from pathlib import Path

PROGRAMS = Path(__file__).parents[1] / "harness" / "bad_renderers"
HONEST = "true", "idle", "compiled", "cold", "batches", "threads"
RENDER = "its phases: its frames cover "
CPU = "the processor: "
# By variant, the beginning of what its marks contradict.
LIES = {
    "between": RENDER,
    "asleep": RENDER,
    "half": RENDER,
    "before": RENDER,
    "after": RENDER,
    "first": "its phases: its frames ",
    "kept": CPU,
    "import": CPU,
    "load": CPU,
    "compile": CPU,
    "upload": CPU,
    "save": CPU,
    "phases": CPU,
    "start": CPU,
    "exit": CPU,
    "nowhere": "the clock: its phases cover ",
    "child": RENDER,
    "unnamed": "its phases: it has ",
}


def folder(place: Path, *names: str) -> Path:
    """A new renderer of the variants liar-NAME."""
    place.mkdir()
    for file in ("main.py", "liar.py"):
        shutil.copy(PROGRAMS / file, place)
    tables = [
        f'[[variant]]\nname = "liar-{name}"\ncommand = ["{{python}}", "-S", "{{folder}}/liar.py"]\n'
        + 'threads = "all"\n' * (name == "threads")
        for name in names
    ]
    head = f'contract = 1\nname = "{place.name}"\ntechnology = "Python, misused"\ndescription = "of time"\n'
    (place / "renderer.toml").write_text(head + 'features = ["region"]\n' + "".join(tables))
    return place
