"""What of the arrays decides how the kernel is built."""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # or NumPy's idle BLAS threads spin while Numba is imported

import numpy as np


def count_shapes(job):
    """How many shapes a ray is tried against, triangles one by one."""
    names = ("sphere_ids", "box_ids", "polygon_ids", "ellipsoid_ids", "csg_ids")
    triangles = int(np.load(job.array("mesh_ranges"))[:, 1].sum())
    return triangles + sum(len(np.load(job.array(name), mmap_mode="r")) for name in names)


def largest_part(job):
    """Triangles of the largest mesh that is a part of a CSG solid."""
    return int(np.load(job.array("csg_meshes"))[:, 1].max(initial=0))
