"""What of the arrays decides how the kernel is built."""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # or NumPy's idle BLAS threads spin while Numba is imported

import numpy as np


def count_shapes(job):
    """How many shapes a ray is tried against, triangles one by one: the work that a tree may save.

    All but spheres count twice, as they take about that long.
    """
    others = sum(_length(job, name + "_ids") for name in ("box", "polygon", "ellipsoid", "csg"))
    triangles = int(np.load(job.array("mesh_ranges"))[:, 1].sum() + np.load(job.array("csg_meshes"))[:, 1].sum())
    return _length(job, "sphere_ids") + 2 * (others + triangles)


def _length(job, name):
    return len(np.load(job.array(name), mmap_mode="r"))


def largest_part(job):
    """Triangles of the largest mesh that is a part of a CSG solid."""
    return int(np.load(job.array("csg_meshes"))[:, 1].max(initial=0))
