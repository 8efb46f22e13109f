"""One way to put a renderer under stress."""

import pytest

from harness import stress
from harness.experiment.image import Image
from harness.process import repetition
from harness.stress import job


@pytest.fixture
def strain(bench):
    """strain(variant, row, level, precision, seed, **methods): the Finding of a row of the catalogue at a level.

    The test is skipped if the variant cannot do it.
    """

    def run(variant, row, level, precision="float64", seed=7, **methods):
        print(f"{row} at {level:g}, {precision}, seed {seed}, {methods}")
        entry = bench.entry(variant)
        wanted = job.Stressed(stress.rows()[row], level, precision, seed)
        image = Image(**{**wanted.trial.parameters, "precision": precision, **methods})
        parameters = wanted.parameters(image, entry.threads() if image.threads == "default" else image.threads, 0)
        reason = repetition.unsupported(entry, parameters, wanted.needs(parameters))
        if reason:
            pytest.skip(f"{variant} {reason}")
        if entry.simulated and image.floating_point != "strict":
            pytest.skip("the simulator of a GPU is strict")
        arrays, needs = wanted.flat(image.arithmetic)[1], wanted.needs(parameters)
        # What a pixel takes hangs on the kernel; Numba compiles the least the quickest.
        of_kernel = stress.rows()[row].method == "walk" or not entry.renderer.manifest.build
        if parameters.kind == "rays" or not of_kernel:
            parameters = bench.sharing(entry, parameters, needs)
        result = bench.run(entry, arrays, parameters, needs)
        assert result.status == "ok", f"{variant}: {result.status}: {result.reason}\n{result.stderr}"
        finding = wanted.trial.judge(result)
        print(f"{variant}: {finding.failures} of {finding.count} wrong, errors {finding.record()}")
        return finding

    return run
