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
    "experiment": ASKED | {"reference": {"against": "centres", "depth": 10, "spots": 100}},
    "command": ["rayrace", "run", "experiments/a.toml"],
}


# Of a picture, held against the truth of the scene.
OF_SCENE = {
    "truth": "judge", "against": "scene", "truth_file": "pictures/t.truth.npy", "standard_error_file": None,
    "certificate": {"spots": 10, "digits": 60, "largest": 1e-13}, "samples": 1024, "depth": 16, "change": 1e-5,
    "uncertainty": 1e-3, "rmse": 0.0625, "rmse_standard_error": 2e-5, "max": 0.75, "bad_pixels": 0.25,
    "relative_mse": 0.01, "mask_fraction": 0.25, "psnr_db": 24.0, "ssim": 0.875, "flip": 0.125, "flip_file": None,
}  # fmt: skip


def error(rmse, sampled=True):
    """Held against the areas of pixels, or their centres."""
    certificate = {"unavailable": "sampled"} if sampled else {"spots": 100, "digits": 60, "largest": 2.1e-13}
    return {
        "truth": "judge", "against": "areas" if sampled else "centres", "truth_file": "pictures/t.npy", "depth": 10,
        "change": None, "samples": 64 if sampled else 1, "uncertainty": NOISE if sampled else None,
        "certificate": certificate, "rmse": rmse, "rmse_standard_error": NOISE / 10 if sampled else 0.0,
        "max": 9 * rmse, "bad_pixels": min(rmse, 1), "flip": {"unavailable": "too small"},
    }  # fmt: skip


def by_name(chart):
    return {point.name: point for point in chart.points}
