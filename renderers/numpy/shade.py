"""Light at a point (LOC-1 to LOC-5, SOF-1), and the rays that leave it (OFF-1, REF-1 to REF-3, TRA-1, GLO-2)."""

import numpy as np

from .vector import dot, largest, normalise


def offsets(scene, points, normals, sizes):
    """From points to where rays leave the surface on the side of the normals (OFF-1)."""
    return shifts(scene, points, normals, sizes) * normals


def shifts(scene, points, normals, sizes):
    """ε (N,) of OFF-1."""
    if scene.offset == "bounded":
        return scene.epsilon * (sizes + dot(np.abs(normals), np.abs(points)) / 8)
    if scene.offset == "relative":
        return scene.epsilon * np.maximum(largest(points), sizes)
    return np.full_like(sizes, scene.epsilon if scene.offset == "fixed" else 0)


def local(scene, directions, points, starts, normals, d_dot_n, shapes, streams, outside):
    """Colours (3, N) of `points` seen along `directions`, and the number of feelers, from `starts` (LOC-1 to LOC-5).

    outside: the sets that feelers start in, None where none of MED-8 are told.
    """
    diffuse = scene.diffuse.take(shapes, axis=1)
    colours = diffuse * scene.ambient
    feelers = 0

    def add(total, position, light_colour):
        nonlocal feelers
        l = position - points  # noqa: E741, the SPEC's letter
        distances = np.sqrt(dot(l, l))
        l /= distances  # noqa: E741
        cosines = dot(normals, l)
        lit = cosines > 0
        if scene.shadows:
            rays = np.flatnonzero(lit)
            reach = distances[rays]
            if outside is not None:
                reach = scene.contact.reach(reach, np.broadcast_to(position, l.shape)[:, rays])
            feeler = starts.take(rays, axis=1), l.take(rays, axis=1), reach
            blocked = scene.blocked(*feeler)
            if outside is not None:
                asked = np.flatnonzero(blocked & (outside[rays] != 0))
                passed = scene.contact.lets_by(*(a.take(asked, axis=-1) for a in (*feeler, outside[rays])))
                blocked[asked[passed]] = False
            lit[rays] = ~blocked
            feelers += len(rays)
        light = diffuse * np.where(lit, cosines, 0)
        highlights = dot(l, directions) - 2 * cosines * d_dot_n  # -(r·d) with r = 2 (n·l) n - l
        bright = np.flatnonzero(lit & (highlights > 0))
        of = shapes[bright]
        light[:, bright] += scene.k_s[of] * np.minimum(highlights[bright], 1) ** scene.exponent[of]
        light *= light_colour
        total += light

    for number, (position, light_colour, radius) in enumerate(scene.lights):
        if scene.soft and radius > 0:
            total = np.zeros_like(colours)
            for feeler in range(scene.feelers):
                sphere = on_sphere(*streams.for_feeler(number, feeler))
                add(total, position + radius * sphere, light_colour)
            colours += total / scene.feelers  # SOF-1
        else:
            add(colours, position, light_colour)
    return colours, feelers


def on_sphere(u0, u1):
    """Points (3, N) on the unit sphere (SOF-2)."""
    z = 1 - 2 * u0
    return np.stack([*_turned(np.sqrt(np.maximum(0, 1 - z * z)), u1), z])


def fresnel(scene, i, t, d_dot_n):
    """N, s and the reflectance R (N,) between the media `i` and `t`, and where there is no surface (REF-2)."""
    n, m = scene.refractive_index[i] / scene.refractive_index[t], scene.mu[i] / scene.mu[t]
    c = np.minimum(np.abs(d_dot_n), 1)
    x = 1 - n * n * (1 - c * c)
    s = np.sqrt(x)
    perpendicular = (n * c - m * s) / (n * c + m * s)
    parallel = (m * c - n * s) / (m * c + n * s)
    r = np.where(x <= 0, 1, (perpendicular * perpendicular + parallel * parallel) / 2)
    matched = (n == 1) & (m == 1)
    r[matched] = 0
    return n, s, r, matched


def reflect(directions, normals, d_dot_n):
    """The mirrored directions (REF-3)."""
    return normalise(directions - 2 * d_dot_n * normals)


def transmit(directions, normals, d_dot_n, n, s):
    """The transmitted directions (TRA-1)."""
    g = np.where(d_dot_n <= 0, -s, s)
    return normalise(n * directions + (g - n * d_dot_n) * normals)


def gloss(mirrored, normals, exponents, streams, numbers):
    """Directions (3, N) around the mirrored ones, and z^m of the study, for the glossy rays `numbers` (GLO-2)."""
    u0, u1 = streams.for_lobes(numbers)
    z = (1 - u0) ** (1 / (exponents + 1))
    x, y = _turned(np.sqrt(-np.expm1(2 * np.log(1 - u0) / (exponents + 1))), u1)
    p, q = basis(mirrored)
    across, along = x * p + y * q, z * mirrored
    beyond = (dot(across + along, normals) > 0) != (dot(mirrored, normals) > 0)
    return normalise(np.where(beyond, -across, across) + along), z**exponents


def basis(r):
    """Two vectors at right angles to each other and to r (GLO-3)."""
    x, y, z = r
    sign = np.where(z >= 0, x.dtype.type(1), x.dtype.type(-1))
    a = -1 / (sign + z)
    b = x * y * a
    return np.stack([1 + sign * x * x * a, sign * b, -sign * x]), np.stack([b, sign + y * y * a, -y])


def _turned(w, u1):
    """x and y of unit vectors so far from the z axis (SOF-2, GLO-2)."""
    angle = 2 * np.pi * u1
    return w * np.cos(angle), w * np.sin(angle)
