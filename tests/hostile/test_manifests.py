"""Hostile renderer.toml: a renderer, available or not, or an error that names the key."""

from pathlib import Path

import hostile
import pytest

from harness.errors import UserError
from harness.renderer import manifest
from harness.renderer.builder import fill
from harness.renderer.manifest import Build, Manifest, Requires, Variant
from harness.renderer.registry import Entry, Renderer

RENDERERS = Path(__file__).parents[2] / "renderers"
MOST = 3000  # characters of a file, so that it is quick
VALID = [text for path in sorted(RENDERERS.glob("*/renderer.toml")) if len(text := path.read_text()) < MOST]
PIECES = [
    *(key for model in (Manifest, Variant, Build, Requires) for key in model.model_fields),
    *(
        "[[variant]]\n",
        "[requires]\n",
        "[build]\n",
        '"all"',
        '"../x"',
        "[",
        "]",
        "=",
        '"""',
        "\n",
        "1979-05-27",
        "{a=1}",
    ),
]
SHORT = """contract = 1
name = "x"
technology = "T"
description = "D"
features = ["sphere"]
"""
VARIANT = '[[variant]]\nname = "x"\ncommand = ["x"]\n'


@pytest.fixture
def tried(place):
    def tried(content):
        (place / "renderer.toml").write_bytes(content if isinstance(content, bytes) else content.encode())
        return hostile.outcome(lambda: read(place), "renderer.toml")

    return tried


def read(folder):
    """The manifest, and what listing its renderer asks for."""
    found = manifest.load(folder)
    renderer = Renderer(folder, found)
    assert renderer.version and renderer.lines >= 0
    for variant in found.variant:
        entry = Entry(renderer, variant)
        assert entry.unavailable is None or entry.unavailable
        [fill(word, {"folder": "f", "python": "p"}) for word in variant.command]
    return found


def test_cases(fuzz, tried):
    assert len(VALID) > 5
    fuzz("renderer.toml", lambda random: tried(hostile.mutated(random, VALID, PIECES)))


def test_strange_and_good(tried):
    for text in (SHORT + VARIANT, (SHORT + VARIANT).replace("\n", "\r\n"), "\ufeff" + SHORT + VARIANT):
        found = tried(text)
        assert isinstance(found, Manifest), found


DEEP = 100_000
BAD = {
    "nothing": (b"", "contract: Field required"),
    "NUL bytes": (b"\0" * 1000, "it has a NUL byte here"),
    "UTF-16": ((SHORT + VARIANT).encode("utf-16"), "not a text file"),
    "half a letter": (SHORT.encode() + b"# \xc3", "not a text file"),
    "nested lists": (SHORT + "x = " + "[" * DEEP, "nested"),
    "nested tables": (SHORT + "x = " + "{a=" * DEEP, "nested"),
    "a key of many parts": (SHORT + "a." * 20_000 + "a = 1\n", "too many dots"),
    "a key of 1000 parts": (SHORT + "a." * 1000 + "a = 1\n", "nested"),
    "a heading of many parts": (SHORT + "[" + "a." * 20_000 + "a]\n", "too many dots"),
    "a number of 5000 digits": (SHORT + f"x = {'1' * 5000}\n", "digits"),
    "a date that is none": (SHORT + "x = 2024-13-45\n", "at line 6"),
    "50,000 unknown keys": ("".join(f"key{n} = 1\n" for n in range(50_000)), "unknown key"),
    "one key of a megabyte": (SHORT + "k" * 10**6 + " = 1\n", "kkk ..."),
    "a text of a megabyte": ("contract = " + '"' + "x" * 10**6 + '"\n', "contract: Input should be 1"),
    "100,000 variants": (SHORT + '[[variant]]\nname = "X"\n' * 30_000, "variant.0"),
    "a shared file that is none": (SHORT + 'shares = ["\\u0000"]\n' + VARIANT, "no such file"),
    "a shared device": (SHORT + 'shares = ["/dev/zero"]\n' + VARIANT, "no such file"),
    "escapes for a terminal": (SHORT + '"\\u001b[2J" = 1\n' + VARIANT, "unknown key"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad(tried, name):
    content, match = BAD[name]
    found = tried(content)
    assert isinstance(found, UserError), found
    assert match in str(found)


@pytest.mark.parametrize(
    "module", ["", ".", ".x", "x.", "a\0b", "\ud800", "no.such.module", "sys.path", "x" * 10**5, "-"]
)
def test_a_module_that_cannot_be(tried, module):
    """Names that no module has: it is unavailable."""
    text = module.encode("unicode_escape").decode().replace("\\x00", "\\u0000")
    if "ud800" in text:
        pytest.skip("no TOML can say it")
    found = tried(SHORT + VARIANT + f'requires = {{modules = ["{text}"]}}\n')
    assert isinstance(found, Manifest), found
