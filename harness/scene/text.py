"""Reads the course's scene text (`.txt`), the format of DigiPen's CS500, with meshes as files and CSG in blocks.

Entities come in any order. Keywords are in capitals, `vec` is `(x,y,z)`, `#` begins a comment:

    CAMERA     vec:C vec:u vec:v (vec:e | distance)     with a distance, e = distance * normalise(u x v)
    LIGHT      vec:position vec:colour radius
    AIR        eps_r mu_r vec:attenuation               without it: 1 1 (1,1,1)
    AMBIENT    vec:colour                               without it: (0,0,0)
    BACKGROUND vec:colour                               without it: (0,0,0); not in the course's format
    POLYGON    n vec*n material                         convex and planar
    solid material
    block material

    solid    = SPHERE    vec:centre radius
             | BOX       vec:corner vec:edge vec:edge vec:edge
             | ELLIPSOID vec:centre vec:semi-axis vec:semi-axis vec:semi-axis
             | MESH      path vec:position vec:rotation scale
    block    = (OR part part* | AND part part* | NOT part) END
    part     = solid | block                            to any depth; a mesh among them must be closed
    material = vec:diffuse k_s exponent vec:attenuation eps_r mu_r [roughness]

One CAMERA is required. A number after mu_r is the roughness, from 0 to 1: without it, or 0, mirrors are perfect, else
they are glossy (GLO-2); sqrt(2 / (m + 2)) makes a lobe of the exponent m. In another dialect of the course a
BOX is a centre and three half-axes. A file does not say which it uses; here it is always a corner and three edges.

A path is a word, or "words between quotes", relative to the folder of the scene file. It may lead out of that folder: a
mesh is only read, and errors do not quote the content of a file. A mesh is scaled, then turned about z, y and x by the
angles of `rotation`, in degrees, then moved: T * Rx * Ry * Rz * S. An open mesh is flat (HIT-3) and bounds no medium. A
block is one solid of one material: AND a NOT b END END is a without b.
"""

import difflib
from pathlib import Path

from harness.errors import UserError
from harness.scene import check
from harness.scene.fields import ANY, FRACTION, NOT_NEGATIVE, POSITIVE, Fields
from harness.scene.mesh import mesh
from harness.scene.model import Air, Box, Camera, Csg, Ellipsoid, Light, Mesh, Operator, Polygon, Scene, Sphere


def read(text, file="scene.txt"):
    """The `Scene` that `text` describes. UserError, with `file` as its place, at the first fault.

    Meshes are read from the folder of `file`.
    """
    return _Reader(text, file).scene()


class _Reader(Fields):
    def __init__(self, text, file):
        super().__init__(text, file)
        self.meshes = mesh.Files(Path(file).parent)

    def scene(self):
        objects, lights, once, lines = [], [], {}, {}
        while self.token.text:
            keyword = self.take()
            name, line = keyword.text, keyword.line
            if name in _SOLIDS:
                shape, fields = _SOLIDS[name](self)
                objects.append(shape(self.material(), *fields, line=line))
            elif name in _BLOCKS:
                code = self.block(keyword)
                objects.append(Csg(self.material(), code, line=line))
            elif name == "POLYGON":
                objects.append(self.polygon(line))
            elif name == "LIGHT":
                lights.append(self.light(line))
            elif name in lines:
                second = f"a second {name}; the first is on line {lines[name]}"
                raise self.error(second, keyword, "keep one of them")
            elif name in _ONCE:
                lines[name] = line
                once[name.lower()] = _ONCE[name](self)
            elif name == "END":
                raise self.error("END without an OR, AND or NOT before it", keyword)
            else:
                raise self.unknown(keyword)
        if "camera" not in once:
            raise self.error(f"expected a CAMERA, found {self.token}", self.token)
        return Scene(**once, objects=tuple(objects), lights=tuple(lights), file=self.file)

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
        return Camera(centre, u, v, e, line=place.line)

    def light(self, line):
        place, colour = self.vector("the position"), self.colour()
        return Light(place, colour, self.number("the radius", NOT_NEGATIVE), line=line)

    def air(self):
        eps_r = self.number("eps_r", POSITIVE)
        mu_r = self.number("mu_r", POSITIVE)
        return Air(eps_r, mu_r, self.vector("the attenuation", FRACTION))

    def polygon(self, line):
        vertices, places = self.vectors(f"vertex {i + 1}" for i in range(self.count()))
        self.blame(check.polygon(vertices), places)
        return Polygon(self.material(), vertices, line=line)

    # Solids, after their keyword: the class, and its fields but for the material

    def sphere(self):
        return Sphere, (self.vector("the centre"), self.number("the radius", POSITIVE))

    def box(self):
        corner = self.vector("the corner")
        edges, places = self.vectors(("edge 1", "edge 2", "edge 3"))
        self.blame(check.box(edges), places)
        return Box, (corner, edges)

    def ellipsoid(self):
        centre = self.vector("the centre")
        axes, places = self.vectors(("semi-axis 1", "semi-axis 2", "semi-axis 3"))
        self.blame(check.ellipsoid(axes), places)
        return Ellipsoid, (centre, axes)

    def mesh(self):
        path, token = self.path("the path of a mesh")
        position, rotation = self.vector("the position"), self.vector("the rotation in degrees", ANY)
        scale = self.number("the scale", POSITIVE)
        try:
            placed = self.meshes.placed(path, position, rotation, scale)
        except UserError as fault:
            raise self.error(fault.message, token, fault.remedy) from None
        return Mesh, (*placed, path, position, rotation, scale)

    # CSG

    def block(self, keyword):
        """The postfix code of a block, to its last END. A loop instead of recursion, so that nesting has no limit."""
        code, waiting = [], []  # waiting: [keyword, number of parts] of each open block
        while True:
            word = keyword.text
            if word in _BLOCKS:
                self.one_part_in_not(waiting, keyword)
                waiting.append([keyword, 0])
            elif word == "END":
                opened, count = waiting.pop()
                if not count:
                    raise self.error(f"{opened.text} without a part (opened on line {opened.line})", keyword)
                if opened.text == "NOT":
                    code.append(Operator.NOT)
                if not waiting:
                    return tuple(code)
                self.add_part(code, waiting[-1])
            elif word in _SOLIDS:
                self.one_part_in_not(waiting, keyword)
                place = self.token
                shape, fields = _SOLIDS[word](self)
                part = shape(None, *fields, line=keyword.line)
                if shape is Mesh and not part.closed:
                    why = f'the open mesh "{part.path}" has no inside, so it cannot be a part of CSG'
                    raise self.error(why, place, "close its holes, or use it outside of CSG")
                code.append(part)
                self.add_part(code, waiting[-1])
            else:
                raise self.no_part(waiting[-1][0], keyword)
            keyword = self.take()

    @staticmethod
    def add_part(code, block):
        """Counts the part that was just appended to `code`, and combines it with the parts of `block` before it."""
        block[1] += 1
        if block[1] > 1:
            code.append(Operator[block[0].text])

    def one_part_in_not(self, waiting, keyword):
        if waiting and waiting[-1][0].text == "NOT" and waiting[-1][1]:
            raise self.error(f"a second part in NOT, {keyword}; it takes one", keyword, "put them in an OR or an AND")

    def no_part(self, opened, token):
        block = f"{opened.text} of line {opened.line}"
        if token.text == "POLYGON":
            return self.error("a POLYGON has no inside, so it cannot be a part of CSG", token, "use a BOX")
        if not token.text:
            return self.error(f"expected END for the {block}, found {token}", token)
        if token.text in _KEYWORDS:
            return self.error(f"{token.text} in the {block}", token, "is an END missing before it?")
        if token.text == "(" or token.text[:1] in tuple("+-.0123456789"):
            late = "parts of a block have no material; that of the block follows its last END"
            return self.error(f"expected a part or END in the {block}, found {token}", token, late)
        return self.unknown(token)

    def unknown(self, token):
        near = difflib.get_close_matches(token.text.upper(), _KEYWORDS, 1)
        if near:
            return self.error(f"unknown keyword {token}", token, f"did you mean {near[0]}?")
        return self.error(f"expected a keyword, found {token}", token, "keywords are " + ", ".join(_KEYWORDS))


_SOLIDS = {
    "SPHERE": _Reader.sphere,
    "BOX": _Reader.box,
    "ELLIPSOID": _Reader.ellipsoid,
    "MESH": _Reader.mesh,
}
_BLOCKS = ("OR", "AND", "NOT")
_ONCE = {
    "CAMERA": _Reader.camera,
    "AMBIENT": _Reader.colour,
    "BACKGROUND": _Reader.colour,
    "AIR": _Reader.air,
}
_KEYWORDS = (*_SOLIDS, "POLYGON", *_BLOCKS, "END", "LIGHT", *_ONCE)
