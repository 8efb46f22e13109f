"""The base class of all shapes."""


class Shape:
    """A surface that rays can hit. Each kind of shape adds:

    size         of OFF-1
    surface      (origin, direction, t, face) -> point and normal of a hit (HIT-3, HIT-4)
    bounds       () -> smallest and largest corner of a box along the axes that holds it

    and its module `nearest`, the search for the first hit among `rows` of that kind.
    """

    flat = False  # bounds no medium (MED-4)
    bit = 0  # the solid's bit in a set of media (media.py), 0 if it has no rank
    sets = None  # of a Place (contact.py)
    condition = 1  # how much larger than that of its vectors the rounding of a hit can be

    def __init__(self, material, identity):
        self.material, self.identity = material, identity

    @property
    def row(self):
        """The row that the search reads."""
        return self
