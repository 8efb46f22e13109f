"""The experiments and scenes that come with rayrace, found by name."""

import tomllib
from difflib import get_close_matches
from pathlib import Path

from harness.errors import UserError
from harness.system import output

SCENES = (".txt", ".nff")


def folder() -> Path:
    """The folder of the bundled experiments: inside the installed package, or of the checkout that this file is in."""
    here = Path(__file__).resolve().parent
    installed = here / "experiments"
    return installed if installed.is_dir() else here.parent / "experiments"


def names() -> dict[str, str]:
    """The titles of the bundled experiments by name."""
    files = sorted(folder().glob("*.toml"))
    return {file.stem: tomllib.loads(file.read_text(encoding="utf-8"))["title"] for file in files}


def experiment(path: Path) -> Path:
    """`path` if it is a file, else the bundled experiment of that name, such as comparison. UserError if neither is."""
    if path.exists():
        return path
    file = folder() / path.with_suffix(".toml")
    if path.parent == Path() and path.suffix in ("", ".toml") and file.is_file():
        return file
    raise _unknown(path, "experiment", list(names()))


def scene(path: Path) -> Path:
    """`path` if it is a file, else the bundled scene of that name: comparison, gallery/glossy, scenes/local.txt.

    UserError if there is none, or if several have the name.
    """
    if path.exists():
        return path
    home = folder()
    if (home / path).is_file() and not path.is_absolute() and ".." not in path.parts and path.suffix in SCENES:
        return home / path
    files = [file for file in sorted((home / "scenes").rglob("*")) if file.suffix in SCENES]
    names = {file: file.relative_to(home / "scenes").with_suffix("").as_posix() for file in files}
    wanted = path.with_suffix("") if path.suffix in SCENES else path
    matches = [file for file in files if wanted.as_posix() in (file.stem, names[file])]
    if len(matches) > 1:
        named = " or ".join(names[file] for file in matches)
        raise UserError(f"{path}: several bundled scenes have that name", remedy=f"give {named}")
    if matches:
        return matches[0]
    raise _unknown(path, "scene", [file.stem for file in files])


def _unknown(path: Path, what: str, candidates: list[str]) -> UserError:
    near = get_close_matches(path.stem, candidates, n=1)
    hint = f"did you mean {near[0]}?" if near else f"bundled: {', '.join(candidates)}"
    return UserError(f"{path}: no such file, and no bundled {what} of that name", remedy=hint)


def copy(name: str, out: Path) -> list[Path]:
    """Copy a bundled experiment to the folder `out`, with its scenes, their meshes and the schema that editors use.

    Returns the files. UserError if one is there already with other content; then nothing is written.
    """
    from harness.experiment.experiment import load
    from harness.scene import load as read
    from harness.scene.model import Csg, Mesh

    home, file = folder(), experiment(Path(name))
    definition = load(file)
    files = [file, home / "schema.json"]

    for text in dict.fromkeys([*definition.scenes, *(case.scene for case in definition.case)]):
        scene = home / text
        files.append(scene)
        for shape in read(scene).objects:
            parts = shape.parts() if isinstance(shape, Csg) else [shape]
            files += [scene.parent / part.path for part in parts if isinstance(part, Mesh)]
    files = list(dict.fromkeys(file.resolve() for file in files))
    targets = {file: out / file.relative_to(home.resolve()) for file in files}
    for file, target in targets.items():
        if target.exists() and target.read_bytes() != file.read_bytes():
            raise UserError(f"{target}: exists already, with other content", remedy="copy to another folder with -o")
    for file, target in targets.items():
        target.parent.mkdir(parents=True, exist_ok=True)
        output.data(target, file.read_bytes(), own=False)
    return list(targets.values())
