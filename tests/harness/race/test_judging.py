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

SCENE = """CAMERA (0,0,0) (1,0,0) (0,0.9,0) (0.3,0.2,4)
AMBIENT (0.2,0.2,0.2)
BACKGROUND (0.3,0.4,0.5)
LIGHT (4,5,6) (0.9,0.9,0.8) 0
SPHERE (-0.4,0.1,0) 0.4 (0.7,0.5,0.3) 0.6 20 (0,0,0) 1e6 1
SPHERE (0.5,-0.1,-0.3) 0.4 (0.3,0.5,0.7) 0.8 20 (1,1,1) 2.25 1
"""


class Counting(ThisHost):
    """Runs here, keeps references in a folder of its own, and tells which jobs were no cell's."""

    def __init__(self, folder, change=lambda result: result, spoil=lambda result: result):
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

    def go(more, name="run", change=lambda result: result, renderers=("python",), spoil=lambda result: result):
        file = experiment(renderers, more, scene=SCENE, size=14)
        asked = experiments.load(file)
        host = Counting(tmp_path / "kept", change, spoil)
        records = race.run(asked, plan.make(asked, file, known), known, tmp_path / name, host=host)
        return records, host

    return go


@pytest.mark.nightly
def test_without_samples_the_truth_is_the_reference(run):
    (row,), host = run("[reference]\nspots = 7\n")
    error = row["error"]
    assert row["status"] == "ok" and error["pictures"] == 1 and error["standard_error"] is None
    assert error["truth"] != "python" and error["max"] < 1e-12 == error["bad_pixels"] + 1e-12
    certificate = error["certificate"]
    assert (certificate["spots"], certificate["wrong"]) == (7, 0) and certificate["largest"] < 1e-12
    assert len(host.jobs) == 1 + 8 + 1  # the reference, its mask, the truth


def test_a_truth_that_60_digits_refute_is_none(run):
    (row,), _ = run("[reference]\n", spoil=lambda result: replace(result, array=result.array + 1e-9))
    assert "is not what 60 digits make in" in row["error"]["unavailable"]


@pytest.mark.nightly
def test_a_run_takes_what_another_has_made(run, tmp_path):
    more = "[reference]\n[sweep]\nsampler = ['one', 'jittered']\n"
    first, _ = run(more)
    again, host = run(more, name="again")
    assert host.jobs == []
    for before, now in zip(first, again, strict=True):
        assert now["error"] == before["error"] and now["accuracy"] == before["accuracy"]
        for name in (now["error"]["truth_file"], now["accuracy"]["mask_file"]):
            np.testing.assert_array_equal(np.load(tmp_path / "again" / name), np.load(tmp_path / "run" / name))


@pytest.mark.nightly
def test_a_sampled_picture_is_compared_with_the_mean_of_many(run, tmp_path):
    rows, host = run("[reference]\n[sweep]\nsampler = ['jittered']\nsamples = [1, 2, 4]\n")
    errors = {row["parameters"]["samples"]: row["error"] for row in rows}
    assert errors[1]["rmse"] > errors[2]["rmse"] > errors[4]["rmse"] > 2 * errors[4]["standard_error"] > 0
    assert {error["truth_file"] for error in errors.values()} == {errors[1]["truth_file"]}
    made = [parameters for _, parameters in host.jobs if parameters.samples == 8]
    assert len(made) == errors[1]["pictures"] == 16 and len({parameters.seed for parameters in made}) == 16
    assert rows[0]["parameters"]["seed"] not in {parameters.seed for parameters in made}
    told = np.load(tmp_path / "run" / errors[1]["standard_error_file"])
    assert np.sqrt(np.mean(told**2)) == pytest.approx(errors[1]["standard_error"])


@pytest.mark.nightly
def test_without_a_table_no_sampled_truth_is_made(run):
    (row,), _ = run("[sweep]\nsampler = ['jittered']\nsamples = [2]\n")
    assert row["status"] == "ok" and "[reference]" in row["error"]["unavailable"]


def test_a_picture_that_is_wrong_in_ill_conditioned_pixels_alone_is_wrong(run, monkeypatch, tmp_path):
    """All of them off by 0.3; the mask is made large by a move of the samples that is."""
    monkeypatch.setattr(reference, "ULPS", 2.0**18)
    (right,), _ = run("")
    mask = np.load(tmp_path / "run" / right["accuracy"]["mask_file"])
    low, high = np.load(tmp_path / "run" / right["accuracy"]["span_file"])
    assert right["status"] == "ok" and 13 < mask.sum() < mask.size and low.shape == high.shape == (mask.sum(), 3)
    # As far off as two spans are wide: spans are as wide as edges are here.
    off = np.zeros((*mask.shape, 3))
    off[mask] = 0.3 + 2 * (high - low)
    (row,), _ = run("", name="wrong", change=lambda result: replace(result, array=result.array + off))
    assert row["status"] == "wrong picture" and "inside the mask" in row["reason"], row["reason"]
    assert row["accuracy"]["max_outside"] < 1e-9


CUT = "[sweep]\ncutoff = ['1/8']\n"


def test_a_cut_off_is_judged_within_its_bound(run, tmp_path):
    (row,), _ = run(CUT)
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
