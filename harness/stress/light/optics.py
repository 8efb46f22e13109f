"""Computes reflectance, and transmission through a row of surfaces, in many digits (mpmath)."""

import mpmath as mp


def reflectance(i: tuple, t: tuple, cosine):
    """R of unpolarised light that goes from the medium `i` to `t`, both (eps_r, mu_r). cosine: of incidence, 0 to 1.

    Fresnel's amplitudes by the wave admittances sqrt(eps/mu), and Snell's law.
    """
    eps_i, mu_i, eps_t, mu_t = map(mp.mpf, (*i, *t))
    sine2 = eps_i * mu_i / (eps_t * mu_t) * (1 - cosine * cosine)  # of the transmitted ray
    if sine2 >= 1:
        return mp.mpf(1)
    beyond = mp.sqrt(1 - sine2)
    a, b = mp.sqrt(eps_i / mu_i), mp.sqrt(eps_t / mu_t)
    across = (a * cosine - b * beyond) / (a * cosine + b * beyond)
    along = (b * cosine - a * beyond) / (b * cosine + a * beyond)
    return (across**2 + along**2) / 2


def white_light(reflectances: list, depth: int):
    """The share of a white world's light that a ray sees through surfaces in a row, with these reflectances.

    Every surface reflects R and transmits 1 - R, from either side; rays of an order above `depth` are not traced
    (REF-5).
    """
    light, going = mp.mpf(0), {(0, 1): mp.mpf(1)}
    for _ in range(depth):
        after = {}
        for (k, way), weight in going.items():
            for place, share in (((k - way, -way), reflectances[k]), ((k + way, way), 1 - reflectances[k])):
                if 0 <= place[0] < len(reflectances):
                    after[place] = after.get(place, 0) + weight * share
                else:
                    light += weight * share
        going = after
    return light
