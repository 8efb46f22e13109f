"""Reader of the course's scene text (`.txt`), the format of DigiPen's CS500.

Entities come in any order. Keywords are in capitals, `vec` is `(x,y,z)`, `#` begins a comment:

    CAMERA     vec:C vec:u vec:v (vec:e | distance)     with a distance, e = distance * normalise(u x v)
    SPHERE     vec:centre radius material
    BOX        vec:corner vec:edge vec:edge vec:edge material
    POLYGON    n vec*n material                         convex and planar
    ELLIPSOID  vec:centre vec:semi-axis vec:semi-axis vec:semi-axis material
    LIGHT      vec:position vec:colour radius
    AIR        eps_r mu_r vec:attenuation               without it: 1 1 (1,1,1)
    AMBIENT    vec:colour                               without it: (0,0,0)
    BACKGROUND vec:colour                               without it: (0,0,0); not in the course's format

    material = vec:diffuse k_s exponent vec:attenuation eps_r mu_r [roughness]

One CAMERA is required. A number after mu_r is the roughness, else 0. In another dialect of the course a
BOX is a centre and three half-axes. A file cannot tell which it means: here it is always a corner and three edges.
"""

import difflib
import re
from typing import NamedTuple

from harness.errors import UserError
from harness.scene import check
from harness.scene.model import Air, Box, Camera, Ellipsoid, Light, Material, Polygon, Scene, Sphere
from harness.scene.tokens import tokens

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COUNT = re.compile(r"\d{1,9}", re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)


class _Range(NamedTuple):
    low: float
    high: float
    words: str


_ANY = _Range(-check.LARGEST, check.LARGEST, f"a number of at most {check.LARGEST:g} in size")
_POSITIVE = _Range(check.SMALLEST, check.LARGEST, f"a number from {check.SMALLEST:g} to {check.LARGEST:g}")
_NOT_NEGATIVE = _Range(0, check.LARGEST, f"a number from 0 to {check.LARGEST:g}")
_FRACTION = _Range(0, 1, "a number from 0 to 1")


def read(text, file="scene.txt"):
    """The `Scene` that `text` describes. UserError, with `file` as its place, at the first fault."""
    return _Reader(text, file).scene()


class _Reader:
    """Takes one token after the other; `self.token` is the next one."""

    def __init__(self, text, file):
        self.file = file
        self.tokens = tokens(text)
        self.token = next(self.tokens)

    def scene(self):
        if not self.token.text:
            raise self.error("the file is empty", self.token)
        objects, lights, once, lines = [], [], {}, {}
        while self.token.text:
            keyword = self.take()
            name, line = keyword.text, keyword.line
            if name in _OBJECTS:
                objects.append(_OBJECTS[name](self, line))
            elif name == "LIGHT":
                lights.append(self.light())
            elif name in lines:
                second = f"a second {name}; the first is on line {lines[name]}"
                raise self.error(second, keyword, "keep one of them")
            elif name in _ONCE:
                lines[name] = line
                once[name.lower()] = _ONCE[name](self)
            else:
                raise self.unknown(keyword)
        if "camera" not in once:
            raise self.error(f"expected a CAMERA, found {self.token}", self.token)
        return Scene(**once, objects=tuple(objects), lights=tuple(lights))

    # Entities, after their keyword

    def camera(self):
        centre = self.vector("the centre of the screen")
        (u, v), places = self.vectors(("u", "v"))
        self.blame(check.screen(u, v), places)
        place = self.token
        if place.text == "(":
            e = self.vector("e")
        else:
            distance = self.number("the distance of the eye (or a vector for e)")
            e = tuple(distance * n for n in check.unit(check.cross(u, v)))
        self.blame(check.eye(u, v, e), [place])
        return Camera(centre, u, v, e)

    def sphere(self, line):
        centre = self.vector("the centre")
        radius = self.number("the radius", _POSITIVE)
        return Sphere(self.material(), centre, radius, line=line)

    def box(self, line):
        corner = self.vector("the corner")
        edges, places = self.vectors(("edge 1", "edge 2", "edge 3"))
        self.blame(check.box(edges), places)
        return Box(self.material(), corner, edges, line=line)

    def polygon(self, line):
        count = self.take()
        if not _COUNT.fullmatch(count.text) or int(count.text) < 3:
            raise self.error(f"expected a whole number of vertices, 3 or more, found {count}", count)
        vertices, places = self.vectors(f"vertex {i + 1}" for i in range(int(count.text)))
        self.blame(check.polygon(vertices), places)
        return Polygon(self.material(), vertices, line=line)

    def ellipsoid(self, line):
        centre = self.vector("the centre")
        axes, places = self.vectors(("semi-axis 1", "semi-axis 2", "semi-axis 3"))
        self.blame(check.ellipsoid(axes), places)
        return Ellipsoid(self.material(), centre, axes, line=line)

    def light(self):
        return Light(self.vector("the position"), self.colour(), self.number("the radius", _NOT_NEGATIVE))

    def air(self):
        eps_r = self.number("eps_r", _POSITIVE)
        mu_r = self.number("mu_r", _POSITIVE)
        return Air(eps_r, mu_r, self.vector("the attenuation", _FRACTION))

    def colour(self):
        return self.vector("the colour", _NOT_NEGATIVE)

    # Parts of entities

    def material(self):
        diffuse = self.vector("the diffuse colour", _NOT_NEGATIVE)
        k_s = self.number("k_s", _NOT_NEGATIVE)
        exponent = self.number("the exponent", _NOT_NEGATIVE)
        attenuation = self.vector("the attenuation", _FRACTION)
        eps_r = self.number("eps_r", _POSITIVE)
        mu_r = self.number("mu_r", _POSITIVE)
        roughness = self.number("the roughness", _NOT_NEGATIVE) if _numeric(self.token.text) else 0.0
        return Material(diffuse, k_s, exponent, attenuation, eps_r, mu_r, roughness)

    def vectors(self, names):
        """The vectors of these names, and the token that each begins with."""
        vectors, places = [], []
        for name in names:
            places.append(self.token)
            vectors.append(self.vector(name))
        return tuple(vectors), places

    def vector(self, name, within=_ANY):
        if self.token.text != "(":
            raise self.error(f"expected a vector (x,y,z) for {name}, found {self.token}", self.token)
        numbers = []
        for _ in range(3):
            self.mark("," if numbers else "(", name)
            numbers.append(self.number(name, within))
        self.mark(")", name)
        return tuple(numbers)

    def mark(self, mark, name):
        token = self.take()
        if token.text != mark:
            raise self.error(f'expected "{mark}" in the vector for {name}, found {token}', token)

    def number(self, name, within=_ANY):
        token = self.take()
        if not _NUMBER.fullmatch(token.text):
            kind = "a finite number" if _NOT_FINITE.fullmatch(token.text) else "a number"
            raise self.error(f"expected {kind} for {name}, found {token}", token)
        value = float(token.text)
        if not within.low <= value <= within.high:
            raise self.error(f"expected {within.words} for {name}, found {token}", token)
        return value

    # Tokens and errors

    def take(self):
        token = self.token
        if token.text:
            self.token = next(self.tokens)
        return token

    def blame(self, fault, places):
        if fault:
            raise self.error(fault.text, places[fault.index])

    def unknown(self, token):
        near = difflib.get_close_matches(token.text.upper(), _KEYWORDS, 1)
        if near:
            return self.error(f"unknown keyword {token}", token, f"did you mean {near[0]}?")
        return self.error(f"expected a keyword, found {token}", token, "keywords are " + ", ".join(_KEYWORDS))

    def error(self, message, token, remedy=None):
        return UserError(message, file=self.file, line=token.line, column=token.column, remedy=remedy)


def _numeric(text):
    """Whether `text` is meant as a number, be it a good one or not."""
    return text[:1] in tuple("+-.0123456789") or _NOT_FINITE.fullmatch(text)


_OBJECTS = {
    "SPHERE": _Reader.sphere,
    "BOX": _Reader.box,
    "POLYGON": _Reader.polygon,
    "ELLIPSOID": _Reader.ellipsoid,
}
_ONCE = {
    "CAMERA": _Reader.camera,
    "AMBIENT": _Reader.colour,
    "BACKGROUND": _Reader.colour,
    "AIR": _Reader.air,
}
_KEYWORDS = (*_OBJECTS, "LIGHT", *_ONCE)
