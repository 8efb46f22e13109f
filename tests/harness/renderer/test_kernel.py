"""`kernel`: what a renderer is built with beside what the job needs. It may cost time; it may change no byte."""

import json
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from feature_scenes import features
from pydantic import ValidationError

from harness.experiment.image import Image
from harness.judge import reference
from harness.process import repetition
from harness.renderer import registry
from harness.renderer.manifest import Manifest
from harness.renderer.parameters import NEEDS, Parameters
from harness.renderer.registry import Entry, Renderer
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.generate.comparison import comparison
from harness.scene.needs import SHAPES, needs, shapes
from harness.system import cuda

KNOWN = registry.entries()
ABLE = [
    name for name, entry in KNOWN.items() if "general" in entry.methods.get("kernel", ()) and not entry.variant.exhibit
]
SERIAL = [name for name in ABLE if KNOWN[name].variant.threads == 1]  # the others run the same code
# Scenes that use each need between them, and none of them all.
MIXED = (
    *("air", "glossy, the study's weight", "mix: adaptive glass", "mix: glass mesh and solid in water"),
    "mix: soft shadows and gloss through a lens",
)
FEW = {"width": 6, "height": 5} if cuda.simulated() else {"width": 26, "height": 22}
MIRRORS = text.read(comparison(12, 2), "mirrors")

# A point off the middle of a pixel, lights that have a radius and numbers that nothing asks for: a kernel that carries
# what it does not need finds them all.
UNASKED = {"sample_x": 0.3, "sample_y": 0.9, "samples": 3, "seed": 5, "adaptive_threshold": 0.01, "focal_distance": 6.0}


@pytest.fixture
def maker():
    """A renderer of a few features, which is never started."""
    variant = {"name": "v", "command": ("x",)}
    more = {"features": ("sphere", "lens", "soft", "region", "rays"), "methods": {"kernel": ("needed", "general")}}
    told = Manifest(contract=1, name="m", technology="t", description="d", variant=(variant,), **more)
    return Entry(Renderer(Path("/nowhere"), told), told.variant[0])


def kernel(value, **more):
    return Parameters(kernel=value, **more)


def test_needs_are_those_of_the_contract():
    page = (registry.folders()[0].parent / "README.md").read_text("utf-8")
    table = page.partition("### Needs")[2].partition("## Output files")[0]
    rows = re.findall(r"^\| (`.*?) \|", table, re.MULTILINE)
    assert sorted(re.findall(r"`([a-z]+)`", " ".join(rows))) == sorted(NEEDS)
    assert set(SHAPES.values()) < set(NEEDS)


def test_what_is_given_by_hand(maker):
    given = maker.renderer.given
    assert given(kernel("needed"), ("sphere",)) == ("sphere",)
    assert given(kernel("needed+lens"), ("sphere",)) == ("sphere", "lens")
    assert given(kernel("needed+sphere+lens"), ("sphere",)) == ("sphere", "lens")
    assert given(kernel("general"), ("lens",)) == ("lens", "sphere", "soft")  # region and rays are no needs
    assert given(kernel("general"), ("no-such-feature",))[0] == "no-such-feature"


def test_who_can_carry_what(maker, known):
    wanted = {value: repetition.unsupported(maker, kernel(value), ("sphere",)) for value in ("general", "needed+lens")}
    assert wanted == {"general": None, "needed+lens": None}
    assert repetition.unsupported(maker, kernel("needed+csg"), ("sphere",)) == "does not support csg"
    assert (
        repetition.unsupported(known["python"], kernel("general"), ("sphere",)) == "has no kernel general (has needed)"
    )


@pytest.mark.parametrize("value", ["all", "needed+", "needed+lense", "general+lens", "needed lens", ""])
def test_a_wrong_value_is_told_with_the_names(value):
    with pytest.raises(ValidationError, match=r"expected .needed., .general., or .* names: sphere, .*cutoff"):
        Image(kernel=value)


def test_the_job_keeps_its_own_needs(known):
    """What is carried is no part of the picture, of its reference, or of its record."""
    carried = kernel("general", shadows=True)
    assert (
        carried.picture() == kernel("needed+lens", shadows=True).picture() == kernel("needed", shadows=True).picture()
    )
    assert reference.job_of(carried).kernel == "needed"
    assert needs(MIRRORS, carried) == needs(MIRRORS, kernel("needed", shadows=True))


def test_the_program_is_told_what_it_has(maker, monkeypatch):
    """In its flags and in job.json; and which part of that is only carried, by `kernel`."""
    heard = {}

    def hear(command, neutral, *_):
        heard.update(word[2:].split("=", 1) for word in command if word.startswith("--"))
        heard["file"] = json.loads((neutral.parent / "job" / "job.json").read_text())["needs"]
        return SimpleNamespace(failed="not started")

    monkeypatch.setattr(repetition.process, "run", hear)
    repetition.start(maker, {}, kernel("needed+lens"), ("sphere",))
    assert (heard["needs"], heard["file"], heard["kernel"]) == ("sphere,lens", ["sphere", "lens"], "needed+lens")


@pytest.mark.slow
@pytest.mark.parametrize("name", ABLE)
def test_a_general_kernel_says_what_it_has(name, known, tmp_path):
    """And a build is made with it, one for all that ask for the same."""
    entry = known[name]
    if entry.unavailable:
        pytest.skip(entry.unavailable)
    needed = needs(MIRRORS, Parameters(depth=2))
    result = run(entry, MIRRORS, tmp_path, kernel="needed+lens", depth=2)
    assert set(result.said.used["features"]) == {*needed, "lens"}
    if entry.renderer.manifest.build:
        words = entry.renderer.build(kernel("general"), needed).command
        assert {f"-DNEED_{feature.upper()}" for feature in NEEDS if feature in entry.renderer.manifest.features} <= {
            *words
        }
        assert entry.renderer.build(kernel("general"), needed) is entry.renderer.build(kernel("general"), ("sphere",))
        assert "-DNEED_LENS" not in entry.renderer.build(kernel("needed"), needed).command


def run(entry, scene, cache, **parameters):
    threads = {"threads": entry.threads()}
    blocks = {"block_width": 4, "block_height": 4} if entry.simulated else {}
    wanted = Parameters(**{**FEW, **threads, **blocks, **UNASKED, **parameters})
    result = repetition.run(entry, flatten(scene), wanted, needs(scene, wanted), cache=cache)
    assert result.status == "ok", (parameters, result.status, result.reason, result.stderr)
    return result


def same(one, other):
    assert other.said.rays == one.said.rays
    np.testing.assert_array_equal(other.array, one.array)
    assert other.array.tobytes() == one.array.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("name", SERIAL)
def test_what_is_carried_changes_no_byte(name, precision, known, request, tmp_path):
    """All needs, and of C++ a third at a time: of a scene that uses few, whose lights have a radius.

    In float32, where a ratio can be rounded in two ways, of glass too.
    """
    entry = known[name]
    if entry.unavailable:
        pytest.skip(entry.unavailable)
    mirrors = text.read(re.sub(r"(LIGHT.*) 0\n", r"\1 0.4\n", comparison(12, 2)), "mirrors, wide lights")
    assert all(light.radius > 0 for light in mirrors.lights)
    cache = request.config.cache.mkdir("rayrace-compiled") / name
    needed = needs(mirrors, Parameters(depth=3))
    spare = [feature for feature in NEEDS if feature not in needed and feature in entry.renderer.manifest.features]
    assert {"ambient", "shadows", "soft", "cutoff"} < set(spare) and "sphere" not in spare
    cases = [(mirrors, {"depth": 3}, "general")]
    if precision == "float64" and entry.renderer.manifest.build:
        cases += [(mirrors, {"depth": 3}, "+".join(["needed", *spare[k::3]])) for k in range(3)]
    if precision == "float32":
        source, jobs = features(tmp_path)["csg mesh"]
        cases += [(text.read(source, "csg mesh"), jobs, "needed+media+attenuation")]
    for scene, jobs, carried in cases:
        print(carried)
        plain = run(entry, scene, cache, **jobs, precision=precision)
        same(plain, run(entry, scene, cache, **jobs, precision=precision, kernel=carried))


@pytest.mark.nightly("test_every_pair has general kernels with every scene by day; here C++ is built 6 times")
@pytest.mark.slow
@pytest.mark.parametrize("name", SERIAL)
def test_a_general_kernel_makes_every_picture(name, known, request, tmp_path):
    """One kernel for scenes of each feature and their mixes: it uses what each needs, and changes no byte."""
    entry = known[name]
    if entry.unavailable:
        pytest.skip(entry.unavailable)
    cache = request.config.cache.mkdir("rayrace-compiled") / name
    cases, used = features(tmp_path), set()
    for case in MIXED:
        source, jobs = cases[case]
        scene = text.read(source, case)
        if repetition.unsupported(entry, Parameters(**jobs), needs(scene, Parameters(**jobs))):
            continue
        print(case)
        used |= set(needs(scene, Parameters(**jobs)))
        jobs = {"samples": 1, **jobs}
        same(run(entry, scene, cache, **jobs), run(entry, scene, cache, **jobs, kernel="general"))
    assert {*NEEDS} - used == {"cutoff"}


@pytest.mark.slow
@pytest.mark.parametrize("name", SERIAL)
def test_a_general_kernel_finds_the_same_hits(name, known, request):
    entry = known[name]
    if entry.unavailable:
        pytest.skip(entry.unavailable)
    seed = 8
    print("seed", seed)
    rng = np.random.default_rng(seed)
    rays = np.concatenate([rng.uniform(-6, 6, (40, 3)), rng.normal(size=(40, 3))], axis=1)
    arrays = {**flatten(MIRRORS), "rays": rays}
    cache = request.config.cache.mkdir("rayrace-compiled") / name
    needed = tuple(sorted(shapes(MIRRORS)))
    wanted = [Parameters(kind="rays", kernel=value) for value in ("needed", "general")]
    plain, general = (repetition.run(entry, arrays, parameters, needed, cache=cache) for parameters in wanted)
    assert plain.status == general.status == "ok", general.reason
    assert (plain.array[:, 7] >= 0).any() and plain.array.tobytes() == general.array.tobytes()
