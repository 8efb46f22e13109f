"""Renders the pictures of docs/scenes.md, each from its own text on that page: python docs/scenes.py [FOLDER]."""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "scenes.md"
TEXT = re.compile(r"<!-- scene: (\w+) -->\n```\n(.*?)```\n\n!\[[^\]]+\]\(scenes/(\w+)\.png\)", re.DOTALL)
MESH = ROOT / "experiments" / "scenes" / "gallery" / "knot.obj"
WIDTH = 320  # pixels
OPTIONS = ["--depth", "8", "--sampler", "jittered", "--samples", "6"]  # of all; a text can name more
MORE = re.compile(r"(--feelers|--glossy-rays) (\d+)")


def scenes() -> dict[str, str]:
    """Returns the text of each scene of the page by its name, the stage before all others."""
    texts = {name: text for name, text, _ in TEXT.findall(PAGE.read_text("utf-8"))}
    stage = texts["stage"]
    return {name: text if name == "stage" else stage + text for name, text in texts.items()}


def write(folder: Path) -> None:
    """Renders all of them into the folder."""
    folder.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as made:
        shutil.copy(MESH, made)
        for name, text in scenes().items():
            file = Path(made) / f"{name}.txt"
            file.write_text(text, "utf-8")
            more = [word for option in MORE.findall(text) for word in option]
            words = ["render", file, "--width", str(WIDTH), *OPTIONS, *more, "-o", folder / f"{name}.png"]
            subprocess.run([sys.executable, "-m", "rayrace", *words], check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "scenes")
