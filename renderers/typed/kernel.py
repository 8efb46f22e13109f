"""One source for three compilers: Cython reads the types of C in kernel.pxd, mypyc those below, PyPy needs none.

One pixel after another, the eye ray and its mirrored rays as a loop (WLK-1, chain). Tables are flat, row after row;
vectors are three numbers, as a tuple would be an object to Cython. Several results go into a table.
"""

from math import sqrt


def hit_sphere(spheres: list[float], i: int, ox: float, oy: float, oz: float, dx: float, dy: float, dz: float) -> float:
    """Distance to the sphere whose row begins at `i` (SPH-1), -1 for a miss."""
    r = spheres[i + 3]
    fx = ox - spheres[i]
    fy = oy - spheres[i + 1]
    fz = oz - spheres[i + 2]
    b = -(fx * dx + fy * dy + fz * dz)
    lx = fx + b * dx
    ly = fy + b * dy
    lz = fz + b * dz
    delta = r * r - (lx * lx + ly * ly + lz * lz)
    if delta >= 0.0:
        k = fx * fx + fy * fy + fz * fz - r * r
        if k > 0.0:
            if b > 0.0:
                return k / (b + sqrt(delta))
        elif b >= 0.0:
            return b + sqrt(delta)
        else:
            return k / (b - sqrt(delta))
    return -1.0


def occluded(
    spheres: list[float], ox: float, oy: float, oz: float, dx: float, dy: float, dz: float, limit: float
) -> bool:
    """HIT-5"""
    for i in range(0, len(spheres), 4):
        t = hit_sphere(spheres, i, ox, oy, oz, dx, dy, dz)
        if 0.0 < t < limit:
            return True
    return False


def reflectance(n: float, m: float, cosine: float) -> float:
    """R of REF-2."""
    if n == 1.0 and m == 1.0:
        return 0.0
    c = min(1.0, abs(cosine))
    x = 1.0 - n * n * (1.0 - c * c)
    if x <= 0.0:
        return 1.0
    s = sqrt(x)
    r1 = (n * c - m * s) / (n * c + m * s)
    r2 = (m * c - n * s) / (m * c + n * s)
    return (r1 * r1 + r2 * r2) / 2.0


def render(
    picture: list[float],
    counts: list[float],
    spheres: list[float],
    surfaces: list[float],
    exponents: list[float],
    optics: list[float],
    lights: list[float],
    colours: list[float],
    camera: list[float],
    x0: int,
    y0: int,
    columns: int,
    rows: int,
    sample_x: float,
    sample_y: float,
    depth: int,
    shadows: bool,
    epsilon: float,
) -> None:
    """Fill `picture`, 3 numbers a pixel, and `counts`: reflected rays, feelers.

    Of each sphere, spheres has centre and radius, surfaces the diffuse colour and k_s, optics N and M for a ray that
    enters, and for one that leaves. lights: position, colour. colours: ambient light, background. camera: C, u, v, e,
    width, height.
    """
    reflected = feelers = 0.0
    for pixel in range(rows * columns):
        x = 2.0 * (x0 + pixel % columns + sample_x) / camera[12] - 1.0  # CAM-2
        y = 1.0 - 2.0 * (y0 + pixel // columns + sample_y) / camera[13]
        ox, oy, oz = camera[0] + camera[9], camera[1] + camera[10], camera[2] + camera[11]
        dx = x * camera[3] + y * camera[6] - camera[9]  # CAM-3
        dy = x * camera[4] + y * camera[7] - camera[10]
        dz = x * camera[5] + y * camera[8] - camera[11]
        length = sqrt(dx * dx + dy * dy + dz * dz)
        dx, dy, dz = dx / length, dy / length, dz / length
        red = green = blue = 0.0
        weight = 1.0
        for order in range(depth + 1):
            best, near = 0.0, -1
            for i in range(0, len(spheres), 4):
                t = hit_sphere(spheres, i, ox, oy, oz, dx, dy, dz)
                if t > 0.0 and (near < 0 or t < best):
                    best, near = t, i
            if near < 0:  # REF-6
                red, green, blue = red + weight * colours[3], green + weight * colours[4], blue + weight * colours[5]
                break

            cx, cy, cz, r = spheres[near], spheres[near + 1], spheres[near + 2], spheres[near + 3]
            nx, ny, nz = ox + best * dx - cx, oy + best * dy - cy, oz + best * dz - cz  # SPH-2
            length = sqrt(nx * nx + ny * ny + nz * nz)
            nx, ny, nz = nx / length, ny / length, nz / length
            px, py, pz = cx + r * nx, cy + r * ny, cz + r * nz
            off = epsilon * (r + (abs(nx * px) + abs(ny * py) + abs(nz * pz)) / 8.0)  # OFF-1

            kr, kg, kb = surfaces[near], surfaces[near + 1], surfaces[near + 2]
            k_s, exponent = surfaces[near + 3], exponents[near // 4]
            lr, lg, lb = kr * colours[0], kg * colours[1], kb * colours[2]  # LOC-1
            for k in range(0, len(lights), 6):  # LOC-2
                lx, ly, lz = lights[k] - px, lights[k + 1] - py, lights[k + 2] - pz
                length = sqrt(lx * lx + ly * ly + lz * lz)
                if length == 0.0:
                    continue
                lx, ly, lz = lx / length, ly / length, lz / length
                facing = nx * lx + ny * ly + nz * lz
                if not facing > 0.0:
                    continue
                if shadows:
                    feelers += 1.0
                    if occluded(spheres, px + off * nx, py + off * ny, pz + off * nz, lx, ly, lz, length):
                        continue
                c = lx * dx + ly * dy + lz * dz - 2.0 * facing * (nx * dx + ny * dy + nz * dz)  # LOC-4
                shine = 0.0
                if c > 0.0 and k_s > 0.0:
                    shine = k_s * min(c, 1.0) ** exponent
                lr += (kr * facing + shine) * lights[k + 3]
                lg += (kg * facing + shine) * lights[k + 4]
                lb += (kb * facing + shine) * lights[k + 5]
            red, green, blue = red + weight * lr, green + weight * lg, blue + weight * lb

            if order == depth:  # REF-5
                break
            cosine = dx * nx + dy * ny + dz * nz
            side, medium = 1.0, near
            if cosine > 0.0:
                side, medium = -1.0, near + 2
            weight *= k_s * reflectance(optics[medium], optics[medium + 1], cosine)
            if weight == 0.0:  # REF-4
                break
            reflected += 1.0
            ox, oy, oz = px + side * off * nx, py + side * off * ny, pz + side * off * nz
            dx, dy, dz = dx - 2.0 * cosine * nx, dy - 2.0 * cosine * ny, dz - 2.0 * cosine * nz  # REF-3
            length = sqrt(dx * dx + dy * dy + dz * dz)
            dx, dy, dz = dx / length, dy / length, dz / length
        picture[3 * pixel], picture[3 * pixel + 1], picture[3 * pixel + 2] = red, green, blue
    counts[0], counts[1] = reflected, feelers
