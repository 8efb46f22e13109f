"""Light at a point, and how much of it a mirror gives back."""

import math

from .scene import AMBIENT, EXPONENT, INDEX, PERMEABILITY, SPECULAR, occluded
from .vector import add, along, dot, kernel, multiply, row, scale, subtract


@kernel
def local_light(scene, material, point, normal, direction, outside, shadows):
    """Linear RGB (LOC-1 to LOC-5) at `point`, and the number of feelers, which leave from `outside`."""
    real = type(direction[0])
    one, two = real(1), real(2)
    lights = scene.lights
    diffuse = row(scene.materials, material)
    specular = scene.materials[material, SPECULAR]
    colour = multiply(diffuse, row(scene.colours, AMBIENT))
    feelers = 0
    for i in range(len(lights)):
        to_light = subtract(row(lights, i), point)
        distance = math.sqrt(dot(to_light, to_light))
        l = to_light[0] / distance, to_light[1] / distance, to_light[2] / distance  # noqa: E741
        cosine = dot(normal, l)
        if not cosine > 0:
            continue
        if shadows:
            feelers += 1
            if occluded(scene, outside, l, distance):
                continue
        received = scale(cosine, diffuse)
        r = subtract(scale(two * cosine, normal), l)
        c = -dot(r, direction)
        if c > 0:
            highlight = specular * min(c, one) ** scene.materials[material, EXPONENT]
            received = received[0] + highlight, received[1] + highlight, received[2] + highlight
        colour = add(colour, multiply(received, (lights[i, 3], lights[i, 4], lights[i, 5])))
    return colour, feelers


@kernel
def reflectance(air, materials, material, cosine):
    """R of Fresnel for unpolarised light (REF-1, REF-2). cosine: d·n, above 0 inside the material."""
    real = type(cosine)
    one, half = real(1), real(0.5)
    n_i, mu_i = air[0], air[1]
    n_t, mu_t = materials[material, INDEX], materials[material, PERMEABILITY]
    if cosine > 0:
        n_i, mu_i, n_t, mu_t = n_t, mu_t, n_i, mu_i
    n, m = n_i / n_t, mu_i / mu_t
    c = min(one, abs(cosine))
    x = one - n * n * (one - c * c)
    if x < 0:
        return one
    s = math.sqrt(x)
    r1 = (n * c - m * s) / (n * c + m * s)
    r2 = (m * c - n * s) / (m * c + n * s)
    return half * (r1 * r1 + r2 * r2)


@kernel
def mirrored(direction, normal, cosine):
    """REF-3, before it is normalised. cosine: d·n."""
    return along(direction, type(cosine)(-2) * cosine, normal)
