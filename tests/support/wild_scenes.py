"""Random scenes of any size and place with all features, and the reduction of a scene that shows a fault."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from random_scenes import words
from tessellate import ball, block, obj

from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.model import Scene

MESHES = {
    "ball.obj": obj(*ball(1)),
    "block.obj": obj(*block()),
    "open.obj": obj(block()[0], block()[1][:-2]),
}
PLAIN = "(0.6,0.5,0.4) 0 1 (0,0,0) 1 1"
RAYS = 15000  # of a picture, at most, roughly: the Python renderer traces so many in a second
SIDES = (4, 22)  # pixels


@dataclass(frozen=True)
class Part:
    """An entity of a scene: a keyword, its fields or the parts of its CSG block, and its material if it has one."""

    word: str
    fields: str = ""
    parts: tuple["Part", ...] = ()
    material: str = ""

    def __str__(self) -> str:
        if self.parts:
            return f"{self.word} {' '.join(map(str, self.parts))} END {self.material}".rstrip()
        return f"{self.word} {self.fields} {self.material}".rstrip()

    def smaller(self) -> Iterator["Part"]:
        """Simpler entities: a part instead of the whole, a part less, a part simplified, a plain material."""
        for number, part in enumerate(self.parts):
            yield replace(part, material=self.material)
            before, after = self.parts[:number], self.parts[number + 1 :]
            if before or after:
                yield replace(self, parts=before + after)
            for less in part.smaller():
                yield replace(self, parts=(*before, less, *after))
        if self.material not in ("", PLAIN):
            yield replace(self, material=PLAIN)


@dataclass(frozen=True)
class Wild:
    """A scene and the job of its picture. away: distance of its middle from the origin, in sizes of the scene."""

    parts: tuple[Part, ...]
    job: dict = field(hash=False)
    away: float = 0.0

    @property
    def source(self) -> str:
        return "".join(f"{part}\n" for part in self.parts)

    @cached_property
    def scene(self) -> Scene:
        """The scene; UserError if the text is not one, which can happen to a reduced scene."""
        return text.read(self.source, _folder() / "scene.txt")

    @property
    def parameters(self) -> Parameters:
        return Parameters(**self.job)

    def keep(self, file: Path) -> Path:
        """Write the scene and its meshes; returns the file."""
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(self.source, "utf-8")
        for name, content in MESHES.items():
            if name in self.source:
                (file.parent / name).write_text(content, "utf-8")
        return file

    def smaller(self) -> Iterator["Wild"]:
        """Simpler scenes, then simpler jobs."""
        for number, part in enumerate(self.parts):
            before, after = self.parts[:number], self.parts[number + 1 :]
            if part.word != "CAMERA":
                yield replace(self, parts=before + after)
            for less in part.smaller():
                yield replace(self, parts=(*before, less, *after))
        for name, value in self.job.items():
            less = max(0, value - 1) if name == "depth" else getattr(Parameters, name)
            if value != less and name not in ("width", "height"):
                yield replace(self, job={**self.job, name: less})


_made: list = []


def _folder() -> Path:
    """A temporary folder with the meshes, which is removed at the end of the process."""
    if not _made:
        import tempfile

        _made.append(tempfile.TemporaryDirectory())
        for name, content in MESHES.items():
            (Path(_made[0].name) / name).write_text(content, "utf-8")
    return Path(_made[0].name)


def shrink(wild: Wild, shows: Callable[[Wild], bool], most: int = 400) -> Wild:
    """Simplify `wild` step by step as long as `shows` stays true. most: the largest number of calls of `shows`."""
    again = True
    while again:
        again = False
        for less in wild.smaller():
            most -= 1
            if most < 0:
                return wild
            if _is_scene(less) and shows(less):
                wild, again = less, True
                break
    return wild


def _is_scene(wild: Wild) -> bool:
    from harness.errors import UserError

    try:
        return bool(wild.scene)
    except UserError:
        return False


def draw(seed) -> Wild:
    """A random scene of a size from 1e-6 to 1e6, its shapes within 2 sizes of its middle.

    The middle is at the origin in half of the scenes, in the others up to 1e6 sizes away from it.
    """
    rng = np.random.default_rng(seed)
    return _Drawing(rng).scene()


class _Drawing:
    def __init__(self, rng: np.random.Generator):
        self.rng = rng
        self.size = float(10 ** rng.uniform(-6, 6)) if rng.random() < 0.7 else 1.0
        self.away = float(10 ** rng.uniform(3, 6)) if rng.random() < 0.5 else 0.0
        way = rng.normal(size=3)
        self.middle = self.away * self.size * way / np.linalg.norm(way)
        self.clear_share = rng.choice([0, 0.3, 0.7])

    def place(self, spread=1.6) -> str:
        return words(self.middle + self.size * self.rng.uniform(-spread, spread, 3))

    def vectors(self, matrix) -> str:
        return " ".join(words(self.size * row) for row in matrix)

    def sphere(self) -> Part:
        return Part("SPHERE", f"{self.place()} {float(self.size * self.rng.uniform(0.2, 1.1))!r}")

    def box(self) -> Part:
        edges = np.linalg.qr(self.rng.normal(size=(3, 3)))[0] * self.rng.uniform(0.3, 1.3, (3, 1))
        return Part("BOX", f"{self.place()} {self.vectors(edges + self.rng.normal(0, 0.1, (3, 3)))}")

    def ellipsoid(self) -> Part:
        axes = np.linalg.qr(self.rng.normal(size=(3, 3)))[0] * self.rng.uniform(0.2, 1.2, (3, 1))
        return Part("ELLIPSOID", f"{self.place()} {self.vectors(axes)}")

    def mesh(self, closed=False) -> Part:
        name = self.rng.choice(["ball.obj", "block.obj"] if closed else list(MESHES))
        turn = words(self.rng.uniform(-180, 180, 3))
        return Part("MESH", f"{name} {self.place(1.2)} {turn} {float(self.size * self.rng.uniform(0.4, 1.2))!r}")

    def polygon(self) -> Part:
        corners = self.rng.uniform(-2, 2, (3, 3))  # three are always of one plane
        return Part("POLYGON", "3 " + " ".join(words(self.middle + self.size * corner) for corner in corners))

    def solid(self, closed=False) -> Part:
        shape = self.rng.choice([self.sphere, self.box, self.ellipsoid, self.mesh], p=[0.3, 0.25, 0.25, 0.2])
        return shape(closed=True) if closed and shape == self.mesh else shape()

    def block(self, levels) -> Part:
        if levels == 0:
            return self.solid(closed=True)
        word = self.rng.choice(["OR", "AND", "NOT"], p=[0.35, 0.5, 0.15])
        count = 1 if word == "NOT" else self.rng.integers(2, 4)
        deeper = (self.block(levels - 1) if self.rng.random() < 0.5 else self.solid(closed=True) for _ in range(count))
        parts = tuple(deeper)
        if word == "AND":  # the last part is cut off
            parts = (*parts[:-1], Part("NOT", parts=parts[-1:]) if parts[-1].word != "NOT" else parts[-1])
        return Part(str(word), parts=parts)

    def material(self) -> str:
        rng = self.rng
        # √(2/(m + 2)) of an exponent m from 0 to 10,000
        rough = f" {float(rng.choice([1, rng.uniform(0.05, 0.7), 10 ** rng.uniform(-2, 0)]))!r}" * int(
            rng.random() < 0.5
        )
        exponent = float(rng.choice([0, 1, 7, rng.uniform(1, 60), 10 ** rng.uniform(0, 4)]))
        if rng.random() < self.clear_share:
            # The attenuation over the size of the scene does not depend on that size.
            clear = words(rng.uniform(0.3, 1, 3) ** (1 / self.size)) if rng.random() < 0.6 else "(1,1,1)"
            optics = (
                f"{clear} {float(rng.choice([0.7, 1.0, 1.77, rng.uniform(1.2, 6)]))!r} {float(rng.choice([1, 1.3]))!r}"
            )
            return f"{words(rng.uniform(0, 0.3, 3))} {float(rng.uniform(0.3, 1))!r} {exponent!r} {optics}{rough}"
        shine = float(rng.choice([0, rng.uniform(0.2, 0.9)]))
        return (
            f"{words(rng.uniform(0.1, 0.9, 3))} {shine!r} {exponent!r} (0,0,0) {float(rng.uniform(2, 400))!r} 1{rough}"
        )

    def nested(self) -> list[Part]:
        """Nested spheres, which may intersect each other."""
        middle = self.middle + self.size * self.rng.uniform(-0.5, 0.5, 3)
        found = []
        for radius in np.cumprod(self.rng.uniform(0.4, 0.8, 3)) * 1.6:
            middle = middle + self.size * 0.1 * radius * self.rng.normal(size=3)
            found.append(Part("SPHERE", f"{words(middle)} {float(radius * self.size)!r}"))
        return found

    def scene(self) -> Wild:
        rng, size = self.rng, self.size
        eye = rng.normal(size=3)
        eye *= rng.uniform(3, 7) / np.linalg.norm(eye)
        u = np.cross(eye, rng.normal(size=3))
        v = np.cross(eye, u)
        u, v = (axis * rng.uniform(1, 2.2) / np.linalg.norm(axis) for axis in (u, v))
        parts = [Part("CAMERA", f"{self.place(0.2)} {self.vectors([u, v, eye])}")]
        for _ in range(rng.integers(1, 4)):
            radius = float(size * rng.choice([0, rng.uniform(0.1, 1)]))
            colour = words(rng.uniform(0.2, 0.8, 3))
            parts.append(Part("LIGHT", f"{self.place(6)} {colour} {radius!r}"))
        parts += [Part("AMBIENT", words(rng.uniform(0, 0.3, 3))), Part("BACKGROUND", words(rng.uniform(0, 0.4, 3)))]
        if rng.random() < 0.5:
            air = words(rng.uniform(0.8, 1, 3) ** (1 / size))
            parts.append(Part("AIR", f"{float(rng.uniform(1, 1.5))!r} 1 {air}"))
        shapes = [self.sphere, self.box, self.polygon, self.ellipsoid, self.mesh]
        objects = [shape() for shape in rng.choice(shapes, rng.integers(2, 9))]
        objects += [self.block(int(rng.integers(1, 4))) for _ in range(rng.integers(0, 3))]
        objects += self.nested() if self.clear_share and rng.random() < 0.6 else []
        parts += [replace(part, material=self.material()) for part in rng.permutation(np.array(objects, object))]
        return Wild(tuple(parts), self.job(parts, float(np.linalg.norm(eye)) * size), self.away)

    def job(self, parts: list[Part], focus: float) -> dict:
        rng = self.rng
        lights = sum(part.word == "LIGHT" for part in parts)
        job = {"depth": int(rng.integers(0, 7)), "shadows": bool(rng.random() < 0.7), "seed": int(rng.integers(2**32))}
        job["sampler"] = str(rng.choice(["one", "uniform", "jittered", "adaptive"]))
        job |= {"samples": 2, "adaptive_depth": int(rng.integers(0, 3))}
        if rng.random() < 0.25:
            job |= {"lens_radius": float(self.size * rng.uniform(0.01, 0.3)), "focal_distance": focus}
        job["feelers"] = int(rng.choice([0, 0, 2]))
        job["glossy_rays"] = int(rng.choice([0, 0, 2]))
        several = max(1, job["glossy_rays"]) + bool(self.clear_share)
        job["depth"] = min(job["depth"], 3) if several > 2 else job["depth"]
        samples = {"one": 1, "adaptive": 2}.get(job["sampler"], 4)
        tree = sum((0.7 * several) ** order for order in range(job["depth"] + 1))  # some rays hit nothing
        rays = samples * tree * (1 + bool(job["shadows"]) * lights * max(1, job["feelers"]))
        side = int(np.clip(np.sqrt(RAYS / rays), *SIDES))
        return {"width": side + 1, "height": side, **job}
