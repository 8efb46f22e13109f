"""Light at a point (LOC-1 to LOC-5, SOF-1), leaving it (OFF-1) and where to (REF, TRA, GLO)."""

from .random import GLOSSY
from .vector import dot, largest, normalise


def leave(point, normal, size, side, epsilon):
    """A point just off the surface, on the side of the normal if `side` is 1, on the other if -1 (OFF-1)."""
    shift = side * epsilon * max(largest(point), size)
    return point[0] + shift * normal[0], point[1] + shift * normal[1], point[2] + shift * normal[2]


def local(scene, lights, direction, point, normal, shape, shadows, counts):
    """Colour that the lights give at `point`, seen along `direction` (LOC-1 to LOC-5)."""
    material = shape.material
    kr, kg, kb = material.diffuse
    k_s, exponent = material.k_s, material.exponent
    px, py, pz = point
    nx, ny, nz = normal
    dx, dy, dz = direction
    sqrt = scene.number.sqrt
    ar, ag, ab = scene.ambient
    red, green, blue = kr * ar, kg * ag, kb * ab
    for (x, y, z), (light_red, light_green, light_blue) in lights:
        lx, ly, lz = x - px, y - py, z - pz
        distance = sqrt(lx * lx + ly * ly + lz * lz)
        if distance == 0:  # a light on the surface has no direction
            continue
        lx, ly, lz = lx / distance, ly / distance, lz / distance
        cosine = nx * lx + ny * ly + nz * lz
        if not cosine > 0:
            continue
        if shadows:
            counts.shadow += 1
            start = leave(point, normal, shape.size, 1, scene.epsilon)
            if scene.nearest(start, (lx, ly, lz), distance) is not None:
                continue
        # -(r · d) with r = 2 (n · l) n - l
        highlight = lx * dx + ly * dy + lz * dz - 2 * cosine * (nx * dx + ny * dy + nz * dz)
        phong = k_s * min(highlight, 1) ** exponent if highlight > 0 else 0
        red += (kr * cosine + phong) * light_red
        green += (kg * cosine + phong) * light_green
        blue += (kb * cosine + phong) * light_blue
    return red, green, blue


def spread(lights, feelers, numbers, number):
    """The lights as rays of one hit see them: in the place of each with a radius, as many points on it, each with
    its share of the colour (SOF-1, SOF-2). `numbers(use)` are the random numbers of the ray.
    """
    found = []
    for index, ((x, y, z), colour, radius) in enumerate(lights):
        if not radius > 0:
            found.append(((x, y, z), colour))
            continue
        share = tuple(channel / feelers for channel in colour)
        for feeler in range(feelers):
            u0, u1, _, _ = numbers(1 + index * feelers + feeler)
            up, phi = 1 - 2 * u0, 2 * number.pi * u1
            w = number.sqrt(max(0, 1 - up * up))
            point = x + radius * (w * number.cos(phi)), y + radius * (w * number.sin(phi)), z + radius * up
            found.append((point, share))
    return found


def fresnel(n, m, d_dot_n, sqrt):
    """Reflectance R for n = N and m = M of the two media (REF-1, REF-2)."""
    if n == 1 and m == 1:
        return 0
    c = min(abs(d_dot_n), 1)
    x = 1 - n * n * (1 - c * c)
    if x <= 0:
        return 1
    s = sqrt(x)
    perpendicular = (n * c - m * s) / (n * c + m * s)
    parallel = (m * c - n * s) / (m * c + n * s)
    return (perpendicular * perpendicular + parallel * parallel) / 2


def reflect(direction, normal, d_dot_n, sqrt):
    """The mirrored direction (REF-3)."""
    x = direction[0] - 2 * d_dot_n * normal[0]
    y = direction[1] - 2 * d_dot_n * normal[1]
    z = direction[2] - 2 * d_dot_n * normal[2]
    length = sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


def transmit(direction, normal, d_dot_n, n, m, sqrt):
    """The direction beyond a surface where R < 1, for n = N and m = M (TRA-1)."""
    if n == 1 and m == 1:
        return direction
    c = min(abs(d_dot_n), 1)
    s = sqrt(1 - n * n * (1 - c * c))
    across = (-s if d_dot_n <= 0 else s) - n * d_dot_n
    return normalise(
        (
            n * direction[0] + across * normal[0],
            n * direction[1] + across * normal[1],
            n * direction[2] + across * normal[2],
        ),
        sqrt,
    )


def gloss(mirrored, normal, exponent, rays, weigh, numbers, number):
    """Pairs (direction, w) of `rays` reflected rays around the mirrored direction (GLO-1 to GLO-3).

    `weigh(z, exponent)` is w; `numbers(use)` are the random numbers of the ray that is reflected.
    """
    rx, ry, rz = mirrored
    sigma = 1 if rz >= 0 else -1
    a = -1 / (sigma + rz)
    b = rx * ry * a
    px, py, pz = 1 + sigma * rx * rx * a, sigma * b, -sigma * rx
    qx, qy, qz = b, sigma + ry * ry * a, -ry
    side = dot(mirrored, normal)
    for ray in range(rays):
        u0, u1, _, _ = numbers(GLOSSY + ray)
        z, phi = (1 - u0) ** (1 / (exponent + 1)), 2 * number.pi * u1
        w = number.sqrt(max(0, 1 - z * z))
        x, y = w * number.cos(phi), w * number.sin(phi)
        direction = x * px + y * qx + z * rx, x * py + y * qy + z * ry, x * pz + y * qz + z * rz
        if not dot(direction, normal) * side > 0:
            x, y = -x, -y
            direction = x * px + y * qx + z * rx, x * py + y * qy + z * ry, x * pz + y * qz + z * rz
        yield normalise(direction, number.sqrt), weigh(z, exponent)


WEIGHTS = {"plain": lambda z, exponent: 1, "study": lambda z, exponent: z**exponent}  # GLO-1
