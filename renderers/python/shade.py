"""Light at a point (LOC-1 to LOC-5), leaving it (OFF-1) and what it reflects (REF-1 to REF-3)."""

from .vector import largest


def leave(point, normal, size, side, epsilon):
    """A point just off the surface, on the side of the normal if `side` is 1, on the other if -1 (OFF-1)."""
    shift = side * epsilon * max(largest(point), size)
    return point[0] + shift * normal[0], point[1] + shift * normal[1], point[2] + shift * normal[2]


def local(scene, direction, point, normal, shape, shadows, counts):
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
    for (x, y, z), (light_red, light_green, light_blue) in scene.lights:
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


def fresnel(scene, material, d_dot_n):
    """Reflectance R at the surface between AIR and `material` (REF-1, REF-2)."""
    sqrt = scene.number.sqrt
    eps_air, mu_air = scene.air[0], scene.air[1]
    n_air, n_material = sqrt(eps_air * mu_air), sqrt(material.eps_r * material.mu_r)
    if d_dot_n <= 0:
        n, m = n_air / n_material, mu_air / material.mu_r
    else:
        n, m = n_material / n_air, material.mu_r / mu_air
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
