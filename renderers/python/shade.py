"""Light at a point (LOC-1 to LOC-5, SOF-1), and the rays that leave it (OFF-1, REF, TRA, GLO)."""

import math

from .shapes.mesh import Triangle
from .vector import add, dot, largest, scale


def leaving(offset, epsilon):
    """The function of the method `offset` that leaves a surface: (point, normal, size, side) -> a point just off it,
    on the side of the normal if `side` is 1, on the other if -1 (OFF-1).
    """
    of_point = epsilon / 8

    def bounded(point, normal, size, side):
        x, y, z = point
        nx, ny, nz = normal
        shift = side * (epsilon * size + of_point * (abs(nx * x) + abs(ny * y) + abs(nz * z)))
        return x + shift * nx, y + shift * ny, z + shift * nz

    def relative(point, normal, size, side):
        return add(point, scale(normal, side * epsilon * max(largest(point), size)))

    def fixed(point, normal, _size, side):
        return add(point, scale(normal, side * epsilon))

    def none(point, _normal, _size, _side):
        return point

    return {"bounded": bounded, "relative": relative, "fixed": fixed, "none": none}[offset]


def shifting(offset, epsilon):
    """The function (point, normal, size) -> ε of a method `offset` (OFF-1)."""

    def bounded(point, normal, size):
        return epsilon * size + epsilon / 8 * sum(abs(n * x) for n, x in zip(normal, point, strict=True))

    return {
        "bounded": bounded,
        "relative": lambda point, _normal, size: epsilon * max(largest(point), size),
        "fixed": lambda *_: epsilon,
        "none": lambda *_: 0,
    }[offset]


def local(scene, lights, direction, point, normal, shape, shadows, counts):
    """Returns the colour of the light at `point`, seen along `direction` (LOC-1 to LOC-5)."""
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
            start = scene.leave(point, normal, shape.size, 1)
            if scene.contact is not None:
                distance = scene.contact.reach(distance, (x, y, z))
            if scene.nearest(start, (lx, ly, lz), distance) is not None and not (
                shape.sets and lets_by(scene, start, (lx, ly, lz), distance, shape.sets[dot(direction, normal) > 0])
            ):
                continue
        # -(r · d) with r = 2 (n · l) n - l
        highlight = lx * dx + ly * dy + lz * dz - 2 * cosine * (nx * dx + ny * dy + nz * dz)
        if scene.power is None:
            phong = k_s * min(highlight, 1) ** exponent if highlight > 0 else 0
        else:
            phong = k_s * scene.power(highlight, exponent)
        red += (kr * cosine + phong) * light_red
        green += (kg * cosine + phong) * light_green
        blue += (kb * cosine + phong) * light_blue
    return red, green, blue


def lets_by(scene, start, direction, distance, inside):
    """Whether what stops a feeler in the set `inside` is no surface (MED-8): a feeler in AIR meets none such."""
    return inside and scene.contact.lets_by(start, direction, distance, inside)


def facing(scene, lights, direction, point, normal, shape, shadows, counts):
    """As `local`, but a triangle of a closed mesh is a flat thing, lit on the side that the ray comes from (TRI-4)."""
    if isinstance(shape.thing if shape.sets else shape, Triangle) and dot(direction, normal) > 0:
        normal = scale(normal, -1)
    return local(scene, lights, direction, point, normal, shape, shadows, counts)


def power(base, exponent):
    """A power as IEEE 754 has it (LOC-4, unclamped)."""
    if base < 0 and exponent % 1:
        return math.nan
    try:
        return base**exponent
    except OverflowError:
        return math.inf


def spread(lights, feelers, draw, number):
    """The lights as rays of one hit see them: in the place of each with a radius, as many points on it, each with
    its share of the colour (SOF-1, SOF-2). `draw(light, feeler)` are U₀ and U₁.
    """
    found = []
    for index, ((x, y, z), colour, radius) in enumerate(lights):
        if not radius > 0:
            found.append(((x, y, z), colour))
            continue
        share = tuple(channel / feelers for channel in colour)
        for feeler in range(feelers):
            u0, u1 = draw(index, feeler)
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


def unclamped_fresnel(n, m, d_dot_n, sqrt):
    """As `fresnel`, without its clamp (REF-2, unclamped)."""
    if n == 1 and m == 1:
        return 0
    c, s = abs(d_dot_n), unclamped_beyond(n, d_dot_n, sqrt)
    if c == 0 and s == 0:  # 0/0
        return math.nan
    perpendicular, parallel = (n * c - m * s) / (n * c + m * s), (m * c - n * s) / (m * c + n * s)
    return (perpendicular * perpendicular + parallel * parallel) / 2


def beyond(n, d_dot_n, sqrt):
    """s, the cosine beyond a surface where R < 1 (REF-2)."""
    c = min(abs(d_dot_n), 1)
    return sqrt(1 - n * n * (1 - c * c))


def unclamped_beyond(n, d_dot_n, sqrt):
    """s, or NaN where there is none (REF-2, unclamped)."""
    x = 1 - n * n * (1 - d_dot_n * d_dot_n)
    return sqrt(x) if x >= 0 else math.nan


def reflect(direction, normal, d_dot_n, sqrt):
    """The mirrored direction (REF-3)."""
    x = direction[0] - 2 * d_dot_n * normal[0]
    y = direction[1] - 2 * d_dot_n * normal[1]
    z = direction[2] - 2 * d_dot_n * normal[2]
    length = sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


def unnormalised_reflect(direction, normal, d_dot_n, _sqrt):
    """The same, not normalised (NUM-4)."""
    return add(direction, scale(normal, -2 * d_dot_n))


def as_it_is(direction, _sqrt):
    """Returns the vector unchanged, in place of `normalise` (NUM-4)."""
    return direction


def transmit(direction, normal, d_dot_n, n, s, unit, sqrt):
    """The direction beyond a surface where R < 1, for n = N, and s of REF-2 (TRA-1)."""
    across = (-s if d_dot_n <= 0 else s) - n * d_dot_n
    return unit(
        (
            n * direction[0] + across * normal[0],
            n * direction[1] + across * normal[1],
            n * direction[2] + across * normal[2],
        ),
        sqrt,
    )


def gloss(mirrored, normal, exponent, rays, weigh, draw, unit, number):
    """Pairs (direction, w) of `rays` reflected rays around the mirrored direction (GLO-1 to GLO-3).

    `weigh(z, exponent)` is w; `draw(ray)` are U₀ and U₁; `unit` normalises.
    """
    rx, ry, rz = mirrored
    sigma = 1 if rz >= 0 else -1
    a = -1 / (sigma + rz)
    b = rx * ry * a
    px, py, pz = 1 + sigma * rx * rx * a, sigma * b, -sigma * rx
    qx, qy, qz = b, sigma + ry * ry * a, -ry
    side = dot(mirrored, normal)
    for ray in range(rays):
        u0, u1 = draw(ray)
        z, phi = (1 - u0) ** (1 / (exponent + 1)), 2 * number.pi * u1
        w = number.sqrt(-number.expm1(2 * number.log(1 - u0) / (exponent + 1)))
        x, y = w * number.cos(phi), w * number.sin(phi)
        direction = x * px + y * qx + z * rx, x * py + y * qy + z * ry, x * pz + y * qz + z * rz
        if not dot(direction, normal) * side > 0:
            x, y = -x, -y
            direction = x * px + y * qx + z * rx, x * py + y * qy + z * ry, x * pz + y * qz + z * rz
        yield unit(direction, number.sqrt), weigh(z, exponent)


WEIGHTS = {"plain": lambda z, exponent: 1, "study": lambda z, exponent: z**exponent}  # GLO-1
