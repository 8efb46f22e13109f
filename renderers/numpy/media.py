"""The medium of a ray, from its set of solids as bits of an int64 (MED-1 to MED-5)."""

import numpy as np


class Media:
    """The solids that have a rank, and the material of every shape.

    `materials` (shapes,) are rows of the table of materials, whose last row is AIR; `bits` (shapes,) are 0 for a shape
    without a rank.
    """

    def __init__(self, ranked, objects, materials, air):
        ranks = {thing: rank for rank, (thing, _, _) in enumerate(ranked)}
        self.materials, self.air = materials, air
        self.any = len(ranked) > 0
        self.eye = np.int64(sum(1 << rank for rank, (_, _, holds_eye) in enumerate(ranked) if holds_eye))
        self.bits = np.array([1 << ranks[thing] if thing in ranks else 0 for thing in objects], np.int64)
        self.of_highest = np.array([air, *(material for _, material, _ in ranked)])

    def sides(self, sets, shapes, inward):
        """Media of the rays (i) and beyond the surfaces that they hit (t), as materials, and the sets of both (MED-3).

        `sets` (N,) is None if no solid has a rank: then everything is in AIR alone.
        """
        own = self.materials[shapes]
        if sets is None:
            return np.where(inward, self.air, own), np.where(inward, own, self.air), None, None
        bits = self.bits[shapes]
        without, within = sets & ~bits, sets | bits
        outside = self.medium(without)
        inside = np.where(bits != 0, self.medium(within), own)
        return (
            np.where(inward, outside, inside),
            np.where(inward, inside, outside),
            np.where(inward, without, within),
            np.where(inward, within, without),
        )

    def medium(self, sets):
        """The material of the highest-ranking solid of each set (MED-2)."""
        for shift in (1, 2, 4, 8, 16, 32):  # fill in all bits below the highest, and count
            sets = sets | (sets >> shift)
        return self.of_highest[np.bitwise_count(sets)]
