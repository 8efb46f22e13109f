"""Reads meshes (OBJ, PLY, STL, OFF, glTF), cleans them and places them in the scene's frame.

Equal vertices become one, so that adjacent triangles share an edge; faces of more corners are cut in a fan of
triangles, which is right for convex ones; triangles without an area are removed. A closed mesh is then turned outward
(surface.py).
"""

import io
import math
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from harness.errors import UserError
from harness.scene import check, surface

SUFFIXES = (".obj", ".ply", ".stl", ".off", ".glb", ".gltf")
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
        vertices, triangles = with_area(vertices, triangles)
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
        known = "supported: " + ", ".join(SUFFIXES)
        raise UserError(f'unknown kind of mesh file "{path}"', remedy=known)
    if not _is_file(file):
        raise UserError(f'no such file: "{file}"', remedy="the path is taken from the folder of the scene file")
    remedy = "open it in a modelling program and save it again"
    try:
        content = file.read_bytes()
        with _at_most(MEMORY + 100 * len(content)):
            vertices, triangles = _parsed(content, file)
    except MemoryError:
        raise UserError(f'the mesh "{path}" declares far more elements than it has', remedy=remedy) from None
    except Exception as error:  # trimesh raises errors of any kind for a damaged file
        why = " ".join(str(error).split()) or type(error).__name__
        raise UserError(f'the mesh "{path}" cannot be read: {why[:200]}', remedy=remedy) from None
    if len(triangles) and not (triangles.min() >= 0 and triangles.max() < len(vertices)):
        raise UserError(f'the mesh "{path}" refers to vertices that it does not have')
    return vertices, triangles


def _parsed(content, file):
    """`_load` for a file with this content; raises any error of trimesh."""
    import trimesh  # here, because few scenes have a mesh

    kind, resolver = file.suffix.lower()[1:], trimesh.resolvers.FilePathResolver(file)
    # Names and comments of OBJ may have any encoding, but are not used.
    source = io.StringIO(content.decode("utf-8", "replace")) if kind == "obj" else io.BytesIO(content)
    loaded = trimesh.load_scene(source, file_type=kind, process=False, skip_materials=True, resolver=resolver)
    vertices, triangles, count = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0
    for node in loaded.graph.nodes_geometry:
        matrix, name = loaded.graph[node]
        part = loaded.geometry[name]
        if not isinstance(part, trimesh.Trimesh):
            continue  # points or lines
        # A product with the identity could still round.
        still = np.array_equal(matrix, np.eye(4))
        points = np.asarray(part.vertices, np.float64)
        vertices.append(points if still else points @ matrix[:3, :3].T + matrix[:3, 3])
        triangles.append(np.asarray(part.faces, np.int64) + count)
        count += len(points)
    return np.concatenate(vertices), np.concatenate(triangles)


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


def with_area(vertices, triangles):
    """Vertices and triangles without triangles that have no normal (TRI-2), and without unused vertices.

    Call it after `surface.outward`, for which triangles without an area may close a seam.
    """
    a, b, c = (vertices[corner] for corner in triangles.T)
    normals = np.cross(b - a, c - a)
    triangles = triangles[np.einsum("ij,ij->i", normals, normals) > 0]
    used = np.zeros(len(vertices), bool)
    used[triangles] = True
    return vertices[used], (np.cumsum(used, dtype=np.int32) - 1)[triangles]
