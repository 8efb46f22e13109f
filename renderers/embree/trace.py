"""Computes pictures and first hits: a chunk of rays at a time, one order after the other (WLK-1, chain)."""

import numpy as np

from .scene import dot, normalise

CHUNK = 1 << 14  # rays at once: their arrays stay in the processor's cache


def eye_rays(scene, job, pixels):
    """Origins and directions through `pixels`, numbers in the region's C order (CAM-2, CAM-3)."""
    x0, y0, x1, _ = job.region
    j, i = np.divmod(pixels, x1 - x0)
    x = 2 * (x0 + i.astype(np.float32) + np.float32(job.sample[0])) / np.float32(job.width) - 1
    y = 1 - 2 * (y0 + j.astype(np.float32) + np.float32(job.sample[1])) / np.float32(job.height)
    centre, u, v, e = scene.camera[:, :, np.newaxis]
    directions = normalise(x * u + y * v - e)
    return np.broadcast_to(centre + e, directions.shape), directions


def reflectance(optics, cosines):
    """R of REF-2; optics: N and M."""
    n, m = optics
    c = np.minimum(np.abs(cosines), 1)
    x = 1 - n * n * (1 - c * c)
    s = np.sqrt(np.maximum(x, 0))
    r1, r2 = (n * c - m * s) / (n * c + m * s), (m * c - n * s) / (m * c + n * s)
    r = np.where(x <= 0, np.float32(1), (r1 * r1 + r2 * r2) / 2)
    return np.where((n == 1) & (m == 1), np.float32(0), r)


def local(scene, job, triangles, points, starts, normals, directions, d_dot_n):
    """Colours (3, N) of points (LOC-1 to LOC-4), and the number of feelers, which start at `starts`."""
    diffuse = scene.diffuse.take(triangles, axis=1)
    colours, feelers = diffuse * scene.ambient[:, np.newaxis], 0
    for light in scene.lights[:, :6, np.newaxis]:
        l = light[:3] - points  # noqa: E741, the SPEC's letter
        distances = np.sqrt(dot(l, l))
        l /= distances  # noqa: E741
        cosines = dot(normals, l)
        lit = cosines > 0
        if job.shadows:
            asked = np.flatnonzero(lit)
            lit[asked] = ~scene.blocked(starts[:, asked], l[:, asked], distances[asked])
            feelers += len(asked)
        received = diffuse * np.where(lit, cosines, 0)
        c = dot(l, directions) - 2 * cosines * d_dot_n  # -(r·d) with r = 2 (n·l) n - l
        bright = np.flatnonzero(lit & (c > 0))
        of = triangles[bright]
        received[:, bright] += scene.k_s[of] * np.minimum(c[bright], 1) ** scene.exponent[of]
        colours += received * light[3:]
    return colours, feelers


def trace(scene, job, picture):
    """Fills `picture` (3, pixels); returns the numbers of reflected rays and of feelers."""
    reflected = feelers = 0
    for begin in range(0, picture.shape[1], CHUNK):
        targets = np.arange(begin, min(begin + CHUNK, picture.shape[1]))
        picture[:, targets] = 0
        origins, directions = eye_rays(scene, job, targets)
        weights = np.ones(len(targets), np.float32)
        for order in range(job.depth + 1):
            t, triangles = scene.nearest(origins, directions)
            missed, hit = np.flatnonzero(triangles < 0), np.flatnonzero(triangles >= 0)
            picture[:, targets[missed]] += weights[missed] * scene.background[:, np.newaxis]  # REF-6
            t, triangles, targets, weights = t[hit], triangles[hit], targets[hit], weights[hit]
            origins, directions = origins[:, hit], directions[:, hit]
            points, normals = scene.surface(triangles, origins, directions, t)
            away = dot(np.abs(normals), np.abs(points)) / 8
            off = scene.epsilon * (scene.sizes[triangles] + away) * normals  # OFF-1
            d_dot_n = dot(directions, normals)
            colours, asked = local(scene, job, triangles, points, points + off, normals, directions, d_dot_n)
            picture[:, targets] += weights * colours
            feelers += asked
            if order == job.depth:  # REF-5
                break
            entering = (d_dot_n <= 0) | ~scene.closed[triangles]
            optics = np.where(entering, scene.entering[:, triangles], scene.leaving[:, triangles])
            weights = weights * scene.k_s[triangles] * reflectance(optics, d_dot_n)
            goes_on = np.flatnonzero(weights)  # REF-4
            if not len(goes_on):
                break
            reflected += len(goes_on)
            origins = (points + np.where(d_dot_n <= 0, off, -off))[:, goes_on]
            directions = normalise((directions - 2 * d_dot_n * normals)[:, goes_on])  # REF-3
            targets, weights = targets[goes_on], weights[goes_on]
    return reflected, feelers


def first_hits(scene, rays):
    """Rows (t, point, normal, object) for rays (6, R)."""
    origins, given = rays[:3], rays[3:]
    directions = np.where(np.abs(dot(given, given) - 1) <= 4 * 2.0**-24, given, normalise(given))  # NUM-4
    answer = np.zeros((rays.shape[1], 8))
    answer[:, 0], answer[:, 7] = np.inf, -1
    t, triangles = scene.nearest(origins, directions)
    hit = np.flatnonzero(triangles >= 0)
    t, triangles = t[hit], triangles[hit]
    points, normals = scene.surface(triangles, origins[:, hit], directions[:, hit], t)
    answer[hit] = np.vstack([t, points, normals, scene.objects[triangles]]).T
    return answer
