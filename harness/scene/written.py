"""Writes a scene as scene text (text.py), which reads as the same scene: numbers with all their digits."""

import os
from itertools import count
from pathlib import Path

from harness.scene.model import Box, Csg, Ellipsoid, Mesh, Object, Operator, Polygon, Scene, Sphere
from harness.system import output


def write(scene: Scene, path: Path) -> list[Path]:
    """Writes a scene to `path`; returns the files that it wrote.

    A mesh that is as its file has it stays there. Others, such as concave polygons of NFF and coarser meshes, are
    written beside `path` as OBJ, placed, under names that no file has.
    """
    meshes = _Meshes(path, Path(scene.file).parent if scene.file else None)
    output.text(path, _text(scene, meshes), own=False)
    return [path, *meshes.written]


class _Meshes:
    """How the text names the meshes of a scene. folder: of the files of those that have one."""

    def __init__(self, path: Path, folder: Path | None):
        self.path, self.folder, self.numbers = path, folder, count(1)
        self.written: list[Path] = []

    def words(self, mesh: Mesh) -> str:
        if mesh.path and self.folder is not None:
            name = os.path.relpath(self.folder / mesh.path, self.path.parent)
            if '"' not in name:
                place = f"{_vector(mesh.position)} {_vector(mesh.rotation)} {_number(mesh.scale)}"
                return f'MESH "{name}" {place}'
        names = (self.path.with_name(f"{self.path.stem}-{number}.obj") for number in self.numbers)
        file = next(name for name in names if not os.path.lexists(name))  # nobody named it, so it overwrites nothing
        lines = [f"v {' '.join(map(_number, vertex))}" for vertex in mesh.vertices.tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (mesh.triangles + 1).tolist()]
        output.text(file, "\n".join([*lines, ""]), own=False)
        self.written.append(file)
        return f'MESH "{file.name}" (0,0,0) (0,0,0) 1'


def _text(scene: Scene, meshes: _Meshes) -> str:
    camera, air = scene.camera, scene.air
    lines = [
        f"CAMERA {' '.join(map(_vector, (camera.centre, camera.u, camera.v, camera.e)))}",
        f"AIR {_number(air.eps_r)} {_number(air.mu_r)} {_vector(air.attenuation)}",
        f"AMBIENT {_vector(scene.ambient)}",
        f"BACKGROUND {_vector(scene.background)}",
    ]
    for light in scene.lights:
        lines.append(f"LIGHT {_vector(light.position)} {_vector(light.colour)} {_number(light.radius)}")
    for thing in scene.objects:
        m = thing.material
        numbers = " ".join(map(_number, (m.eps_r, m.mu_r, m.roughness)))
        material = f"{_vector(m.diffuse)} {_number(m.k_s)} {_number(m.exponent)} {_vector(m.attenuation)} {numbers}"
        lines += [*_shape(thing, meshes), f"  {material}"]
    return "\n".join([*lines, ""])


def _shape(thing: Object, meshes: _Meshes) -> list[str]:
    """The lines of an object before its material."""
    match thing:
        case Sphere():
            return [f"SPHERE {_vector(thing.centre)} {_number(thing.radius)}"]
        case Box():
            return [f"BOX {' '.join(map(_vector, (thing.corner, *thing.edges)))}"]
        case Ellipsoid():
            return [f"ELLIPSOID {' '.join(map(_vector, (thing.centre, *thing.axes)))}"]
        case Polygon():
            return [f"POLYGON {len(thing.vertices)} {' '.join(map(_vector, thing.vertices))}"]
        case Mesh():
            return [meshes.words(thing)]
        case Csg():
            word, inside = _block(thing, meshes)
            return _closed((word or "OR", inside))


def _block(solid: Csg, meshes: _Meshes) -> tuple[str, list[str]]:
    """The word of a CSG tree's root, "" of a part alone, and the lines of its operands."""

    def joined(word: str):
        def join(a, b):
            # a OR b OR c is one block of three.
            inside = a[1] if a[0] == word else _closed(a)
            inside += _closed(b)
            return word, inside

        return join

    return solid.fold(
        lambda part: ("", _shape(part, meshes)),
        joined(Operator.OR.value),
        joined(Operator.AND.value),
        lambda a: (Operator.NOT.value, _closed(a)),
    )


def _closed(block: tuple[str, list[str]]) -> list[str]:
    word, inside = block
    return [word, *inside, "END"] if word else inside


def _vector(numbers) -> str:
    return f"({','.join(map(_number, numbers))})"


def _number(value) -> str:
    return repr(float(value))
