"""Haines' Standard Procedural Databases: our generators, rendered; ray counts against the published ones.

Protocol: 513 x 513 rays through the corners of 512 x 512 pixels, depth 5 with the eye ray counted as 1, no cut-off.
All counts are "within about 10 %" for any classical tracer (SPD Readme 3.14).
"""

import pytest
from nightly import by_night

from harness.process import repetition
from harness.renderer.parameters import Parameters
from harness.scene import nff
from harness.scene.flatten import flatten
from harness.scene.generate.spd import balls, tetra
from harness.scene.needs import needs

CORNERS = {"sampler": "adaptive", "adaptive_depth": 0, "depth": 4, "shadows": True}
PUBLISHED = {  # eye hits are of primary rays, which here are counted whether they hit or not
    "balls": (balls(4), {"reflected": 175095, "transmitted": 0, "shadow": 954368}),
    "tetra": (tetra(6), {"reflected": 0, "transmitted": 0, "shadow": 46112}),
}


def counts(bench, variant, text, **parameters):
    entry = bench.entry(variant)
    scene = nff.read(text, "generated.nff")
    wanted = Parameters(threads=entry.threads(), **parameters)
    needed = needs(scene, wanted)
    if repetition.unsupported(entry, wanted, needed):
        pytest.skip("its manifest does not have it")
    result = bench.run(entry, flatten(scene), wanted, needed)
    assert result.status == "ok", (result.reason, result.stderr)
    return result.said.rays


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLISHED)
@pytest.mark.parametrize("variant", ["cpp", "numba"])
def test_ray_counts_of_the_default_sizes(bench, name, variant):
    text, published = PUBLISHED[name]
    rays = counts(bench, variant, text, width=512, height=512, **CORNERS)
    print(name, rays)
    assert rays["primary"] == 513 * 513
    for kind, count in published.items():
        assert abs(rays[kind] - count) <= 0.1 * count, kind


@pytest.mark.parametrize("text", [balls(1), balls(2), tetra(3)], ids=["balls 1", "balls 2", "tetra 3"])
def test_all_renderers_count_the_same_at_small_sizes(bench, serial, text):
    jobs = {"width": 24, "height": 24, **CORNERS}
    assert counts(bench, serial, text, **jobs) == counts(bench, "cpp", text, **jobs)


@pytest.mark.slow
@pytest.mark.parametrize("size", by_night([1, 2, 3, 4], "1", "3", "4"))
def test_balls_of_every_size_in_the_compiled_renderers(bench, size):
    jobs = {"width": 64, "height": 64, **CORNERS}
    seen = [
        counts(bench, variant, balls(size), **jobs) for variant in ("cpp", "numba", "cpp-threads", "numba-parallel")
    ]
    assert all(rays == seen[0] for rays in seen)
