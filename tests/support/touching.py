"""Scenes of clear solids that touch: bodies in one piece and cut in two, things that stand on others."""

import numpy as np
from random_scenes import words
from stage import turned
from tessellate import obj

GLASS = "(0.02,0.05,0.03) 0.9 60 (0.75,0.95,0.85) 2.25 1"
WATER = "(0.01,0.02,0.05) 0.8 40 (0.9,0.95,0.99) 1.77 1"
MATTE = "(0.6,0.5,0.4) 0.1 20 (0,0,0) 4 1"
RED = "(0.8,0.2,0.1) 0.2 60 (0,0,0) 4 1"
BITE = np.array([0.7, 0.6, 0.5])
FAR = 4.0  # half the size of what cuts a body in two


def room(rng, floor=-2.2):
    """Camera, lights and objects around the origin, as lines."""
    x, z = rng.uniform(-0.3, 0.3, 2)
    return [
        f"CAMERA ({x},{0.2 + z},6) (0.55,0,0.1) (0,0.55,0) (0.25,0,3)",
        "AMBIENT (0.3,0.3,0.3)",
        "BACKGROUND (0.2,0.3,0.5)",
        f"LIGHT {words(rng.normal((5, 8, 6)))} (1,1,1) 0",
        f"LIGHT {words(rng.normal((-3, 3, 5)))} (0.4,0.3,0.6) 0",
        f"POLYGON 4 (-6,{floor},5) (6,{floor},5) (6,{floor},-6) (-6,{floor},-6) {MATTE}",
        f"SPHERE {words([0.3, 0.1, -3.3] + 0.2 * rng.normal(size=3))} 0.8 {RED}",
    ]


def parallelepiped(corner, edges):
    return f"BOX {words(corner)} {' '.join(map(words, edges))}"


def halves(rng):
    """Two boxes, far larger than a body at the origin, with one face in common, in general position."""
    a, b, c = turned(rng)
    start = a * rng.uniform(-0.4, 0.4) - FAR * b - FAR * c
    return [parallelepiped(start, (side * 2 * FAR * a, 2 * FAR * b, 2 * FAR * c)) for side in (-1, 1)]


def body(rng, kind):
    """The text of a body without material around the origin."""
    centre, axes = 0.1 * rng.normal(size=3), turned(rng) * rng.uniform(0.7, 1.1, 3)
    if kind == "sphere":
        return f"SPHERE {words(centre)} {rng.uniform(0.8, 1.1)}"
    if kind == "ellipsoid":
        return f"ELLIPSOID {words(centre)} {' '.join(map(words, axes.T))}"
    if kind == "solid":
        return f"AND {body(rng, 'ellipsoid')} NOT SPHERE {words(centre + BITE)} 0.6 END END"
    return parallelepiped(centre - axes.sum(axis=1), 2 * axes.T)


def cut(rng, kind, folder):
    """Lines of a room, of a clear body in it, and of the two parts of the body that a plane makes."""
    lines = room(rng)
    if kind in ("boxes", "meshes"):  # a box by a plane along two of its edges, or along none
        return lines, *cut_box(rng, kind, folder)
    whole, (below, above) = body(rng, kind), halves(rng)
    upper = f"AND {whole} {above} END" if rng.random() < 0.5 else f"AND {whole} NOT {below} END END"
    return lines, [f"{whole} {GLASS}"], [f"AND {whole} {below} END {GLASS}", f"{upper} {GLASS}"]


def cut_box(rng, kind, folder):
    axes, share = turned(rng) * rng.uniform(0.7, 1.0, 3), rng.uniform(0.2, 0.8)
    corner, (a, b, c) = -axes.sum(axis=1) + 0.1 * rng.normal(size=3), 2 * axes.T
    whole = f"{parallelepiped(corner, (a, b, c))} {GLASS}"
    if kind == "boxes":
        parts = [(corner, share * a), (corner + share * a, (1 - share) * a)]
        return [whole], [f"{parallelepiped(at, (edge, b, c))} {GLASS}" for at, edge in parts]
    shares = rng.uniform(0.2, 0.8, 3)  # where the plane meets three edges along a; the fourth follows
    cuts = np.array([*shares, shares[1] + shares[2] - shares[0]])
    if not 0 < cuts[3] < 1:
        return cut_box(rng, kind, folder)
    ends = np.array([0 * b, b, c, b + c])
    low, high = corner + ends, corner + ends + a
    middle = corner + ends + cuts[:, None] * a
    lines = []
    for name, first, second in (("low", low, middle), ("high", middle, high)):
        vertices = np.concatenate([first, second])
        faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        triangles = [t for p, q, r, s in faces for t in ((p, q, r), (p, r, s))]
        (folder / f"{name}.obj").write_text(obj(vertices, triangles))
        lines.append(f'MESH "{folder / name}.obj" (0,0,0) (0,0,0) 1 {GLASS}')
    return [whole], lines


def shuffled(rng, lines):
    """The text of a scene with its objects in another order; lights stay, as their order is that of sums."""
    head = [line for line in lines if line.split()[0] in ("CAMERA", "AMBIENT", "BACKGROUND", "LIGHT")]
    things = [line for line in lines if line not in head]
    return "\n".join([*head, *(things[k] for k in rng.permutation(len(things)))]) + "\n"
