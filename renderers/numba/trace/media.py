"""Which medium is on either side of a surface.

A set of clear solids is an integer: bit r for the solid of rank r (MED-2).
"""

import numpy as np

from ..needs import MEDIA
from ..scene import RANK
from ..target import kernel


@kernel
def medium(scene, members):
    """Row of materials of the highest-ranking solid of a set; of AIR if it is empty (MED-2)."""
    if members == 0:
        return len(scene.materials) - 1
    rank = 0
    for half in (32, 16, 8, 4, 2, 1):
        if members >> (rank + half) != 0:
            rank += half
    return np.int64(scene.media[rank])


@kernel
def sides(scene, index, material, inside, members):
    """Rows of materials of the media i and t, and the sets the ray was in and is in beyond (MED-3, MED-4)."""
    around = len(scene.materials) - 1
    if MEDIA:
        rank = np.int64(scene.ids[index, RANK])
        if rank >= 0:
            solid = np.int64(1) << rank
            out, within = members & ~solid, members | solid
            if inside:
                return medium(scene, within), medium(scene, out), within, out
            return medium(scene, out), medium(scene, within), out, within
        around = medium(scene, members)
    own = np.int64(material)
    if inside:
        return own, around, members, members
    return around, own, members, members
