"""Reads NFF (`.nff`), the format of Haines' Standard Procedural Databases (NFF.TXT, 1987, revised to 1993).

    v from x y z at x y z up x y z angle degrees hither h resolution x y      once
    b r g b                                 background
    l x y z [r g b]                         light; without a colour sqrt(n)/(2 n) in each channel, n lights in all
    f r g b Kd Ks Shine T ior               material of the following shapes
    s x y z radius                          sphere
    p n  x y z  ...                         polygon, convex or concave
    pp n  x y z nx ny nz  ...               polygon with normals, which are ignored
    # comment

How it is mapped to our light model:

- Colours are linear light; a `Scene` has sRGB, so they are encoded here and decoded again by flatten.py.
- Diffuse is Kd (r,g,b), the exponent is Shine.
- T = 0 is opaque: k_s = Ks, attenuation (0,0,0), eps_r = 1e6, which reflects all but 0.4 % (REF-2) as Ks alone would.
- T > 0 is clear: attenuation (1,1,1), eps_r = ior^2, k_s = max(Ks, T). In NFF, Ks and T weigh the two rays of a hit;
  here k_s weighs both, and Fresnel's R and T divide it. The larger of Ks and T keeps both rays.
- The eye is at `from`. The screen stands at distance 1 and reaches to tan(angle/2) both ways: pictures are square.
  `hither` and `resolution` are ignored: nothing is cut off, and the job has the size.
- There is no ambient light. A polygon is seen from both sides. A concave one becomes an open mesh (concave.py), flat as
  a polygon is: it bounds no medium (MED-4). One that crosses or touches itself is refused. A repeated vertex is
  ignored.
- Cones and cylinders (`c`) are not in the light model and are refused.
"""

import math

from harness.picture import colour
from harness.scene import check, concave
from harness.scene.fields import ANY, NOT_NEGATIVE, POSITIVE, Fields, Range
from harness.scene.model import Camera, Light, Material, Mesh, Polygon, Scene, Sphere

_ANGLE = Range(1e-6, 180 - 1e-6, "an angle between 0 and 180 degrees")
CLEAR, OPAQUE = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)


def read(text, file="scene.nff"):
    """The `Scene` that `text` describes. UserError, with `file` as its place, at the first fault."""
    return _Reader(text, file).scene()


class _Reader(Fields):
    def __init__(self, text, file):
        super().__init__(text, file)
        self.camera = self.material = self.background = None
        self.objects, self.lights = [], []

    def scene(self):
        while self.token.text:
            keyword = self.take()
            if keyword.text == "c":
                why = "cones and cylinders (c) are not in the light model, which has s, p and pp of NFF's shapes"
                remedy = "leave them out, or turn them into polygons, as the SPD's own programs do with -t"
                raise self.error(why, keyword, remedy)
            if keyword.text in _VIEW:
                raise self.error(
                    f"{keyword} outside of a viewpoint", keyword, f"a viewpoint is v {' '.join(_VIEW)}, in this order"
                )
            if keyword.text not in _ENTITIES:
                entities = "an NFF file has " + ", ".join(_ENTITIES) + ", c (not supported) and comments (#)"
                raise self.error(f"expected an entity, found {keyword}", keyword, entities)
            _ENTITIES[keyword.text](self, keyword)
        if self.camera is None:
            raise self.error(f"expected a viewpoint (v), found {self.token}", self.token)
        level = math.sqrt(len(self.lights)) / (2 * max(len(self.lights), 1))
        lights = (Light(place, _encoded(own or (level,) * 3), 0.0, line=line) for place, own, line in self.lights)
        background = self.background or OPAQUE
        return Scene(self.camera, tuple(self.objects), tuple(lights), background=background, file=self.file)

    # Entities, after their keyword

    def view(self, keyword):
        if self.camera is not None:
            raise self.error("a second viewpoint (v)", keyword, "keep one of them")
        eye, _ = self.view_field("from")
        at, place = self.view_field("at")
        ahead = check.subtract(at, eye)
        if check.length(ahead) < check.SMALLEST:
            raise self.error("from and at are the same point", place)
        up, place = self.view_field("up")
        across = check.cross(ahead, up)
        if check.length(across) <= check.FLAT * check.length(ahead) * check.length(up):
            raise self.error("up has no part across the view", place)
        self.word("angle")
        reach = math.tan(math.radians(self.number("the angle", _ANGLE)) / 2)
        self.word("hither")
        self.number("hither")
        self.word("resolution")
        self.number("the resolution", POSITIVE), self.number("the resolution", POSITIVE)
        ahead, u = check.unit(ahead), check.unit(across)
        v = check.cross(u, ahead)
        centre = tuple(a + b for a, b in zip(eye, ahead, strict=True))
        u, v = (tuple(reach * n for n in check.unit(side)) for side in (u, v))
        self.camera = Camera(centre, u, v, tuple(-n for n in ahead))

    def view_field(self, name):
        self.word(name)
        place = self.token
        return self.triple(name), place

    def backdrop(self, keyword):
        if self.background is not None:
            raise self.error("a second background (b)", keyword, "keep one of them")
        self.background = _encoded(self.triple("the background", NOT_NEGATIVE))

    def light(self, keyword):
        place = self.triple("the position")
        colour = self.triple("the colour", NOT_NEGATIVE) if self.numeric() else None
        self.lights.append((place, colour, keyword.line))

    def fill(self, _):
        rgb = self.triple("the colour", NOT_NEGATIVE)
        k_d, k_s = self.number("Kd", NOT_NEGATIVE), self.number("Ks", NOT_NEGATIVE)
        shine, t = self.number("Shine", NOT_NEGATIVE), self.number("T", NOT_NEGATIVE)
        place = self.token
        index = self.number("the index of refraction", NOT_NEGATIVE)
        diffuse = _encoded(k_d * channel for channel in rgb)
        if t == 0:
            self.material = Material(diffuse, k_s, shine, OPAQUE, 1e6, 1.0)
            return
        if not 1e-15 <= index <= 1e15:
            raise self.error(f"expected an index of refraction for a material with T > 0, found {place}", place)
        self.material = Material(diffuse, max(k_s, t), shine, CLEAR, index * index, 1.0)

    def sphere(self, keyword):
        centre, radius = self.triple("the centre"), self.number("the radius", POSITIVE)
        self.objects.append(Sphere(self.filled(keyword), centre, radius, line=keyword.line))

    def polygon(self, keyword):
        count = self.count()
        material, vertices, places = self.filled(keyword), [], []
        for i in range(count):
            places.append(self.token)
            vertices.append(self.triple(f"vertex {i + 1}"))
            if keyword.text == "pp":
                self.triple(f"the normal of vertex {i + 1}")
        vertices, places = _distinct(vertices, places)
        fault = check.polygon(vertices)
        if isinstance(fault, check.Concave):
            cut = concave.triangulate(vertices)
            if not isinstance(cut, check.Fault):
                self.objects.append(Mesh(material, *cut, closed=False, line=keyword.line))
                return
            fault = cut
        self.blame(fault, places)
        self.objects.append(Polygon(material, tuple(vertices), line=keyword.line))

    # Parts of entities

    def filled(self, keyword):
        if self.material is None:
            raise self.error(f"{keyword} before the first material (f)", keyword)
        return self.material

    def triple(self, name, within=ANY):
        return tuple(self.number(name, within) for _ in range(3))

    def word(self, word):
        token = self.take()
        if token.text != word:
            raise self.error(f'expected "{word}" in the viewpoint, found {token}', token)


def _distinct(vertices, places):
    """The vertices without repetitions, and their places; all of them if fewer than three would be left."""
    count = len(vertices)
    kept = [i for i, vertex in enumerate(vertices) if vertex != vertices[(i + 1) % count]]
    if len(kept) in range(3, count):
        return [vertices[i] for i in kept], [places[i] for i in kept]
    return vertices, places


def _encoded(linear):
    return tuple(map(float, colour.encode(tuple(linear))))


_VIEW = ("from", "at", "up", "angle", "hither", "resolution")
_ENTITIES = {
    "v": _Reader.view,
    "b": _Reader.backdrop,
    "l": _Reader.light,
    "f": _Reader.fill,
    "s": _Reader.sphere,
    "p": _Reader.polygon,
    "pp": _Reader.polygon,
}
