"""The tracer: a function for each step of the study's chapter 2, an array for each vector.

The formulas are those of SPEC.md, so that the picture is right; what is the study's is how the program is built:
arrays as vectors, made anew by each operation, a general `intersection` that looks at every object (2.3.2), and
`ray_trace` by recursion or by its table of rays (2.7.4).
"""

from math import sqrt

import numpy as np

from .vector import define as vectors

# Columns of `surfaces`: diffuse colour, k_s, exponent, N and M of REF-1 for a ray that enters and for one that leaves.
K_S, EXPONENT, ENTERING, LEAVING = 3, 4, 5, 7
# Columns of a row of `ray_data`: origin, direction, factor. A row with factor 0 holds no ray.
DIRECTION, FACTOR, COLUMNS = 3, 6, 7
# Columns of `rays`, the counts of a pixel.
REFLECTED, SHADOW = 0, 1


def define(jit, jit_loop, rows_of, by_table, as_tuples):
    """Returns `render(picture, rays, spheres, surfaces, lights, colours, camera, frame)`.

    It fills `picture` and `rays`. jit, jit_loop, rows_of: of target.py. by_table: with `ray_data`, without recursion.
    as_tuples: vectors are tuples, not arrays.
    picture: (rows, columns, 3). rays: (rows, columns, 2), reflected rays and feelers. spheres: centre, radius. lights:
    position, colour. colours: ambient light, background. camera: C, u, v, e. frame: width, height, x0, y0, sample_x,
    sample_y, depth, shadows, epsilon.
    """
    vector, add, subtract, scale, multiply, dot, unit = vectors(jit, as_tuples)

    @jit
    def sphere_intersection(sphere, origin, direction):
        """Distance to a sphere (SPH-1), -1 for a miss."""
        r = sphere[3]
        from_centre = subtract(origin, sphere[:3])
        b = -dot(from_centre, direction)
        rest = add(from_centre, scale(direction, b))
        delta = r * r - dot(rest, rest)
        if delta < 0.0:
            return -1.0
        k = dot(from_centre, from_centre) - r * r
        if k > 0.0:
            if b > 0.0:
                return k / (b + sqrt(delta))
            return -1.0
        if b >= 0.0:
            return b + sqrt(delta)
        return k / (b - sqrt(delta))

    @jit
    def intersection(spheres, origin, direction):
        """Number and distance of the nearest object (2.3.2), -1 for none."""
        nearest, t = -1, 0.0
        for i in range(spheres.shape[0]):
            found = sphere_intersection(spheres[i], origin, direction)
            if found > 0.0 and (nearest < 0 or found < t):
                nearest, t = i, found
        return nearest, t

    @jit
    def is_lit(spheres, origin, direction, distance):
        """Does the shadow feeler reach the light (2.4.2, HIT-5)?"""
        for i in range(spheres.shape[0]):
            if 0.0 < sphere_intersection(spheres[i], origin, direction) < distance:
                return False
        return True

    @jit
    def local_illumination(spheres, surface, lights, colours, frame, point, normal, direction, off, rays):
        """Ambient, diffuse and specular light (2.4, LOC-1 to LOC-4)."""
        diffuse = surface[:3]
        colour = multiply(diffuse, colours[0])
        for k in range(lights.shape[0]):
            to_light = subtract(lights[k, :3], point)
            distance = sqrt(dot(to_light, to_light))
            if distance == 0.0:
                continue
            to_light = unit(to_light)
            facing = dot(normal, to_light)
            if not facing > 0.0:
                continue
            if frame[7] > 0.0:
                rays[SHADOW] += 1
                if not is_lit(spheres, add(point, scale(normal, off)), to_light, distance):
                    continue
            mirrored = subtract(to_light, scale(normal, 2.0 * facing))
            shine = dot(mirrored, direction)
            white = 0.0
            if shine > 0.0 and surface[K_S] > 0.0:
                white = surface[K_S] * min(shine, 1.0) ** surface[EXPONENT]
            specular = vector(white, white, white)
            colour = add(colour, multiply(add(scale(diffuse, facing), specular), lights[k, 3:]))
        return colour

    @jit
    def reflection_coefficient(n, m, cosine):
        """R of the study's equations 2.14 to 2.16 (REF-2)."""
        if n == 1.0 and m == 1.0:
            return 0.0
        c = min(1.0, abs(cosine))
        x = 1.0 - n * n * (1.0 - c * c)
        if x <= 0.0:
            return 1.0
        s = sqrt(x)
        perpendicular = ((n * c - m * s) / (n * c + m * s)) ** 2
        parallel = ((m * c - n * s) / (m * c + n * s)) ** 2
        return (perpendicular + parallel) / 2.0

    @jit
    def surface_point(sphere, origin, direction, t, epsilon):
        """Point and normal of a hit (SPH-2), and how far off the surface the next rays begin (OFF-1)."""
        normal = unit(subtract(add(origin, scale(direction, t)), sphere[:3]))
        point = add(sphere[:3], scale(normal, sphere[3]))
        size = abs(normal[0] * point[0]) + abs(normal[1] * point[1]) + abs(normal[2] * point[2])
        return point, normal, epsilon * (sphere[3] + size / 8.0)

    @jit
    def reflected_ray(surface, point, normal, direction, off):
        """Origin, direction and factor k_s R of the reflected ray (2.7.1, REF-3)."""
        cosine = dot(direction, normal)
        side, medium = 1.0, ENTERING
        if cosine > 0.0:
            side, medium = -1.0, LEAVING
        factor = surface[K_S] * reflection_coefficient(surface[medium], surface[medium + 1], cosine)
        origin = add(point, scale(normal, side * off))
        return origin, unit(subtract(direction, scale(normal, 2.0 * cosine))), factor

    @jit
    def ray_trace_by_recursion(spheres, surfaces, lights, colours, frame, origin, direction, order, rays):
        """The colour of a ray: its own, and that of the ray that it spawns (2.7.4)."""
        i, t = intersection(spheres, origin, direction)
        if i < 0:  # REF-6
            return scale(colours[1], 1.0)
        surface = surfaces[i]
        point, normal, off = surface_point(spheres[i], origin, direction, t, frame[8])
        colour = local_illumination(spheres, surface, lights, colours, frame, point, normal, direction, off, rays)
        if order == frame[6]:  # REF-5
            return colour
        origin, direction, factor = reflected_ray(surface, point, normal, direction, off)
        if factor == 0.0:  # REF-4
            return colour
        rays[REFLECTED] += 1
        spawned = ray_trace_by_recursion(spheres, surfaces, lights, colours, frame, origin, direction, order + 1, rays)
        return add(colour, scale(spawned, factor))

    @jit
    def ray_trace_by_table(spheres, surfaces, lights, colours, frame, origin, direction, order, rays):
        """The same as a loop over a row for each ray that there could be, 2^(d+1) - 1 of them (equation 2.21)."""
        depth = int(frame[6])
        ray_data = np.zeros((2 ** (depth + 1) - 1, COLUMNS))
        ray_data[0, :DIRECTION] = origin
        ray_data[0, DIRECTION:FACTOR] = direction
        ray_data[0, FACTOR] = 1.0
        colour = vector(0.0, 0.0, 0.0)
        for row in range(ray_data.shape[0]):
            weight = ray_data[row, FACTOR]
            if weight == 0.0:
                continue
            origin, direction = ray_data[row, :DIRECTION], ray_data[row, DIRECTION:FACTOR]
            i, t = intersection(spheres, origin, direction)
            if i < 0:  # REF-6
                colour = add(colour, scale(colours[1], weight))
                continue
            surface = surfaces[i]
            point, normal, off = surface_point(spheres[i], origin, direction, t, frame[8])
            light = local_illumination(spheres, surface, lights, colours, frame, point, normal, direction, off, rays)
            colour = add(colour, scale(light, weight))
            child = 2 * row + 1  # the next one is the row of a transmitted ray, which no scene of this renderer has
            if child >= ray_data.shape[0]:  # REF-5
                continue
            origin, direction, factor = reflected_ray(surface, point, normal, direction, off)
            if weight * factor == 0.0:  # REF-4
                continue
            rays[REFLECTED] += 1
            ray_data[child, :DIRECTION] = origin
            ray_data[child, DIRECTION:FACTOR] = direction
            ray_data[child, FACTOR] = weight * factor
        return colour

    ray_trace = ray_trace_by_table if by_table else ray_trace_by_recursion

    @jit_loop
    def render(picture, rays, spheres, surfaces, lights, colours, camera, frame):
        for j in rows_of(picture.shape[0]):
            for i in range(picture.shape[1]):
                x = 2.0 * (frame[2] + i + frame[4]) / frame[0] - 1.0  # CAM-2
                y = 1.0 - 2.0 * (frame[3] + j + frame[5]) / frame[1]
                eye = add(camera[0], camera[3])
                across = add(scale(camera[1], x), scale(camera[2], y))
                direction = unit(subtract(across, camera[3]))  # CAM-3
                picture[j, i] = ray_trace(spheres, surfaces, lights, colours, frame, eye, direction, 0, rays[j, i])

    return render
