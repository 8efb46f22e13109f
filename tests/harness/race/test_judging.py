"""What pictures are judged by: references that runs share, the truth of sampled ones, and the bound of a cut-off."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest

from harness.experiment import experiment as experiments
from harness.judge import reference
from harness.plan import plan
from harness.process import repetition
from harness.race import race
from harness.race.host import ThisHost
from harness.race.judging import Judging

SCENE = """CAMERA (0,0,0) (1,0,0) (0,0.9,0) (0.3,0.2,4)
AMBIENT (0.2,0.2,0.2)
BACKGROUND (0.3,0.4,0.5)
LIGHT (4,5,6) (0.9,0.9,0.8) 0
SPHERE (-0.4,0.1,0) 0.4 (0.7,0.5,0.3) 0.6 20 (0,0,0) 1e6 1
SPHERE (0.5,-0.1,-0.3) 0.4 (0.3,0.5,0.7) 0.8 20 (1,1,1) 2.25 1
"""
# In a box of mirrors, each bounce leaves half of the light.
MIRRORS = (
    "CAMERA (0,0,0) (1,0,0) (0,0.9,0) (0.3,0.2,4)\nAMBIENT (0.2,0.2,0.2)\n"
    "BOX (-5.1,-5.3,-5.2) (10.1,0.3,0.2) (-0.3,11,0.1) (-0.1,0.2,12) (0.6,0.7,0.8) 0.5 20 (0,0,0) 1e9 1\n"
)


class Counting(ThisHost):
    """Runs here, keeps references in a folder of its own, and tells which jobs were no cell's."""

    def __init__(self, folder, change=lambda result: result, spoil=lambda result: result):
        super().__init__()
        self.folder, self.change, self.spoil, self.jobs = folder, change, spoil, []

    @property
    def references(self):
        return self.folder

    def untimed(self):
        return contextlib.nullcontext(self)

    def close(self):
        pass

    def run(self, entry, arrays, parameters, needs, series=None, **more):
        if series is None:
            self.jobs.append((entry.name, parameters))
            return self.spoil(repetition.run(entry, arrays, parameters, needs, **more))
        return self.change(repetition.run(entry, arrays, parameters, needs, series=series, **more))


@pytest.fixture
def run(experiment, known, tmp_path):
    """A function that runs an experiment on SCENE: rows, and the host."""

    def go(more, name="run", change=lambda r: r, renderers=("python",), spoil=lambda r: r, scene=SCENE):
        # Without later frames, whose check makes jobs too.
        file = experiment(renderers, more, scene=scene, size=14, frames=0)
        asked = experiments.load(file)
        host = Counting(tmp_path / "kept", change, spoil)
        records = race.run(asked, plan.make(asked, file, known), known, tmp_path / name, host=host)
        return records, host

    return go


AT_CENTRES = "[reference]\nagainst = 'centres'\ndepth = 'own'\n"


def test_at_the_centres_the_truth_is_the_reference(run):
    (row,), host = run(AT_CENTRES + "spots = 7\n")
    error = row["error"]
    assert row["status"] == "ok" and error["samples"] == 1 and error["uncertainty"] is None
    assert (error["against"], error["depth"], error["change"]) == ("centres", row["parameters"]["depth"], None)
    assert error["max"] < 1e-12 == error["bad_pixels"] + 1e-12
    certificate = error["certificate"]
    assert (certificate["spots"], certificate["wrong"]) == (7, 0) and certificate["largest"] < 1e-12
    made = len(host.jobs)
    assert made == 1 + 8 + 1, host.jobs  # the reference, its mask, which is empty, the truth


def test_a_truth_at_the_centres_is_certified_as_deep_as_it_came_to_be(run):
    """Half of the light is left after each bounce: depth 8, where the truth begins, is not enough."""
    (row,), _ = run("[reference]\nagainst = 'centres'\nspots = 40\n", scene=MIRRORS)
    error = row["error"]
    assert "unavailable" not in error and error["depth"] > 8
    print(error)
    certificate = error["certificate"]
    assert certificate["spots"] == 40 and certificate["wrong"] == 0 and certificate["median"] < 1e-12


@pytest.mark.parametrize("more", ["[reference]\nspots = 20\n", AT_CENTRES + "spots = 20\n"])
def test_a_truth_that_60_digits_refute_is_none(run, more):
    (row,), _ = run(more, spoil=lambda result: replace(result, array=result.array + 1e-8))
    assert "is not what 60 digits make in" in row["error"]["unavailable"]


def test_a_run_takes_what_another_has_made(run, tmp_path):
    more = "[reference]\nspots = 5\n[sweep]\nsampler = ['one', 'jittered']\n"
    first, _ = run(more)
    again, host = run(more, name="again")
    assert host.jobs == []
    for before, now in zip(first, again, strict=True):
        assert now["error"] == before["error"] and now["agreement"] == before["agreement"]
        for name in (now["error"]["truth_file"], now["agreement"]["mask_file"]):
            np.testing.assert_array_equal(np.load(tmp_path / "again" / name), np.load(tmp_path / "run" / name))


def test_a_better_truth_is_made_where_the_kept_one_has_too_few_samples(run):
    first, _ = run("")
    more, host = run("[sweep]\nsampler = ['jittered']\nsamples = [2]\n", name="more")
    assert more[0]["error"]["samples"] == 4 * first[0]["error"]["samples"] and host.jobs
    again, host = run("", name="again")
    assert again[0]["error"]["samples"] == more[0]["error"]["samples"] and not host.jobs


def test_all_pictures_of_a_scene_share_its_truth(run, tmp_path):
    """One sample a pixel, at two depths, and jittered ones: errors fall with samples, and depth 0 lacks all mirrors."""
    rows, host = run(
        "[reference]\nspots = 0\n"
        "[[points]]\ndepth = [0]\n[[points]]\nsampler = ['jittered']\nsamples = [1, 2, 4]\n[[points]]\ndepth = [5]\n"
    )
    errors = {(row["parameters"]["samples"], row["parameters"]["depth"]): row["error"] for row in rows}
    assert len({error["truth_file"] for error in errors.values()}) == 1
    told = errors[4, 1]  # of the experiment: depth 1
    assert told["against"] == "scene" and told["samples"] >= 64 * 16 and told["change"] <= 1e-3 and told["depth"] >= 16
    jittered = {r["parameters"]["samples"]: r["error"]["rmse"] for r in rows if r["parameters"]["sampler"] != "one"}
    assert jittered[1] > jittered[2] > jittered[4] > 4 * told["uncertainty"] > 0
    assert errors[1, 0]["rmse"] > 2 * errors[1, 5]["rmse"]
    file = np.load(tmp_path / "run" / told["standard_error_file"])
    lacking = told["change"] + told["unseen"]
    assert np.hypot(np.sqrt(np.mean(file**2)), lacking) == pytest.approx(told["uncertainty"])
    seeds = {parameters.seed for _, parameters in host.jobs if parameters.samples > 4}
    assert len(seeds) == 4 and rows[0]["parameters"]["seed"] not in seeds


def test_a_picture_that_is_wrong_in_ill_conditioned_pixels_alone_is_wrong(run, monkeypatch, tmp_path):
    """All of them off by 0.3; the mask is made large by a move of the samples that is."""
    monkeypatch.setattr(reference, "ULPS", 2.0**18)
    (right,), _ = run("")
    mask = np.load(tmp_path / "run" / right["agreement"]["mask_file"])
    low, high = np.load(tmp_path / "run" / right["agreement"]["span_file"])
    assert right["status"] == "ok" and 13 < mask.sum() < mask.size and low.shape == high.shape == (mask.sum(), 3)
    # As far off as two spans are wide: spans are as wide as edges are here.
    off = np.zeros((*mask.shape, 3))
    off[mask] = 0.3 + 2 * (high - low)
    (row,), _ = run("", name="wrong", change=lambda result: replace(result, array=result.array + off))
    assert row["status"] == "wrong picture" and "inside the mask" in row["reason"], row["reason"]
    assert row["agreement"]["max_outside"] < 1e-9


CUT = "[sweep]\ncutoff = ['1/8']\n"


def test_a_cut_off_is_judged_within_its_bound(run, tmp_path):
    (row,), _ = run(AT_CENTRES + CUT)
    assert row["status"] == "ok"
    assert 1e-3 < row["error"]["max"] <= row["bound"]["max"] * (1 + 1e-12)
    dropped = np.load(tmp_path / "run" / row["bound"]["dropped_file"])
    assert row["bound"]["max"] == pytest.approx(row["bound"]["radiance"] * dropped.max())


def test_a_weight_that_is_told_too_small_is_a_wrong_picture(run):
    """Half the dropped weight would still hold here, as the bound is no estimate; none does not."""
    (row,), _ = run(CUT, change=lambda result: replace(result, dropped=np.zeros_like(result.dropped)))
    assert row["status"] == "wrong picture" and "bound of its cut-off" in row["reason"]


def test_dropped_weights_are_asked_for(run, monkeypatch):
    """A renderer that cuts off and does not tell how much has failed."""
    load = repetition._load_dropped
    monkeypatch.setattr(
        repetition, "_load_dropped", lambda out, told, *more: load(out, replace(told, dropped=None), *more)
    )
    (row,), _ = run(CUT)
    assert row["status"] == "failed" and "CUT-2" in row["reason"]


def test_what_makes_a_reference_runs_alone():
    """All other processes of renderers are closed before it, and it is before others begin; unless one is kept."""
    heard = []

    class Untimed:
        def close(self):
            heard.append("closed")

    class Stored:
        def __init__(self, found=None):
            self.found = found

        def get(self, _):
            return self.found

        def put(self, *_):
            heard.append("kept")

    judging = object.__new__(Judging)
    judging.made, judging.untimed, judging.kept = {}, Untimed(), Stored()
    arguments = lambda made: (made, {}), lambda facts, _: facts
    assert judging._once("a", lambda: heard.append("made") or {"x": 1}, *arguments) == ({"x": 1}, {})
    assert heard == ["closed", "made", "closed", "kept"]
    judging.kept = Stored(({"x": 2}, {}))
    assert judging._once("b", lambda: heard.append("made again"), *arguments)[0] == {"x": 2}
    assert "made again" not in heard
