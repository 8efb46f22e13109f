"""S13: two boxes with a common face, combined to one solid: rays must not hit that face."""

import numpy as np

from harness.scene.model import Box, Csg, Operator
from harness.stress import exact
from harness.stress.row import ROUNDOFF, Finding, Row, Trial, directions, in_general_position, rounded

RAYS = 20_000
FIRST, SECOND = np.array([[1.0, 0.8, 0.9], [0.7, 0.8, 0.9]])  # edges; the boxes meet at the end of the first's x
MIDDLE = 0.1, 0.9  # part of the common face that rays pass through
GRAZING = -3.0, 0.0  # log10 of the sine between a ray and the face, for half of the rays
ROOM = 32  # roundings: the least distance of a ray from what it must not meet
APART = 4.0  # distance between two pairs
AWAY = 3.0  # distance of origins outside


class Pair:
    """Two boxes in general position, their common face at x = 0 of a frame that is turned and moved."""

    def __init__(self, place, precision, rng):
        self.place, self.precision, self.turn = place, precision, in_general_position(rng)
        ex, ey, ez = self.turn
        first = self.box([-FIRST[0], 0, 0], FIRST[0] * ex, FIRST[1] * ey, FIRST[2] * ez)
        # From another corner and the other way round: the two boxes share no numbers.
        second = self.box([0, SECOND[1], 0], -SECOND[1] * ey, SECOND[2] * ez, SECOND[0] * ex)
        self.boxes = first, second

    def box(self, corner, *edges):
        edges = tuple(exact.triple(rounded(edge, self.precision)) for edge in edges)
        return Box(None, exact.triple(self.points(corner)), edges)

    def points(self, points):
        """Points (.., 3) of the pair's frame, in the scene."""
        return rounded(self.place + np.asarray(points) @ self.turn, self.precision)

    def rays(self, origins, d):
        return np.hstack([self.points(origins), rounded(d @ self.turn, self.precision)])


def pairs(level, precision, rng) -> list[Pair]:
    """Eight pairs, because rounding decides for each whether its faces overlap or leave a gap, for all rays alike."""
    middle = level * directions(rng, 1)[0]
    corners = APART * (np.indices((2, 2, 2)).reshape(3, 8).T - 0.5)
    return [Pair(middle + corner, precision, rng) for corner in corners]


def make_trial(pair_list, operator, origins, d, judge) -> Trial:
    """The trial of these pairs. origins, d: (R, 3) in the frame of a pair; ray i goes to pair i modulo their number."""
    rays = np.empty((len(origins), 6))
    for number, pair in enumerate(pair_list):
        stride = slice(number, None, len(pair_list))
        rays[stride] = pair.rays(origins[stride], d[stride])
    return Trial(exact.scene(*(Csg(exact.MATERIAL, (*pair.boxes, operator)) for pair in pair_list)), judge, rays)


def passing(rng):
    """Points of the common face, and directions through it to the second box, half of them grazing it: (R, 3) each."""
    points = rng.uniform(*MIDDLE, (RAYS, 3)) * [0, *FIRST[1:]]
    sine = np.where(rng.uniform(0, 1, RAYS) < 0.5, rng.uniform(0, 1, RAYS), 10 ** rng.uniform(*GRAZING, RAYS))
    angle, cosine = rng.uniform(0, 2 * np.pi, RAYS), np.sqrt(1 - sine**2)
    return points, np.stack([sine, cosine * np.cos(angle), cosine * np.sin(angle)], axis=1)


def union(level, precision, rng) -> Trial:
    """Rays from the first box into the second: they must hit the face where they leave the second."""
    points, d = passing(rng)
    # Origins lie halfway back to where the ray would have entered the first box, if that leaves room for rounding.
    back = np.min(np.where(d > 0, points - [-FIRST[0], 0, 0], points - [0, *FIRST[1:]]) / d, axis=1) / 2
    ahead = np.min(np.where(d > 0, SECOND - points, -points) / d, axis=1)
    clear = back * d[:, 0] > ROOM * ROUNDOFF[precision] * level
    points, d, back, ahead = points[clear], d[clear], back[clear], ahead[clear]

    def judge(result):
        t = result.array[:, 0]
        beyond = np.abs(t - back) > np.abs(t - back - ahead)  # the hit is nearer to the exit than to the face
        return Finding(len(t), int((~(beyond & exact.are_proper(result.array))).sum()))

    return make_trial(pairs(level, precision, rng), Operator.OR, points - back[:, None] * d, d, judge)


def intersection(level, precision, rng, away=AWAY) -> Trial:
    """Rays from outside through the common face. The boxes share nothing else, so there is no solid to hit."""
    points, d = passing(rng)
    # Left out: rays that rounding could move past the edge of the face, where they would meet other faces.
    clear = d[:, 0] * MIDDLE[0] * FIRST[1:].min() > ROOM * ROUNDOFF[precision] * max(level, away)
    points, d = points[clear], d[clear]

    def judge(result):
        return Finding(len(result.array), int((result.array[:, 7] >= 0).sum()))

    return make_trial(pairs(level, precision, rng), Operator.AND, points - away * d, d, judge)


SHARED = {"code": "S13", "method": "merge", "source": "Requicha 1980, regularised sets"}
MOVED = {
    "stress": "distance of the boxes from (0, 0, 0) / their size",
    "levels": (1e1, 3e1, 1e2, 3e2, 1e3, 3e3, 1e4),
    **SHARED,
}
ROWS = (
    Row(
        "coincident-or",
        title="Two boxes with a face in common, OR",
        failure="rays that hit the face inside of the solid",
        make=union,
        **MOVED,
    ),
    Row(
        "coincident-and",
        title="Two boxes with a face in common, AND",
        failure="rays that hit a solid that has no inside",
        make=intersection,
        **MOVED,
    ),
    Row(
        "coincident-from-afar",
        title="Two boxes with a face in common, AND, seen from afar",
        stress="distance of the rays' origins / size of the boxes",
        failure="rays that hit a solid that has no inside",
        levels=(3e0, 1e1, 3e1, 1e2, 3e2, 1e3, 3e3, 1e4),
        make=lambda level, precision, rng: intersection(1.0, precision, rng, level),
        **SHARED,
    ),
)
