"""The cold pass: one process more of each cell in each round, which finds no code of an earlier one."""

import pytest
from mock_host import Behaviour, Mock, planned

from harness.plan import predict
from harness.race import race
from reports.run import results

SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"


class Caching(Mock):
    """Compiles for 5 s where the cache is empty, and fills it. `caches`: what each process was given."""

    caches = ()

    def run(self, entry, *rest, cache=None, **more):
        if entry.name in self.behaviours:
            self.caches += (cache,)
            if cache is None or not cache.exists():
                self.now += 5.0
            if cache is not None:
                cache.mkdir(parents=True, exist_ok=True)
        return super().run(entry, *rest, cache=cache, **more)


@pytest.fixture
def asked(tmp_path, write):
    """asked('count = true'): an experiment of two mock renderers, its plan, and who is known."""
    return lambda measure="": planned(write, tmp_path, measure, 6, SCENE)


@pytest.mark.parametrize("order", ["interleaved", "sequential"])
def test_every_cell_is_run_cold_in_every_round(asked, order):
    _, planned, _ = asked("cold = true")
    turns = planned.order(1, order)
    for cell in planned.cells:
        for kind in ("timed", "cold"):
            assert sorted(turn.number for turn in turns if turn[::2] == (cell, kind)) == list(range(6))
    assert len(turns) == 2 * 2 * 6 + 6  # and the A/A pair
    assert {turn.kind for turn in asked()[1].order(1, order)} == {"timed", "pair"}


def test_it_finds_no_cache_and_is_in_no_time_but_its_own(asked, tmp_path):
    wanted, planned, known = asked('cold = true\npair = "off"')
    mock = Caching({"a": Behaviour(0.5), "b": Behaviour(0.25)})
    records = race.run(wanted, planned, known, tmp_path / "run", host=mock)
    assert mock.caches.count(None) == 12 and len({cache for cache in mock.caches if cache}) == 2
    took = {
        kind: [r["took_s"] for r in records if r["pass"] == kind and r["variant"] == "a"] for kind in ("cold", "timed")
    }
    assert took["cold"] == pytest.approx([6.05] * 6)
    assert took["timed"] == pytest.approx([6.05] + [1.05] * 5)
    loaded = results.load(tmp_path / "run")
    assert [len(cell.timed) for cell in loaded.cells] == [6, 6]
    expected = predict.Predictor(records).seconds(planned.cells[0])
    assert expected.seconds == pytest.approx(1.05)
