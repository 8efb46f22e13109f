"""The hierarchy of cpp spares the tests that it is there for (HIT-6), which no picture tells."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from harness.renderer import builder, registry

SEED = 11
PROGRAM = r"""
#include "shapes/bvh.hpp"
#include <cstdio>

// Of boxes and then rays on standard input: how many boxes each ray is tried against, and a hash of which, in turn. The
// tree is built by as many threads as the argument says.
int main(int, char** arguments)
{
    int boxes, rays;
    if (std::scanf("%d %d", &boxes, &rays) != 2)
        return 1;
    std::vector<Bounds<double>> bounds(static_cast<std::size_t>(boxes));
    std::vector<int> numbers;
    double x[6];
    const auto read = [&] { for (double& number : x) if (std::scanf("%lf", &number) != 1) std::abort(); };
    for (Bounds<double>& box : bounds) {
        read();
        box = {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
        numbers.push_back(int(numbers.size()));
    }
    const Bvh<double> tree(bounds, numbers, std::atoi(arguments[1]));
    const double most = 1e9;
    for (int i = 0; i < rays; i++) {
        read();
        unsigned tried = 0, hash = 0;
        const Ray<double> ray{{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
        tree.search(ray, 0.0, most, [&](int number) { return tried++, hash = 31 * hash + unsigned(number), false; });
        std::printf("%u %u\n", tried, hash);
    }
}
"""


@pytest.fixture(scope="module")
def tried(tmp_path_factory):
    """tried(boxes (B, 6), rays (R, 6), threads): of each ray the number of boxes tried, and a hash of which (R, 2)."""
    compiler = builder.find_compiler("c++")
    if compiler is None:
        pytest.skip(builder.MISSING["c++"])
    folder = tmp_path_factory.mktemp("tree")
    (folder / "tree.cpp").write_text(PROGRAM)
    sources = registry.entries()["cpp"].renderer.folder
    words = [
        "-std=c++20",
        "-O1",
        f"-I{Path(sources)}",
        "-DNEED_SPHERE",
        "-DKIND_RAYS",
        "-DPRECISION_FLOAT64",
        "-pthread",
    ]
    subprocess.run([compiler, *words, folder / "tree.cpp", "-o", folder / "tree"], check=True, timeout=120)

    def run(boxes, rays, threads=1):
        lines = [f"{len(boxes)} {len(rays)}", *(" ".join(map(repr, row)) for row in [*boxes.tolist(), *rays.tolist()])]
        command = [folder / "tree", str(threads)]
        done = subprocess.run(command, input="\n".join(lines), capture_output=True, text=True, check=True)
        return np.array(done.stdout.split(), dtype=int).reshape(-1, 2)

    return run


def met(boxes, rays):
    """How many boxes each ray meets."""
    low, high = boxes[:, None, :3], boxes[:, None, 3:]
    sides = (np.stack([low, high]) - rays[:, :3]) / rays[:, 3:]
    enter, leave = sides.min(axis=0).max(axis=-1), sides.max(axis=0).min(axis=-1)
    return (np.maximum(enter, 0) <= leave).sum(axis=0)


@pytest.mark.parametrize("gap", [1.0, 3.0, 30.0])
def test_few_boxes_are_tried_in_vain(tried, gap):
    """Clusters of boxes with nothing between them: most of the bins in which a split is sought are empty."""
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    places = np.stack(np.meshgrid(*3 * [np.arange(4)]), axis=-1).reshape(-1, 3) * gap
    turns = rng.normal(size=(200, 3))
    centres = (places[:, None] + 0.4 * turns / np.linalg.norm(turns, axis=1, keepdims=True)).reshape(-1, 3)
    boxes = np.hstack([centres - 0.03, centres + 0.03])
    towards = boxes[rng.integers(len(boxes), size=400), :3] + 0.03
    origins = 4 * gap * rng.normal(size=(400, 3))
    rays = np.hstack([origins, (towards - origins) / np.linalg.norm(towards - origins, axis=1, keepdims=True)])
    found, right = tried(boxes, rays)[:, 0], met(boxes, rays)
    print(f"tried {found.mean():.1f} of {len(boxes)}, {right.mean():.1f} of them met")
    assert (found >= right).all() and right.mean() > 1
    assert found.mean() < 3 * right.mean()


@pytest.mark.parametrize("spread", ["even", "uneven"])
def test_the_tree_is_the_same_for_any_number_of_threads(tried, spread):
    """Boxes for several threads, of the same density everywhere, or most of them in a corner."""
    print("seed", SEED)
    rng = np.random.default_rng([SEED, len(spread)])
    centres = rng.uniform(-1, 1, (30_000, 3)) ** (1 if spread == "even" else 9)
    sizes = rng.uniform(0, 0.02, (len(centres), 3))
    boxes = np.hstack([centres - sizes, centres + sizes])
    directions = rng.normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    rays = np.hstack([centres[:300] - 3 * directions, directions])
    alone = tried(boxes, rays)
    assert (alone[:, 0] >= met(boxes, rays)).all()
    for threads in (2, 3, 5, 8):
        np.testing.assert_array_equal(tried(boxes, rays, threads), alone, f"{threads} threads")
