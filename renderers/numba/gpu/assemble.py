"""Places each array of the scene in a GPU memory, and generates the function that collects them in a kernel.

Kernels take the Scene as the processor's do, and cannot tell where its arrays are: in global memory, constant memory or
shared memory; work memory is local memory, of the thread alone. Sizes of all but the first must be known when the
kernel is compiled. So the function `assemble`, with a line for each array, is written for the job.
"""

from collections import namedtuple

import numpy as np
from numba.cuda import types

from renderers import worker

from .. import needs
from ..scene import Scene
from ..target import inlined
from .device import cuda
from .tiles import copy, rank

SCRATCH = 8 * needs.THREADS  # bytes of shared memory that render.py takes
TILE = 4096  # bytes of a tile

TILES = {  # table of shapes: its tile, in which it is streamed
    "spheres": "sphere_tile",
    "boxes": "box_tile",
    "polygon_corners": "polygon_tile",
    "ellipsoids": "ellipsoid_tile",
    "triangles": "triangle_tile",
}
ZEROED = ("csg_overflow", "lattice_marks")  # work memory that is read before it is written
FEW = ("camera", "sample", "colours", "lens", "lights", "media", "materials")  # beside the tiles, as far as they fit
TYPES = {np.dtype(name).type: getattr(types, name) for name in ("float32", "float64", "int32", "int64")}


@inlined
def copy_by_place(table, tile):
    """The fault "index": rows counted from the block's place in the picture, as of a matrix, and not from the first."""
    rows = len(table)
    for k in range(rank(), rows, needs.THREADS):
        row = (k + cuda.blockIdx.x * cuda.blockDim.x + cuda.blockIdx.y * cuda.blockDim.y) % rows
        for column in range(table.shape[1]):
            tile[k, column] = table[row, column]


@inlined
def clear(tile):
    for k in range(rank(), len(tile), needs.THREADS):
        tile[k] = 0


class Layout:
    """Of the fields of the Scene: what is an argument of the kernel, and what it makes itself.

    tables, work: of load.py. arguments: namedtuple of what must be given to the kernel, on the host.
    """

    def __init__(self, tables, work):
        self.constant, self.shared, self.local = {}, {}, {}
        arrays = {
            name: value for name, value in tables.items() if name in Scene._fields and isinstance(value, np.ndarray)
        }
        inside = {name: array for name, array in arrays.items() if array.size and name not in ("corners", "dropped")}
        if needs.MEMORY == "constant":
            self.constant = inside
            self._limit("constant", needs.CONSTANT_BYTES, sum(array.nbytes for array in inside.values()))
        elif needs.MEMORY == "shared":
            if needs.STREAMED:
                self.shared = _tiles(arrays)
                inside = {name: inside[name] for name in FEW if name in inside}
            for name, array in inside.items():
                if not needs.STREAMED or self.shared_bytes + array.nbytes <= needs.SHARED_BYTES:
                    self.shared[name] = array.shape, array.dtype.type
            self._limit("shared", needs.SHARED_BYTES, self.shared_bytes)
        self.local = {name: ((1, *shape), np.dtype(dtype).type) for name, (shape, dtype) in work.items()}
        if self.local_bytes > needs.LOCAL_BYTES:
            worker.refuse(
                f"a thread's work memory takes {self.local_bytes} bytes, more than a GPU's {needs.LOCAL_BYTES}"
            )
        given = [name for name in Scene._fields if name in tables and name not in self.constant]
        self.arguments = namedtuple("Tables", given)(**{name: tables[name] for name in given})
        self.filled = [name for name in given if name in self.shared]  # from the arguments

    def _limit(self, memory, limit, size):
        if size > limit:
            worker.refuse(f"scene_memory {memory}: the scene takes {size} bytes, more than {limit}; use global")

    @property
    def constant_bytes(self):
        return sum(array.nbytes for array in self.constant.values())

    @property
    def shared_bytes(self):
        return SCRATCH + _bytes(self.shared)

    @property
    def local_bytes(self):
        return _bytes(self.local)

    def source(self):
        """Of `assemble`."""
        lines = ["def assemble(tables):"]
        for name in Scene._fields:
            lines.append(f"    {name} = {self._made(name)}")
        for name in ZEROED:
            if name in self.local:
                lines += [f"    for k in range({self.local[name][0][1]}):", f"        {name}[0, k] = 0"]
        if needs.FAULT:  # what was in shared memory before, nobody knows; the exhibits shall show the same everywhere
            lines += [f"    clear({name})" for name in self.filled] + ["    cuda.syncthreads()"]
        for name in self.filled:
            if name == "materials" and needs.FAULT == "index":
                lines.append(f"    copy_by_place(tables.{name}, {name})")
            else:
                lines.append(f"    copy(tables.{name}, {name}, 0, {len(getattr(self.arguments, name))})")
        if self.filled and needs.FAULT != "barrier":
            lines.append("    cuda.syncthreads()")
        return "\n".join([*lines, f"    return Scene({', '.join(Scene._fields)})", ""])

    def _made(self, name):
        if name in self.constant:
            return f"cuda.const.array_like(constant_{name})"
        for memory, arrays in (("shared", self.shared), ("local", self.local)):
            if name in arrays:
                shape, dtype = arrays[name]
                return f"cuda.{memory}.array({tuple(map(int, shape))}, {np.dtype(dtype).name})"
        return f"tables.{name}"

    def assemble(self):
        """The function: from the kernel's arguments to a Scene. All threads of a block call it at once."""
        names = {"cuda": cuda, "Scene": Scene, "copy": copy, "copy_by_place": copy_by_place, "clear": clear}
        names |= {np.dtype(dtype).name: kind for dtype, kind in TYPES.items()}
        names |= {f"constant_{name}": array for name, array in self.constant.items()}
        exec(compile(self.source(), "<assemble>", "exec"), names)
        return inlined(names["assemble"])


def _tiles(arrays):
    """Shape and type of the tiles, and of the ranges of polygons that go with theirs."""
    found = {}
    for name, tile in TILES.items():
        if name in arrays:
            row = arrays[name].shape[1:]
            found[tile] = (TILE // (int(np.prod(row)) * arrays[name].itemsize), *row), arrays[name].dtype.type
    if "polygon_ranges" in arrays:
        corners = found["polygon_tile"][0][0]
        most = int(arrays["polygon_ranges"][:, 1].max(initial=0))
        if most > corners:
            worker.refuse(f"scene_memory shared: a polygon has {most} vertices, and a tile holds {corners}; use global")
        found["polygon_range_tile"] = (corners // 3, 2), np.int32
    return found


def _bytes(arrays):
    return sum(int(np.prod(shape)) * np.dtype(dtype).itemsize for shape, dtype in arrays.values())
