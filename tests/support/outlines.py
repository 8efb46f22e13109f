"""Concave polygons made here: outlines (N, 2) of several kinds, their place in space, and what lies inside of them."""

import numpy as np
from stage import turned


def star(rng, count):
    angles = 2 * np.pi * (np.arange(count) + rng.uniform(0, 0.9, count)) / count
    return ring(angles, rng.uniform(0.3, 1, count))


def gear(rng, count):
    """Teeth with straight flanks, as of Haines' gears."""
    angles = 2 * np.pi * np.arange(count) / count + rng.uniform(0, 1)
    return ring(angles, np.where(np.arange(count) % 4 < 2, 1, 0.75))


def comb(rng, count):
    """Teeth on a straight back: the points between them lie on one line."""
    teeth = max(count // 4, 2)
    x = np.arange(4 * teeth) / (4 * teeth - 1)
    y = np.where(np.isin(np.arange(4 * teeth) % 4, (1, 2)), np.repeat(rng.uniform(0.4, 1, teeth), 4), 0.2)
    return np.vstack([np.stack([x, y], axis=1)[::-1], [(0, 0), (0.5, 0), (1, 0)]])


def spiral(rng, count):
    along = np.linspace(0, 1, count // 2)
    turns = min(count / 24, 4)
    angles, radii = 2 * np.pi * turns * along + rng.uniform(0, 1), 0.2 + 0.7 * along
    return np.vstack([ring(angles, radii + 0.05), ring(angles, radii - 0.05)[::-1]])


def monotone(rng, count):
    lower, upper = (np.sort(rng.uniform(0, 1, count // 2)) for _ in range(2))
    below = np.stack([lower, rng.uniform(0, 0.4, len(lower))], axis=1)
    below = np.vstack([(-0.1, 0.45), below, (1.1, 0.45)])
    above = np.stack([upper, rng.uniform(0.5, 1, len(upper))], axis=1)[::-1]
    return np.vstack([below, above])


KINDS = {"star": star, "gear": gear, "comb": comb, "spiral": spiral, "monotone": monotone}


def ring(angles, radii):
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)


def placed(rng, outline, scale, far):
    """In a random frame, `scale` large, `far` times as far from the origin. Also the frame: place and matrix (3, 3)."""
    if rng.random() < 0.5:
        outline = outline[::-1]
    frame = scale * turned(rng).T
    place = scale * far * rng.normal(size=3)
    return place + outline @ frame[:2], place, frame


def inside(outline, points):
    """Whether points (P, 2) are in the polygon: a line to the right crosses its sides an odd number of times."""
    found = np.zeros(len(points), bool)
    for (ax, ay), (bx, by) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        if ay != by:
            across = (ay > points[:, 1]) != (by > points[:, 1])
            found ^= across & (points[:, 0] < ax + (points[:, 1] - ay) / (by - ay) * (bx - ax))
    return found


def clear(outline, points, margin):
    """Whether points (P, 2) are farther than `margin` from all sides."""
    nearest = np.full(len(points), np.inf)
    for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        nearest = np.minimum(nearest, np.hypot(*(points - a - share[:, None] * (b - a)).T))
    return nearest > margin


def polygon(vertices, keyword="p"):
    """NFF text, with all digits."""
    normal = " 0 0 1" if keyword == "pp" else ""
    return f"{keyword} {len(vertices)}\n" + "".join(" ".join(map(repr, v)) + normal + "\n" for v in vertices.tolist())


def gears(count, teeth=36):
    """NFF text of thin glass gears on a mirror, each two concave faces and the rectangles between, with six digits."""
    side = int(np.ceil(np.sqrt(count)))
    text = "b 0.1 0.4 0.7\nv\nfrom -1.1 -2.1 2.6\nat 0 0 0\nup 0 0 1\nangle 45\nhither 1\nresolution 64 64\n"
    text += "l 2 4 4\nl -2 -2.5 2.5\nf 1 0.9 0.7 0.3 0.6 3 0 0\np 4\n2 2 0\n-2 2 0\n-2 -2 0\n2 -2 0\n"
    rim = gear(np.random.default_rng(count), 4 * teeth)
    for i in range(count):
        place = np.array([i % side, i // side]) * 2 / side - 1 + 1 / side
        low = np.column_stack([place + 0.95 * rim / side, np.full(len(rim), 0.2)])
        high = low + np.array([0, 0, 0.4 / side])
        text += f"f {(i % 3) / 2:g} 0.6 0.4 0.2 0.1 50 {0.8 * (i % 2):g} 1.1\n"
        quads = np.stack([low, np.roll(low, -1, 0), np.roll(high, -1, 0), high], axis=1)
        for shape in (high, low[::-1], *quads):
            text += f"p {len(shape)}\n" + "".join(f"{x:.6g} {y:.6g} {z:.6g}\n" for x, y, z in shape)
    return text
