"""Reads meshes (OBJ, PLY, STL, OFF, glTF), cleans them and places them in the scene's frame.

OBJ, PLY and OFF have readers of their own; faces of more than three corners are cut into triangles (faces.py). Equal
vertices become one, so that adjacent triangles share an edge; triangles without an area are removed. A closed mesh is
then turned outward (surface.py).
"""

import io
import math
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from harness.errors import UserError
from harness.scene import check, surface
from harness.scene.mesh import obj, off, ply
from harness.scene.mesh.faces import Fault, triangles

READERS = {".obj": obj.read, ".ply": ply.read, ".off": off.read}
SUFFIXES = (".obj", ".ply", ".stl", ".off", ".glb", ".gltf")
LARGEST = 1 << 32  # bytes of a file
MEMORY = 1 << 30  # bytes that reading a mesh may take, in addition to 100 times its size
COPIES = 10**7  # triangles, at most, in repeated meshes: a short text could ask for any number


class Files:
    """The meshes of one scene, each file read once. folder: the start of relative paths."""

    def __init__(self, folder):
        self.folder = folder
        self.read = {}
        self.copied = 0

    def placed(self, path, position, rotation, scale):
        """Vertices (V, 3), triangles (T, 3) and whether they are closed, moved by T * Rx * Ry * Rz * S.

        rotation: three angles in degrees. UserError, without a place, for a file without a valid mesh.
        """
        again = path in self.read
        if not again:
            self.read[path] = _clean(*_load(path, self.folder / path), path)
        vertices, triangles, closed = self.read[path]
        self.copied += again * len(triangles)
        if self.copied > COPIES:
            remedy = "use them less often, or coarser ones"
            raise UserError(f"copies of meshes come to more than {COPIES:,} triangles here", remedy=remedy)
        vertices = (scale * vertices) @ rotate(rotation).T + position
        if np.abs(vertices).max() > check.LARGEST:
            raise UserError(f'the mesh "{path}" has a vertex farther than {check.LARGEST:g} from the origin')
        vertices, triangles = surface.with_area(vertices, triangles)
        if not len(triangles):
            raise UserError(f'the mesh "{path}" has no triangle with an area')
        return vertices, triangles, closed


def rotate(degrees):
    """The matrix Rx * Ry * Rz for three angles in degrees. Quarter turns are exact."""
    matrix = np.eye(3)
    for axis, angle in enumerate(degrees):
        quarters = round(math.remainder(angle, 360) / 90)
        rest = math.radians(math.remainder(angle, 360) - 90 * quarters)
        c, s = math.cos(rest), math.sin(rest)
        c, s = ((c, s), (-s, c), (-c, -s), (s, -c))[quarters % 4]
        j, k = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[j, j], turn[j, k], turn[k, j], turn[k, k] = c, -s, s, c
        matrix = matrix @ turn
    return matrix


def _load(path, file):
    """Vertices (V, 3) and triangles (T, 3) of a file, all its parts in one frame."""
    if file.suffix.lower() not in SUFFIXES:
        suffixes = "supported: " + ", ".join(SUFFIXES)
        raise UserError(f'unknown kind of mesh file "{path}"', remedy=suffixes)
    if not _is_file(file):
        raise UserError(f'no such file: "{file}"', remedy="the path is taken from the folder of the scene file")
    remedy = "open it in a modelling program and save it again"
    if file.stat().st_size > LARGEST:
        raise UserError(f'the mesh "{path}" has more than {LARGEST >> 30} GB', remedy="use a coarser one, or divide it")
    try:
        content = file.read_bytes()
        with _at_most(MEMORY + 100 * len(content)):
            return _parsed(content, file)
    except OSError as error:
        raise UserError(f'the mesh "{path}" cannot be read: {error.strerror}') from None
    except MemoryError:
        raise UserError(f'the mesh "{path}" declares far more elements than it has', remedy=remedy) from None
    except Fault as fault:
        where = f"{fault.place}: " if fault.place else ""
        raise UserError(f'the mesh "{path}" cannot be read: {where}{fault.message}', remedy=fault.remedy) from None


def _parsed(content, file):
    """`_load` for a file with this content. Fault if it cannot be read right."""
    kind = file.suffix.lower()
    if content.startswith(b"version https://git-lfs.github.com/spec/"):
        remedy = "fetch it with: git lfs pull"
        raise Fault("it is a pointer of Git LFS, in place of the mesh itself", "line 1", remedy)
    if kind not in READERS:
        return _by_trimesh(content, file)
    if kind != ".ply" and b"\0" in content and b"BINARY" not in content[:20]:
        place, remedy = f"line {content[: content.index(bytes(1))].count(bytes([10])) + 1}", "save it as text in UTF-8"
        utf16 = content.startswith((b"\xff\xfe", b"\xfe\xff"))
        raise Fault("it is text in UTF-16" if utf16 else "it has NUL bytes, so it is no text", place, remedy)
    vertices, faces = READERS[kind](content)
    return vertices, triangles(vertices, faces)


def _by_trimesh(content, file):
    import trimesh  # here, because few scenes have a mesh

    kind, resolver = file.suffix.lower()[1:], trimesh.resolvers.FilePathResolver(file)
    try:
        loaded = trimesh.load_scene(
            io.BytesIO(content), file_type=kind, process=False, skip_materials=True, resolver=resolver
        )
        return _joined(loaded)
    except MemoryError:
        raise
    except Exception as error:  # trimesh raises errors of any kind for a damaged file
        why = " ".join(str(error).split()) or type(error).__name__
        raise Fault(why[:200], "", "open it in a modelling program and save it again") from None


def _joined(loaded):
    """Vertices (V, 3) and triangles (T, 3) of a trimesh.Scene, all its parts in one frame."""
    import trimesh

    vertices, corners, count = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0
    for node in loaded.graph.nodes_geometry:
        matrix, name = loaded.graph[node]
        part = loaded.geometry[name]
        if not isinstance(part, trimesh.Trimesh):
            continue  # points or lines
        # A product with the identity could still round.
        still = np.array_equal(matrix, np.eye(4))
        points = np.asarray(part.vertices, np.float64)
        vertices.append(points if still else points @ matrix[:3, :3].T + matrix[:3, 3])
        corners.append(np.asarray(part.faces, np.int64) + count)
        count += len(points)
    vertices, triangles = np.concatenate(vertices), np.concatenate(corners)
    if len(triangles) and not (triangles.min() >= 0 and triangles.max() < len(vertices)):
        raise Fault("it refers to vertices that it does not have", "", "export it again")
    return vertices, triangles


@contextmanager
def _at_most(more):
    """MemoryError, where the system supports it, if the block takes this many more bytes: a small file can declare any
    number of elements, for which a library would allocate memory."""
    try:
        import resource

        now = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
    except (ImportError, OSError):
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    own = now + more
    resource.setrlimit(resource.RLIMIT_AS, (own if soft == resource.RLIM_INFINITY else min(own, soft), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _is_file(file):
    try:
        return file.is_file()
    except ValueError:  # a NUL in the path
        return False


def _clean(vertices, triangles, path):
    """Vertices, triangles and whether they are closed, without duplicates, turned outward if closed."""
    if not len(triangles):
        raise UserError(f'the mesh "{path}" has no triangles')
    if not np.isfinite(vertices[triangles]).all():
        raise UserError(f'the mesh "{path}" has a vertex that is not finite')
    vertices, numbers = np.unique(vertices, axis=0, return_inverse=True)
    triangles = numbers.reshape(-1)[triangles]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    # Duplicates have the same vertices in the same cyclic order.
    turned = np.take_along_axis(triangles, (triangles.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    triangles = triangles[np.sort(np.unique(turned, axis=0, return_index=True)[1])]
    if not len(triangles):
        raise UserError(f'the mesh "{path}" has no triangle with an area')
    outward = surface.outward(vertices, triangles)
    return vertices, triangles if outward is None else outward, outward is not None
