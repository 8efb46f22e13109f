"""In which order the cells of a plan have their turns."""

import random
from collections import Counter
from dataclasses import fields

from harness.plan.plan import Cell, Plan, Turn


def cells(*processes):
    rest = dict.fromkeys(field.name for field in fields(Cell))
    return tuple(Cell(**{**rest, "key": f"c{n}", "processes": count}) for n, count in enumerate(processes))


def test_every_cell_once_a_round():
    rng = random.Random(7)
    for seed in range(20):
        counts = [rng.randint(1, 6) for _ in range(rng.randint(1, 8))]
        order = Plan(cells(*counts), {}).order(seed)
        assert Counter(turn.cell.key for turn in order) == {f"c{n}": count for n, count in enumerate(counts)}
        rounds = [turn.number for turn in order]
        assert rounds == sorted(rounds)
        for repetition in range(max(counts)):
            keys = [turn.cell.key for turn in order if turn.number == repetition]
            assert sorted(keys) == sorted(f"c{n}" for n, count in enumerate(counts) if count > repetition)


def test_the_seed_decides_the_order():
    some = Plan(cells(*[5] * 8), {})

    def keys(seed):
        return [turn.cell.key for turn in some.order(seed)]

    assert keys(1) == keys(1) != keys(2)
    assert keys(1)[:8] != keys(1)[16:24]
    assert Plan((), {}).order(1) == []


def test_linear_drift_meets_all_cells_alike():
    order = Plan(cells(*[6] * 9), {}).order(3)
    places = {}
    for place, turn in enumerate(order):
        places.setdefault(turn.cell.key, []).append(place)
    assert len({sum(found) for found in places.values()}) == 1
    assert len({tuple(found) for found in places.values()}) == 9


def test_sequential():
    order = Plan(cells(2, 1, 3), {}).order(1, "sequential")
    assert [(turn.cell.key, turn.number) for turn in order] == [
        ("c0", 0), ("c0", 1), ("c1", 0), ("c2", 0), ("c2", 1), ("c2", 2),
    ]  # fmt: skip


def test_the_pair_has_turns_of_its_own():
    some = cells(5, 3, 5)
    paired = Plan(some, {}, pair=some[0])
    order = paired.order(4)
    assert Counter(turn.kind for turn in order) == {"timed": 13, "pair": 5}
    first = [turn for turn in order if turn.kind == "pair"]
    assert [turn.number for turn in first] == [0, 1, 2, 3, 4] and {turn.cell.key for turn in first} == {"c0"}
    assert [turn.number for turn in order] == sorted(turn.number for turn in order)
    between = [
        order.index(Turn(some[0], number, "pair")) - order.index(Turn(some[0], number, "timed")) for number in range(5)
    ]
    assert min(between) < 0 < max(between)
    kinds = [turn.kind for turn in paired.order(4, "sequential") if turn.cell is some[0]]
    assert kinds == ["timed"] * 5 + ["pair"] * 5
