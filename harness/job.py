"""A job: the scene as arrays and the parameters, in a folder, for one renderer (renderers/README.md)."""

import contextlib
import dataclasses
import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np


def default_epsilon(precision: str) -> float:
    """32 u (NUM-2, OFF-1) of a precision: float64, float32, or mpmath's with so many digits, such as mp60."""
    if precision.startswith("mp") and precision[2:].isdigit():
        return 16 * 10.0 ** (1 - int(precision[2:]))
    return 32 * {"float32": 2.0**-24}.get(precision, 2.0**-53)


FIXED_EPSILON = 1e-4  # OFF-1: the length that is so often seen in code


NOT_IN_THE_PICTURE = (
    *("threads", "frames", "least_frame", "walk", "accel", "kernel"),
    *("scene_memory", "block_width", "block_height", "total_threads", "max_registers"),
)


# What a job may need (renderers/README.md).
NEEDS = (
    *("sphere", "box", "polygon", "ellipsoid", "mesh", "csg", "ambient", "diffuse", "phong", "shadows", "soft"),
    *("reflection", "transmission", "glossy", "attenuation", "media", "supersampling", "adaptive", "lens", "cutoff"),
)


@dataclass(frozen=True)
class Parameters:
    """The parameters of a job, with the names and units of the contract."""

    kind: str = "image"
    width: int = 512
    height: int = 512
    region: tuple[int, int, int, int] | None = None  # None: the whole picture
    depth: int = 10
    shadows: bool = False
    sampler: str = "one"
    samples: int = 1
    adaptive_depth: int = 3
    adaptive_threshold: float = 0.1
    lens_radius: float = 0.0
    focal_distance: float = 1.0
    feelers: int = 0
    glossy_rays: int = 0
    glossy_weight: str = "plain"
    seed: int = 0
    walk: str = "least"
    accel: str = "auto"
    arithmetic: str = "linear"
    sphere: str = "robust"
    triangle: str = "watertight"
    slab: str = "branch"
    merge: str = "tolerant"
    offset: str = "bounded"
    fresnel: str = "clamped"
    phong: str = "clamped"
    renormalise: str = "on"
    kernel: str = "needed"  # or "general", or what it carries unneeded: "needed+shadows+lens"
    vector: str = "off"
    floating_point: str = "strict"
    cutoff: float = 0.0
    sample_x: float = 0.5
    sample_y: float = 0.5
    precision: str = "float64"
    epsilon: float | None = None  # None: 32 u of the precision, for a fixed offset FIXED_EPSILON (OFF-1)
    threads: int = 1
    frames: int = 0
    least_frame: float = 0.0  # s; frames that would be shorter consist of several renders
    scene_memory: str = "auto"  # of a GPU, as what follows
    block_width: int = 16
    block_height: int = 16
    total_threads: int = 0  # 0: one for each pixel
    max_registers: int = 0  # of a thread; 0: as many as the compiler likes

    def bounds(self) -> tuple[int, int, int, int]:
        return self.region or (0, 0, self.width, self.height)

    def shape(self) -> tuple[int, int, int]:
        """Shape of the picture."""
        x0, y0, x1, y1 = self.bounds()
        return y1 - y0, x1 - x0, 3

    def values(self) -> dict[str, str | int | float]:
        """As the contract spells them."""
        values = dataclasses.asdict(self)
        values["region"] = ",".join(map(str, self.bounds()))
        values["shadows"] = int(self.shadows)
        usual = FIXED_EPSILON if self.offset == "fixed" else default_epsilon(self.precision)
        values["epsilon"] = usual if self.epsilon is None else self.epsilon
        return values

    def picture(self) -> "Parameters":
        """These parameters without those that may not change the picture."""
        default = Parameters()
        return dataclasses.replace(self, **{name: getattr(default, name) for name in NOT_IN_THE_PICTURE})

    def carried(self, features: tuple[str, ...]) -> tuple[str, ...]:
        """What the kernel of a renderer with these features carries, whether the job needs it or not."""
        if self.kernel == "general":
            return tuple(name for name in NEEDS if name in features)
        return tuple(self.kernel.split("+")[1:])

    def defines(self, needs: tuple[str, ...]) -> tuple[str, ...]:
        """What a program is built with for this job, as words for a compiler of C or C++ (the contract's {defines})."""
        names = [*(f"NEED_{name}" for name in sorted(needs)), f"KIND_{self.kind}", f"PRECISION_{self.precision}"]
        return tuple("-D" + name.upper().replace("-", "_") for name in names)


def write(folder: Path, arrays: dict[str, np.ndarray], parameters: Parameters, needs: tuple[str, ...]) -> None:
    """Write the job's folder: the arrays and job.json."""
    folder.mkdir(parents=True)
    for name, array in arrays.items():
        np.save(folder / f"{name}.npy", np.ascontiguousarray(array))
    values = {**parameters.values(), "needs": list(needs)}
    (folder / "job.json").write_text(json.dumps(values, indent=1) + "\n")


def seal(folder: Path) -> dict[str, tuple]:
    """What changes with each file of a job's folder, whoever changes it: ctime cannot be set back."""
    found = {}
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            stat = entry.stat(follow_symlinks=False)
            found[entry.name] = stat.st_ino, stat.st_mode, stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns
    return found


def changed(folder: Path, sealed: dict[str, tuple]) -> list[str]:
    """Names of what is no longer as it was when `sealed`."""
    now = seal(folder)
    return sorted(name for name in {*now, *sealed} if now.get(name) != sealed.get(name))


def flags(folder: Path, out: Path, variant: str, cache: Path | None, parameters: Parameters, needs: tuple[str, ...]):
    """The same parameters as `--key=value` words."""
    values = {"job": folder, "out": out, "variant": variant, **parameters.values()}
    values |= {"needs": ",".join(needs), "cache": cache or ""}
    return [f"--{key}={value}" for key, value in values.items()]


def count_shapes(arrays: dict[str, np.ndarray]) -> dict[str, int]:
    """How many shapes of each kind a ray is tried against; a CSG solid is one, whatever its parts."""
    rows = {"sphere": "spheres", "box": "boxes", "polygon": "polygon_ranges", "ellipsoid": "ellipsoids"}
    counts = {kind: len(arrays[name]) for kind, name in rows.items()}
    return {**counts, "triangle": int(arrays["mesh_ranges"][:, 1].sum()), "csg": len(arrays["csg_ranges"])}


def fingerprint(arrays: dict[str, np.ndarray], *more) -> str:
    """Hash of the content of arrays and anything else that has a stable repr."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {array.shape}\0".encode() + array.tobytes())
    digest.update(repr(more).encode())
    return digest.hexdigest()[:16]
