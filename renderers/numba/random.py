"""Random numbers as a function of their purpose: Philox4x32-10 (RND)."""

import math

import numpy as np

from .needs import SIMULATED, SINGLE, TARGET
from .target import kernel

ON_GPU = TARGET == "cuda" and SINGLE and not SIMULATED
if ON_GPU:
    from numba.cuda import libdevice

# All words are 32 bits in a uint64. Constants have that type too: with an int64, Numba would go on in float64.
M0, M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
W0, W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
LOW, HALF, EIGHT = np.uint64(0xFFFFFFFF), np.uint64(32), np.uint64(8)


@kernel
def philox(c0, c1, c2, c3, k0, k1):
    """Four random words from four words of counter and two of key (RND-1)."""
    for _ in range(10):
        p0, p1 = M0 * c0, M1 * c2
        c0, c1, c2, c3 = (p1 >> HALF) ^ c1 ^ k0, p1 & LOW, (p0 >> HALF) ^ c3 ^ k1, p0 & LOW
        k0, k1 = (k0 + W0) & LOW, (k1 + W1) & LOW
    return c0, c1, c2, c3


@kernel
def word(number):
    return np.uint64(number) & LOW


@kernel
def draw(scene, place, path, use):
    """U₀ to U₃ (RND-2, RND-3). place: pixel, sample."""
    zero = word(0)
    x = philox(word(place[0]), word(place[1]), word(path), word(use), word(scene.seed), zero)
    real = type(scene.epsilon)
    unit = real(2**-24)
    return (
        real(np.int64(x[0] >> EIGHT)) * unit,
        real(np.int64(x[1] >> EIGHT)) * unit,
        real(np.int64(x[2] >> EIGHT)) * unit,
        real(np.int64(x[3] >> EIGHT)) * unit,
    )


@kernel
def turn(u):
    """cos and sin of 2π u, for u from 0 to 1."""
    if ON_GPU:  # cosine and sine of a float32 take float64, were it for large angles only
        return libdevice.cospif(u + u), libdevice.sinpif(u + u)
    phi = type(u)(2 * math.pi) * u
    return math.cos(phi), math.sin(phi)
