"""Every pair of values of methods and parameters, by night every triple, for every renderer (conformance_spaces.py).

The cases differ from commit to commit (seeds.py); a failure prints the command that repeats it.
"""

import functools
import itertools
import os
from collections import Counter
from dataclasses import replace

import conformance_spaces as spaces
import covering
import pytest
import seeds
from judged import Court

from harness.process import repetition
from harness.renderer import registry
from harness.scene.flatten import flatten
from harness.scene.needs import needs
from harness.system import cuda

SIZE = 16, 12
if cuda.simulated():
    SIZE = 6, 5  # a millisecond a ray
OF_PROCESSORS = [name for name in spaces.RENDERERS if name not in (*spaces.ON_DEVICES, "numba-cuda")]
HERE = ["numba-cuda"] if cuda.simulated() else [*OF_PROCESSORS, *spaces.ON_DEVICES]
PARTS = 12  # tests that share the cases of a renderer, so that several processes can run them
PARTS_OF_TRIPLES = 40
# The renderers that make references, the quickest first.
MAKERS = {"cpp": ("numpy", "python")}
OTHERS = ("cpp", "numpy", "python")
CASE = "RAYRACE_CASE"  # environment variable: the number of a case, which then is the only one


@pytest.fixture(scope="module")
def court(bench):
    return Court(bench)


@functools.cache
def array(renderer, strength):
    return covering.cover(spaces.space(renderer), strength, f"{seeds.seed()} {renderer}")


def attempt(bench, court, renderer, case):
    """None, or what is wrong with the picture of a case."""
    entry = bench.known[spaces.variant(renderer, case)]
    scene, wanted = spaces.scenes()[case["scene"]].scene, spaces.parameters(case, SIZE)
    needed = needs(scene, wanted)
    reason = repetition.unsupported(entry, wanted, needed)
    if reason:
        return f"the manifest refuses it: {reason}"
    if entry.simulated:
        wanted = replace(wanted, block_width=4, block_height=4)
    result = bench.run(entry, flatten(scene), wanted, needed)
    if result.status != "ok":
        return f"{result.status}: {result.reason} {result.stderr[-500:]}"
    for method, value in result.said.used["methods"].items():
        asked = case.get(method, value)
        if (
            asked not in ("auto", "least", value) and method != "accel"
        ):  # without shapes that a tree can hold there is none
            return f"it says that {method} was {value}"
    makers = tuple(name for name in MAKERS.get(renderer, OTHERS) if name != renderer)
    return court.wrong(makers, scene, wanted, result)


def try_part(bench, court, renderer, strength, part, parts, test):
    bench.entry(renderer)
    cases = array(renderer, strength)
    space = spaces.space(renderer)
    order = {kernel: number for number, kernel in enumerate(dict.fromkeys(map(space.kernel, cases)))}
    only = os.environ.get(CASE)
    mine = [n for n, case in enumerate(cases) if order[space.kernel(case)] % parts == part]
    judged, faults = 0, []
    print(f"seed {seeds.seed()}: cases {mine} of {len(cases)}")
    for number in mine if only is None else {int(only)} & set(mine):
        wrong = attempt(bench, court, renderer, cases[number])
        judged += 1
        if wrong:
            told = ", ".join(f"{name}={value}" for name, value in cases[number].items())
            faults.append(f"case {number}: {told}\n  {wrong}\n  again: {seeds.again(test, **{CASE: number})}")
    assert not faults, f"{len(faults)} of {judged} cases\n" + "\n".join(faults)
    assert only is not None or judged == len(mine)


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("renderer", HERE)
def test_every_pair(bench, court, request, renderer, part):
    try_part(bench, court, renderer, 2, part, PARTS, request.node.nodeid)


@pytest.mark.nightly("triples: CI has the pairs")
@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS_OF_TRIPLES))
@pytest.mark.parametrize("renderer", HERE)
def test_every_triple(bench, court, request, renderer, part):
    try_part(bench, court, renderer, 3, part, PARTS_OF_TRIPLES, request.node.nodeid)


@pytest.mark.parametrize("renderer", HERE)
def test_the_array_has_every_pair(renderer):
    """Every possible pair occurs; the others are refused, with a reason."""
    space, cases = spaces.space(renderer), array(renderer, 2)
    found, possible = set(), space.possible(2)
    for case in cases:
        assert space.allowed(case)
        found |= covering.tuples(case, 2)
    assert found == possible  # a pair beyond `possible` would show that its rule is wrong
    kernels = set(map(space.kernel, cases))
    print(f"{renderer}: {len(possible)} pairs in {len(cases)} cases with {len(kernels)} kernels")
    refusal = spaces.REFUSALS.get(renderer, spaces.refusal)
    refused = Counter(refusal({**space.defaults, **dict(pair)}) for pair in set(space.all(2)) - possible)
    for reason, count in refused.items():
        assert reason
        print(f"  {count} refused: {reason}")


@pytest.mark.parametrize("renderer", HERE)
def test_nothing_of_a_manifest_is_left_out(renderer):
    """All methods and their values are factors, except those of `left_out`."""
    methods, factors = registry.entries()[renderer].methods, spaces.factors(renderer)
    lacking = {(name, value) for name in methods for value in methods[name] if value not in factors.get(name, ())}
    assert lacking == spaces.left_out(renderer)


def test_another_seed_is_another_array():
    arrays = [covering.cover(spaces.space(HERE[0]), 2, seed) for seed in ("a", "a", "b")]
    assert arrays[0] == arrays[1] != arrays[2]


@pytest.mark.parametrize("strength", [2, 3])
def test_a_small_space(strength):
    """All tuples except the forbidden ones; cases of one kernel follow each other, and there are few kernels."""
    factors = {"a": (0, 1, 2), "b": (0, 1, 2), "c": (0, 1), "d": tuple(range(7))}
    space = covering.Space(
        factors,
        allowed=lambda case: case["a"] == 0 or case["d"] != 6,
        kernel=lambda case: (case["a"], case["b"]),
        price=lambda _: 60,
        begin={"a": (0, 1, 2), "b": (0, 1, 2)},
    )
    cases = covering.cover(space, strength, "seed")
    everything = [dict(zip(factors, values, strict=True)) for values in itertools.product(*factors.values())]
    wanted = set().union(*(covering.tuples(case, strength) for case in everything if space.allowed(case)))
    assert all(map(space.allowed, cases))
    assert set().union(*(covering.tuples(case, strength) for case in cases)) == wanted < set(space.all(strength))
    assert len(cases) < 126 / (1.5 if strength == 3 else 4)
    kernels = [space.kernel(case) for case in cases]
    assert len(list(itertools.groupby(kernels))) == len(set(kernels)) == 9
