"""The media along a ray (MED-1 to MED-4).

A set of solids is a whole number, a bit for each solid that has a rank: the highest bit is the highest rank.
"""


class Medium:
    """Optical properties: n (REF-1), mu_r and attenuation, which is None where it changes nothing (MED-1, ATT-1)."""

    def __init__(self, eps_r, mu_r, attenuation, number):
        self.n, self.mu_r = number.sqrt(eps_r * mu_r), mu_r
        self.clear = any(attenuation)
        self.attenuation = attenuation if self.clear and any(a != 1 for a in attenuation) else None

    def same(self, other):
        """Whether light cannot tell one from the other (MED-8)."""
        mine, others = ((medium.n, medium.mu_r, medium.attenuation) for medium in (self, other))
        return mine == others


class Media:
    """The solids of a scene that have a rank, lowest first, as rows (object, material, 1 if it holds the eye)."""

    def __init__(self, rows, air, materials):
        self.air = air
        self.of_rank = [air] + [materials[material] for _, material, _ in rows]
        self.bits = {identity: 1 << rank for rank, (identity, _, _) in enumerate(rows)}
        self.eye = sum(1 << rank for rank, (_, _, inside) in enumerate(rows) if inside)
        self.sides = self.nested if rows else self.alone

    def of(self, inside):
        """The medium of a set (MED-2)."""
        return self.of_rank[inside.bit_length()]

    def nested(self, inside, shape, entering):
        """The set the ray was in and the set beyond, the medium of each (MED-3, MED-4)."""
        bit = shape.bit
        if not bit:
            here = self.of(inside)
            if shape.flat or entering:
                return inside, inside, here, shape.material
            return inside, inside, shape.material, here
        without, within = inside & ~bit, inside | bit
        if entering:
            return without, within, self.of(without), self.of(within)
        return within, without, self.of(within), self.of(without)

    def alone(self, _inside, shape, entering):
        """The same in a scene where no solid has a rank."""
        if shape.flat or entering:
            return 0, 0, self.air, shape.material
        return 0, 0, shape.material, self.air
