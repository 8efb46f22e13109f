"""The exhibits in the study's style: slow on purpose, right in picture, ranked with none."""

from pathlib import Path

import numpy as np
import pytest

from harness.judge import judge
from harness.process import repetition
from harness.race import row
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs
from renderers.study import target, trace

COMPARISON = (Path(__file__).parents[2] / "experiments" / "scenes" / "comparison.txt").read_text()
# The eye is inside the large sphere: what it sees is lit and mirrored from within.
INSIDE = (
    "CAMERA (0.1,-0.2,0) (2.1,0,-0.2) (0,2.1,0) (0.4,0.9,6.1)\nAMBIENT (0.4,0.5,0.3)\nBACKGROUND (0.5,0.6,0.8)\n"
    "AIR 1.21 1.1 (1,1,1)\nLIGHT (1.1,2.3,4.2) (0.9,0.8,0.7) 0\nSPHERE (0,0,0) 9 (0.7,0.5,0.3) 0.6 20 (0,0,0) 9 1.2\n"
    "SPHERE (0.3,0.2,0.1) 1.1 (0.2,0.6,0.3) 0.8 7.5 (0,0,0) 400 1\nSPHERE (-1.2,0.9,0.4) 0.5 (1,0,1) 0 1 (0,0,0) 1 1\n"
)
JOB = {"width": 24, "height": 20, "depth": 6, "shadows": True}
INTERPRETED = "study-python", "study-python-table", "study-python-tuples"
COMPILED = (
    *("study-numba-parallel", "study-numba", "study-numba-tuples", "study-numba-object"),
    *("study-numba-signatures", "study-numba-aot"),
)


def reference_of(bench, known, source, **parameters):
    wanted, scene = Parameters(**parameters), text.read(source, "scene of the test")
    return bench.reference(known["python"], flatten(scene), wanted, needs(scene, wanted))


@pytest.fixture(scope="module")
def found(bench, known):
    """The reference picture of each scene."""
    return {source: reference_of(bench, known, source, **JOB) for source in (COMPARISON, INSIDE)}


@pytest.mark.parametrize("variant", INTERPRETED)
@pytest.mark.parametrize("source", [COMPARISON, INSIDE], ids=["comparison", "inside"])
def test_pictures(bench, found, variant, source):
    check(bench, found, variant, source)


@pytest.mark.slow
@pytest.mark.parametrize("variant", COMPILED)
def test_pictures_that_numba_compiles(bench, found, variant):
    check(bench, found, variant, COMPARISON)


def check(bench, found, variant, source):
    """Renders, and asserts that the picture is right by the judge and has as many rays as the reference."""
    result = bench.result(variant, source, exact=True, **JOB)
    verdict = judge.judge(result.array, found[source], "float64")
    print(f"{variant}: {verdict} {result.said.rays}")
    assert verdict.wrong is None, verdict.wrong
    assert judge.compare_rays(result.said.rays, found[source].rays, "float64") is None
    assert result.said.rays["non_finite"] == 0 and result.said.rays["primary"] == 24 * 20
    assert result.array.std() > 1e-3, "the scene shows nothing"
    methods = result.said.used["methods"]
    if variant == "study-python-table":
        assert (methods["walk"], methods["walk_rows"]) == ("table", 2**7 - 1)
    else:
        assert methods["walk"] == "recursion"


@pytest.mark.slow
@pytest.mark.parametrize("variant", ["study-numba-signatures", "study-numba-aot"])
def test_what_is_compiled_before_the_first_call(bench, variant):
    """All compiling is in its own phase: a frame of nothing takes no time after it."""
    result = bench.result(variant, COMPARISON, exact=True, width=2, height=2, depth=1)
    first = result.said.frames[0]
    spent = {phase["name"]: phase["end"] - phase["start"] for phase in result.said.phases}
    print(spent, first)
    assert first["end"] - first["start"] < 0.1 * (spent["compile"] + spent["import"])


@pytest.mark.slow
def test_a_library_is_made_once_and_then_needs_no_numba(bench, known, tmp_path):
    entry, scene = bench.entry("study-numba-aot"), text.read(COMPARISON, "scene of the test")
    wanted = Parameters(**JOB)
    cold, warm = (
        repetition.run(entry, flatten(scene), wanted, needs(scene, wanted), cache=tmp_path / "cache") for _ in range(2)
    )
    assert (cold.status, warm.status) == ("ok", "ok"), (cold.reason, cold.stderr, warm.reason, warm.stderr)
    assert [one.said.used["methods"]["compile_cache"] for one in (cold, warm)] == ["cold", "warm"]
    assert "numba" in cold.said.versions and "numba" not in warm.said.versions
    assert cold.array.tobytes() == warm.array.tobytes()


def test_every_function_has_a_signature(bench):
    """A function that is added to the tracer is compiled at once too, or is named here."""
    names = set()
    trace.define(
        lambda function: names.add(function.__name__) or function, lambda function: function, range, False, False
    )
    assert names - set(target.SIGNATURES) == {"ray_trace_by_table"}
    assert set(target.SIGNATURES) - names == {"render"}


def test_a_region_and_a_moved_sample(bench):
    job = JOB | {"sample_x": 0.25, "sample_y": 0.875, "exact": True}
    whole = bench.picture("study-python", INSIDE, **job)
    part = bench.picture("study-python", INSIDE, region=(5, 3, 20, 18), **job)
    assert part.tobytes() == whole[3:18, 5:20].tobytes()
    assert not np.array_equal(whole, bench.picture("study-python", INSIDE, exact=True, **JOB))


def test_depth_is_not_limited_by_the_interpreter(bench):
    """Two balls mirror each other, and a ray goes to and fro between them as deep as it may."""
    mirrors = (
        "CAMERA (0,0,0) (0.1,0,0) (0,0.1,0) (0,0,1)\nAMBIENT (1,1,1)\n"
        "SPHERE (0,0,-9) 5 (0.1,0.1,0.1) 1 9 (0,0,0) 1e9 1\n"
        "SPHERE (0,0,9) 5 (0.1,0.1,0.1) 1 9 (0,0,0) 1e9 1\n"
    )
    result = bench.result("study-python", mirrors, exact=True, width=1, height=1, depth=1500)
    assert result.said.rays["reflected"] == 1500


def test_an_exhibit_has_no_rank(bench, known):
    result = bench.result("study-python", COMPARISON, exact=True, width=2, height=2, depth=1)
    for name in (*INTERPRETED, *COMPILED):
        assert row.unranked(known[name], result.said).startswith("exhibit of a cost: ")


@pytest.mark.parametrize("change, reason", [({}, "transmission"), ({"precision": "float32"}, "precision")])
def test_what_it_lacks_is_refused(bench, change, reason):
    """By itself too, and not only by its manifest."""
    scene = text.read(INSIDE, "scene of the test")
    wanted = Parameters(width=4, height=4, **change)
    lacked = () if change else ("transmission",)
    result = repetition.start(bench.entry("study-python"), flatten(scene), wanted, lacked)
    assert result.status == "unsupported" and reason in result.reason, (result.status, result.reason)


def test_a_table_too_large_is_refused(bench):
    """WLK-2, before a ray is traced."""
    scene = text.read(INSIDE, "scene of the test")
    wanted = Parameters(width=4, height=4, depth=28)
    result = repetition.start(bench.entry("study-python-table"), flatten(scene), wanted, needs(scene, wanted))
    assert result.status == "unsupported" and "2^29 - 1 rows" in result.reason, (result.status, result.reason)
