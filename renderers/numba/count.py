"""Properties of the arrays that decide how the kernel is built."""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # or NumPy's idle BLAS threads spin while Numba is imported

import numpy as np


def count_shapes(job):
    """The number of shapes that a ray is tested against, triangles one by one: the work that a tree may save.

    All but spheres count twice, as they take about that long.
    """
    others = sum(_length(job, name + "_ids") for name in ("box", "polygon", "ellipsoid", "csg"))
    triangles = int(np.load(job.array("mesh_ranges"))[:, 1].sum() + np.load(job.array("csg_meshes"))[:, 1].sum())
    return _length(job, "sphere_ids") + 2 * (others + triangles)


def _length(job, name):
    return len(np.load(job.array(name), mmap_mode="r"))


def ranks(job):
    """The number of clear solids (MED-2)."""
    return _length(job, "media")


def touches(job):
    """Whether clear solids may touch (MED-6)."""
    return _length(job, "precedence") > 0


def largest_part(job):
    """Triangles of the largest mesh that is a part of a CSG solid."""
    return int(np.load(job.array("csg_meshes"))[:, 1].max(initial=0))


def transmits(job):
    """Whether a material is clear and lets light through."""
    materials = np.load(job.array("materials"))
    return bool((materials[:, 5:8].any(axis=1) & (materials[:, 3] > 0)).any())


def glossy_rays(job):
    """G of GLO-1."""
    materials = np.load(job.array("materials"))
    return job.glossy_rays if ((materials[:, 3] > 0) & (materials[:, 10] > 0)).any() else 0


# Numbers of the job's precision, and int32, that the kernel keeps for a row of each array (scene.py).
ROWS = {
    **{"lights": (7, 0), "materials": (11, 0), "spheres": (4, 0), "boxes": (30, 0), "polygon_vertices": (9, 0)},
    **{"polygon_ranges": (0, 2), "ellipsoids": (21, 0), "csg_spheres": (4, 0), "csg_boxes": (30, 0)},
    **{"csg_ellipsoids": (21, 0), "csg_meshes": (0, 2), "csg_code": (1, 2), "csg_ranges": (0, 2), "media": (0, 1)},
    **{f"{name}_ids": (1, 4) for name in ("sphere", "box", "polygon", "ellipsoid", "csg")},
}


def bytes_of_scene(job):
    """The largest size of the scene in GPU memory, without a tree, in bytes."""
    reals, integers = 12 + 2 + 6 + 11 + 6, 0
    for name, (more_reals, more_integers) in ROWS.items():
        rows = _length(job, name)
        reals, integers = reals + rows * more_reals, integers + rows * more_integers
    reals += ("glossy" in job.needs) * (_length(job, "materials") + 1)  # exponents of lobes
    if touches(job):
        others = len(np.load(job.array("mesh_triangles"))) + sum(_length(job, name) for name in ROWS if "_ids" in name)
        reals, integers = reals + others, integers + others
    free, parts = (int(np.load(job.array(name))[:, 1].sum()) for name in ("mesh_ranges", "csg_meshes"))
    reals, integers = reals + 13 * (free + parts), integers + 4 * free
    return reals * np.dtype(job.precision).itemsize + integers * 4


def streamable(job):
    """How many shapes can be streamed through shared memory: all but CSG solids."""
    lone = sum(_length(job, name + "_ids") for name in ("sphere", "box", "polygon", "ellipsoid"))
    return lone + int(np.load(job.array("mesh_ranges"))[:, 1].sum())
