"""One pixel after another, the eye ray and its mirrored rays as a loop (WLK-1, chain).

Rows of `spheres` are centre and radius; of `surfaces`, one a sphere, the columns below. A vector is ti.Vector; what is
not needed is left out when `kernel` is compiled.
"""

import taichi as ti

SPECULAR, EXPONENT, ENTERING, LEAVING = 3, 4, 5, 7  # after the diffuse colour; the last two are N and M (REF-1)
COLOUR = 3  # of a light, after its position


@ti.func
def row(table: ti.template(), i: int):
    return ti.Vector([table[i, 0], table[i, 1], table[i, 2]])


@ti.func
def normalise(a):
    """NUM-4; `normalized` of Taichi multiplies by the inverse."""
    return a / ti.sqrt(a.dot(a))


@ti.func
def hit_sphere(spheres: ti.template(), i: int, origin, direction):
    """Distance to sphere `i` (SPH-1), inf for a miss."""
    t = float(ti.math.inf)
    f = origin - row(spheres, i)
    square = spheres[i, 3] * spheres[i, 3]
    b = -f.dot(direction)
    l = f + b * direction  # noqa: E741
    delta = square - l.dot(l)
    if delta >= 0:
        k = f.dot(f) - square
        if k > 0:
            if b > 0:
                t = k / (b + ti.sqrt(delta))
        elif b >= 0:
            t = b + ti.sqrt(delta)
        else:
            t = k / (b - ti.sqrt(delta))
    return t


@ti.func
def occluded(spheres: ti.template(), origin, direction, limit):
    """HIT-5"""
    blocked = False
    for i in range(spheres.shape[0]):
        t = hit_sphere(spheres, i, origin, direction)
        if 0 < t < limit:
            blocked = True
            break
    return blocked


@ti.func
def reflectance(n, m, cosine):
    """R of REF-2."""
    r = float(0)
    if n != 1 or m != 1:
        c = ti.min(float(1), ti.abs(cosine))
        x = 1 - n * n * (1 - c * c)
        r = float(1)
        if x > 0:
            s = ti.sqrt(x)
            r1, r2 = (n * c - m * s) / (n * c + m * s), (m * c - n * s) / (m * c + n * s)
            r = (r1 * r1 + r2 * r2) / 2
    return r


def kernel(needs):
    """The kernel of a job with these needs: render(picture, counts, spheres, ..) fills its first two arguments."""
    ambient_light, diffuse_light, phong, shadows, reflection = (
        name in needs for name in ("ambient", "diffuse", "phong", "shadows", "reflection")
    )

    @ti.func
    def local_light(
        spheres: ti.template(), surfaces: ti.template(), lights: ti.template(), colours: ti.template(),
        i: int, point, normal, direction, epsilon: float,
    ):  # fmt: skip
        """Linear RGB (LOC-1 to LOC-4) at `point` of sphere `i`, and the number of feelers."""
        diffuse, colour, feelers = row(surfaces, i), ti.Vector([float(0), float(0), float(0)]), 0
        if ti.static(ambient_light):
            colour = diffuse * row(colours, 0)
        if ti.static(diffuse_light or phong):
            for k in range(lights.shape[0]):
                to_light = row(lights, k) - point
                distance = ti.sqrt(to_light.dot(to_light))
                l = to_light / distance  # noqa: E741
                cosine = normal.dot(l)
                if cosine > 0:
                    blocked = False
                    if ti.static(shadows):
                        feelers += 1
                        blocked = occluded(spheres, point + leaving(spheres, i, point, normal, epsilon), l, distance)
                    if not blocked:
                        received = ti.Vector([float(0), float(0), float(0)])
                        if ti.static(diffuse_light):
                            received = cosine * diffuse
                        if ti.static(phong):
                            c = -(2 * cosine * normal - l).dot(direction)
                            if c > 0:
                                received += surfaces[i, SPECULAR] * ti.min(c, float(1)) ** surfaces[i, EXPONENT]
                        colour += received * ti.Vector([lights[k, COLOUR + q] for q in range(3)])
        return colour, feelers

    @ti.func
    def leaving(spheres: ti.template(), i: int, point, normal, epsilon):
        """Moves `point` off sphere `i` on the side of its normal (OFF-1, bounded)."""
        return epsilon * (spheres[i, 3] + ti.abs(normal * point).sum() / 8) * normal

    @ti.kernel
    def render(
        picture: ti.types.ndarray(ndim=3),
        counts: ti.types.ndarray(ndim=3),
        spheres: ti.types.ndarray(ndim=2),
        surfaces: ti.types.ndarray(ndim=2),
        lights: ti.types.ndarray(ndim=2),
        colours: ti.types.ndarray(ndim=2),
        camera: ti.types.ndarray(ndim=2),
        x0: int, y0: int, width: float, height: float, sample_x: float, sample_y: float, depth: int, epsilon: float,
    ):  # fmt: skip
        """picture: (rows, columns, 3). counts: (rows, columns, 2), reflected rays and feelers of each pixel.

        colours: ambient light and background. camera: C, u, v, e.
        """
        for j, i in ti.ndrange(picture.shape[0], picture.shape[1]):
            x = 2 * (x0 + i + sample_x) / width - 1  # CAM-2
            y = 1 - 2 * (y0 + j + sample_y) / height
            origin = row(camera, 0) + row(camera, 3)
            direction = normalise(x * row(camera, 1) + y * row(camera, 2) - row(camera, 3))  # CAM-3
            colour, weight, reflected, feelers = ti.Vector([float(0), float(0), float(0)]), float(1), 0, 0
            for order in range(depth + 1):
                best, nearest = float(ti.math.inf), -1
                for k in range(spheres.shape[0]):
                    t = hit_sphere(spheres, k, origin, direction)
                    if 0 < t < best:
                        best, nearest = t, k
                if nearest < 0:
                    colour += weight * row(colours, 1)  # REF-6
                    break
                centre = row(spheres, nearest)
                normal = normalise(origin + best * direction - centre)  # SPH-2
                point = centre + spheres[nearest, 3] * normal
                light, asked = local_light(
                    spheres, surfaces, lights, colours, nearest, point, normal, direction, epsilon
                )
                colour += weight * light
                feelers += asked
                if ti.static(not reflection):
                    break
                if order == depth:  # REF-5
                    break
                cosine, side, optics = direction.dot(normal), float(1), ENTERING
                if cosine > 0:
                    side, optics = float(-1), LEAVING
                r = reflectance(surfaces[nearest, optics], surfaces[nearest, optics + 1], cosine)
                weight *= surfaces[nearest, SPECULAR] * r
                if weight == 0:  # REF-4
                    break
                reflected += 1
                origin = point + side * leaving(spheres, nearest, point, normal, epsilon)
                direction = normalise(direction - 2 * cosine * normal)  # REF-3
            for q in ti.static(range(3)):
                picture[j, i, q] = colour[q]
            counts[j, i, 0], counts[j, i, 1] = reflected, feelers

    return render
