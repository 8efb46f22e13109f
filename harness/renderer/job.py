"""Writes a job folder for one renderer: the scene as arrays, and the parameters (renderers/README.md)."""

import contextlib
import hashlib
import json
import os
from pathlib import Path

import numpy as np

from harness.renderer import sobol
from harness.renderer.parameters import Parameters


def write(folder: Path, arrays: dict[str, np.ndarray], parameters: Parameters, needs: tuple[str, ...]) -> None:
    """Writes the job's folder: the arrays of the scene, those of the Sobol' sequence, and job.json."""
    folder.mkdir(parents=True)
    for name, array in {**arrays, "sobol": sobol.matrices()}.items():
        np.save(folder / f"{name}.npy", np.ascontiguousarray(array))
    describe(folder, parameters, needs)


def describe(folder: Path, parameters: Parameters, needs: tuple[str, ...]) -> None:
    """Write job.json, beside arrays that are there."""
    values = {**parameters.values(), "needs": list(needs)}
    (folder / "job.json").write_text(json.dumps(values, indent=1) + "\n")


def seal(folder: Path) -> dict[str, tuple]:
    """Records the state of each file of a job's folder, to detect changes: ctime cannot be set back."""
    states = {}
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            stat = entry.stat(follow_symlinks=False)
            states[entry.name] = stat.st_ino, stat.st_mode, stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns
    return states


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


def count_bytes(arrays: dict[str, np.ndarray]) -> int:
    """How many bytes the numbers of a scene have, as the job gives them: in float64, without rays."""
    return sum(array.nbytes for name, array in arrays.items() if name != "rays")


def fingerprint(arrays: dict[str, np.ndarray], *more) -> str:
    """Hash of the content of arrays and anything else that has a stable repr."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {array.shape}\0".encode() + array.tobytes())
    digest.update(repr(more).encode())
    return digest.hexdigest()[:16]
