"""Finds other versions of known variants: in a folder, or at a commit of the git repository that holds them."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from harness.errors import UserError
from harness.renderer import builder, manifest, registry
from harness.renderer.registry import Entry, Renderer
from harness.system import git

OF_FOLDER = "old"  # the label of variants from a folder; that of a commit is its abbreviated hash
DIGITS = 9  # of such a hash


@dataclass(frozen=True)
class Commit:
    """A commit: its hash, its date (ISO 8601, UTC offset and all) and the first line of its message."""

    hash: str
    date: str
    subject: str

    @property
    def short(self) -> str:
        return self.hash[:DIGITS]


def commits(span: str, entry: Entry) -> list[Commit]:
    """The commits of `span` (git's A..B) that change the folder of a variant's renderer, the oldest first; before them
    A, or the last commit up to A that did. UserError if git knows no such span, or none of its commits changes the
    folder.
    """
    folder = entry.renderer.folder
    first, dots, last = span.partition("..")
    if not (dots and first and last) or last.startswith("."):
        raise UserError(f'--commits: expected two commits, A..B, found "{span}"')
    for name in (first, last):
        if _git(folder, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{name}^{{commit}}") is None:
            raise UserError(f"--commits {span}: the repository of {folder} has no commit {name}")
    log = "log", "--format=%H%x00%cI%x00%s"
    logs = [_git(folder, *log, *words, "--", ".") for words in (("-1", first), ("--reverse", "--topo-order", span))]
    if not logs[1]:
        raise UserError(f"--commits {span}: none of them changes {folder}")
    return [Commit(*line.split("\0")) for text in logs if text for line in text.splitlines()]


def others(where: str, entries: Iterable[Entry]) -> dict[str, Entry]:
    """The same variants in another version, by the names of `entries`.

    where: a folder (a renderer's, one that holds such folders, or a checkout whose folder `renderers` does), or a
    commit as git takes it. UserError if it is neither, or lacks a variant.
    """
    if Path(where).is_dir():
        return {entry.name: _in_folder(Path(where), entry) for entry in entries}
    return {entry.name: _at_commit(where, entry) for entry in entries}


def _in_folder(where: Path, entry: Entry) -> Entry:
    """`entry` as it is in a folder."""
    for folder in registry.named((where, where / "renderers")):
        if (folder / "renderer.toml").is_file() and (version := _in(folder, entry, OF_FOLDER)):
            return version
    raise UserError(f"--against {where}: no renderer in it has the variant {entry.variant.name}")


def _at_commit(where: str, entry: Entry) -> Entry:
    """`entry` as it was at a commit, whose files are kept in the cache."""
    folder = entry.renderer.folder
    top, home = (_git(folder, "rev-parse", option) for option in ("--show-toplevel", "--absolute-git-dir"))
    if top is None:
        why = f"--against {where}: no such folder, and {folder} is in no git repository"
        raise UserError(why, remedy="give the folder of the other version")
    commit = _git(folder, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{where}^{{commit}}")
    if commit is None:
        raise UserError(f"--against {where}: no such folder, and no commit of the repository in {top}")
    there = "{compiler}", f"--git-dir={home}", "--work-tree={build}"
    words = *there, "restore", "--worktree", f"--source={commit}", "."
    try:
        tree = builder.make("commit", commit, Path(top), "git", words).folder
    except builder.BuildError as error:
        raise UserError(f"--against {where}: {error}") from None
    then = tree / folder.relative_to(Path(top).resolve())
    version = _in(then, entry, commit[:DIGITS]) if (then / "renderer.toml").is_file() else None
    if version is None:
        raise UserError(f"--against {where}: {commit[:DIGITS]} has no variant {entry.variant.name} in {folder}")
    return version


def _in(folder: Path, entry: Entry, label: str) -> Entry | None:
    """`entry` as it is in a renderer's folder; None if it is not there.

    If its manifest does not say what counting needs (`[count]`), today's does: versions from before it could not be
    counted in Valgrind.
    """
    own_manifest = manifest.load(folder)
    renderer = Renderer(
        folder,
        own_manifest
        if own_manifest.count
        else own_manifest.model_copy(update={"count": entry.renderer.manifest.count}),
    )
    variants = (variant for variant in renderer.manifest.variant if variant.name == entry.variant.name)
    return next((Entry(renderer, variant, label) for variant in variants), None)


def _git(folder: Path, *words: str) -> str | None:
    """What git says in a folder; None if it fails, or is not there. UserError if it refuses to look."""
    try:
        return git.ask(folder, *words)
    except git.Distrusted as error:
        raise UserError(str(error)) from None
