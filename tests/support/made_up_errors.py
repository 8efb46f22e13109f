"""Errors and facts of runs that were never made, for tests of reports."""

NOISE = 1.2e-4  # standard error of a made-up sampled truth
DEFAULTS = {
    "width": 512, "height": 512, "region": "0,0,512,512", "depth": 10, "shadows": 1, "sampler": "one", "samples": 1,
    "adaptive_depth": 3, "adaptive_threshold": 0.1, "lens_radius": 0.0, "focal_distance": 1.0, "feelers": 0,
    "glossy_rays": 0, "glossy_weight": "plain", "seed": 0, "walk": "least", "accel": "auto", "sphere": "robust",
    "floating_point": "strict", "cutoff": 0.0, "epsilon": 3.6e-15,
}  # fmt: skip
ASKED = {"processes": 1, "frames": 2, "seed": 1, "override": {}, "image": {}, "measure": {"interval": 0.05}}
FACTS = {
    "experiment": ASKED | {"reference": {"depth": 10, "spots": 100}},
    "command": ["rayrace", "run", "experiments/a.toml"],
}


def error(rmse, sampled=True):
    certificate = {"unavailable": "sampled"} if sampled else {"spots": 100, "digits": 60, "largest": 2.1e-13}
    return {
        "truth": "judge", "truth_file": "pictures/t.npy", "pictures": 64 if sampled else 1, "certificate": certificate,
        "standard_error": NOISE if sampled else None, "rmse": rmse, "max": 9 * rmse, "bad_pixels": min(rmse, 1),
        "max_outside": 5 * rmse, "flip": {"unavailable": "too small"},
    }  # fmt: skip


def by_name(chart):
    return {point.name: point for point in chart.points}
