"""A material as POV-Ray's texture and interior. NOTES.md says why each term is what it is."""

import math

import numpy as np

from .shapes import number, vector

OPAQUE = (0.0, 0.0, 0.0)
CLEAR = (1.0, 1.0, 1.0)
NEXT = 2.0**-23  # POV-Ray keeps an index in float32
NOTHING = 1e30  # absorption of an opaque material; POV-Ray keeps it in float32


class Material:
    """One row of `materials.npy`; `glass` tells whether rays go through it (MED-1, REF-4) at this depth."""

    def __init__(self, name, row, depth):
        self.name = name
        self.diffuse, self.attenuation = row[0:3], tuple(row[5:8])
        self.k_s, self.exponent, self.permittivity, self.permeability = map(float, (row[3], row[4], row[8], row[9]))
        self.index = math.sqrt(self.permittivity * self.permeability)  # REF-1
        self.mirrors = depth > 0 and self.k_s > 0
        self.glass = self.mirrors and self.attenuation != OPAQUE

    def texture(self):
        return f"#declare {self.name} = texture {{ {self._glass() if self.glass else self._opaque()} }}"

    def _opaque(self):
        """LOC-1 to LOC-4, and k_s R of the reflected ray (REF-4)."""
        mirror = f" reflection {{ 0, {number(self.k_s)} fresnel on }}" if self.mirrors else ""
        finish = f"ambient 1 diffuse 1{self._phong(self.k_s)}{mirror}"
        return f"pigment {{ rgb {vector(self.diffuse)} }} finish {{ {finish} }}"

    def _glass(self):
        """k_s times a glass that gives R and, by conserve_energy, 1 - R; and the ambient and diffuse light."""
        finish = f"ambient 0 diffuse 0{self._phong(1)} reflection {{ 0, 1 fresnel on }} conserve_energy"
        glass = f"pigment {{ rgbt <0, 0, 0, 1> }} finish {{ {finish} }}"
        if self.k_s == 1 and not self.diffuse.any():
            return glass
        matt = f"pigment {{ rgb {vector(self.diffuse)} }} finish {{ ambient 1 diffuse 1 }}"
        black = "pigment { rgb 0 } finish { ambient 0 diffuse 0 }"
        # An average divides by the sum of its weights: the black one makes it 1.
        parts = [(self.k_s, glass), (1, matt), (-self.k_s, black)]
        entries = "\n  ".join(f"[{number(weight)} {part}]" for weight, part in parts)
        return f"average texture_map {{\n  {entries} }}"

    def _phong(self, k_s):
        return f" phong {number(k_s)} phong_size {number(self.exponent)}" if self.k_s > 0 else ""

    def interior(self, air, scale):
        """The index relative to AIR's, which is 1 to POV-Ray, and the absorption on the way (ATT-1)."""
        index = self.index / air.index
        if self.glass and abs(index - 1) < NEXT:
            index = 1 + NEXT  # POV-Ray does not count the order of a ray that no index bends (REF-5)
        if not self.glass or self.attenuation == CLEAR:
            return f" interior {{ ior {number(index)} }}"
        # POV-Ray uses the medium of a shape, and AIR's, only if it is hollow.
        more = absorption(absorbed(self.attenuation) - absorbed(air.attenuation), scale)
        return f" interior {{ ior {number(index)} {more} }} hollow"


class Air:
    def __init__(self, row):
        self.permittivity, self.permeability = float(row[0]), float(row[1])
        self.index = math.sqrt(self.permittivity * self.permeability)
        self.attenuation = tuple(row[2:5])
        self.absorbs = bool(absorbed(self.attenuation).any())

    def text(self, scale):
        return absorption(absorbed(self.attenuation), scale) if self.absorbs else ""


def absorbed(attenuation):
    """POV-Ray's `absorption`: a^t = exp(-absorption t). AIR that is (0, 0, 0) attenuates nothing (ATT-1)."""
    if attenuation == OPAQUE:
        return np.zeros(3)
    return np.array([-math.log(a) if a > 0 else NOTHING for a in attenuation])


def absorption(coefficients, scale):
    return f"media {{ absorption rgb {vector(coefficients / scale)} }}"
