"""The kernel's source for a job: its files in reading order, behind the names of what the job needs and asks for."""

from pathlib import Path

FOLDER = Path(__file__).parent / "kernel"
FILES = (
    *("target", "vector", "scene", "random"),
    *("shapes/sphere", "shapes/box", "shapes/mesh", "shapes/polygon", "shapes/ellipsoid", "shapes/bvh", "shapes/csg"),
    *("search", "shade", "contact", "trace", "walk", "render"),
)
FEATURES = (
    *("sphere", "box", "polygon", "ellipsoid", "mesh", "csg", "ambient", "diffuse", "phong", "shadows", "soft"),
    *("reflection", "transmission", "glossy", "attenuation", "media", "contact"),
    *("supersampling", "sobol", "adaptive", "lens", "cutoff"),
)
FORMS = ("sphere", "offset", "triangle", "slab", "merge", "fresnel", "phong", "renormalise", "floating_point")


def names(job, **sizes):
    """What is defined before the source; the first value of a method needs no name. sizes: by name, as integers."""
    found = {f"NEED_{name.upper()}": int(name in job.needs) for name in FEATURES}
    found["KIND_IMAGE"] = int(job.kind == "image")
    for method in FORMS:
        found[f"{method}_{getattr(job, method)}".upper().replace("-", "_")] = 1
    found[f"PRECISION_{job.precision.upper()}"] = 1
    if job.max_registers:
        found["MAX_REGISTERS"] = job.max_registers  # of CUDA
    return found | {"GROUP_WIDTH": job.block_width, "GROUP_HEIGHT": job.block_height} | sizes


def source(defined):
    lines = [f"#define {name} {value}" for name, value in sorted(defined.items())]
    for name in FILES:
        lines += [f'#line 1 "{name}.h"', (FOLDER / f"{name}.h").read_text(encoding="utf-8")]
    return "\n".join(lines)
