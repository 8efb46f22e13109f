"""Numbers as a function of their purpose: Philox4x32-10 (RND), and points of a sequence (SOB)."""

import math

import numpy as np

from .needs import ASK_SAMPLER, SIMULATED, SINGLE, SOBOL, TARGET
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
    """U₀ to U₃ (RND-2, RND-3). place: pixel, sample, and of a ray its order."""
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


PLACE, ON_LENS = 0, 2  # purposes: the first of two dimensions (SOB-1)
GLOSSY = 2**31  # of the use of a random number (GLO-2)
A, C, SIXTEEN, ONE = np.uint64(1664525), np.uint64(1013904223), np.uint64(16), np.uint64(1)
S0, S1, S2 = np.uint64(0x3D20ADEA), np.uint64(0x05526C56), np.uint64(0x53A22864)
SWAPS = tuple(
    (np.uint64(shift), np.uint64(mask))
    for shift, mask in ((16, 0x0000FFFF), (8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555))
)


@kernel
def mixed(v0, v1, v2, v3):
    """Two words from four: pcg4d (SOB-3)."""
    v0, v1, v2, v3 = (v0 * A + C) & LOW, (v1 * A + C) & LOW, (v2 * A + C) & LOW, (v3 * A + C) & LOW
    v0 = (v0 + v1 * v3) & LOW
    v1 = (v1 + v2 * v0) & LOW
    v2 = (v2 + v0 * v1) & LOW
    v3 = (v3 + v1 * v2) & LOW
    v0, v1, v2, v3 = v0 ^ (v0 >> SIXTEEN), v1 ^ (v1 >> SIXTEEN), v2 ^ (v2 >> SIXTEEN), v3 ^ (v3 >> SIXTEEN)
    v0 = (v0 + v1 * v3) & LOW
    return v0, (v1 + v2 * v0) & LOW


@kernel
def scrambled(x, key):
    """The digits x, the first in the lowest bit, by a key; then all 32 in the other order (SOB-4)."""
    x ^= (x * S0) & LOW
    x = (((x + key) & LOW) * ((key >> SIXTEEN) | ONE)) & LOW
    x ^= (x * S1) & LOW
    x ^= (x * S2) & LOW
    for shift, mask in SWAPS:
        x = ((x >> shift) & mask) | ((x & mask) << shift)
    return x


@kernel
def point(scene, pixel, path, purpose, index):
    """U₀ and U₁ of point `index`, a word, of a purpose (SOB-1 to SOB-4)."""
    x = y = word(0)
    bit = 0
    while index != 0:
        if index & ONE != 0:
            x ^= word(scene.matrices[purpose, bit])
            y ^= word(scene.matrices[purpose + 1, bit])
        index >>= ONE
        bit += 1
    keys = mixed(word(pixel), word(path), word(purpose), word(scene.seed))
    real = type(scene.epsilon)
    unit = real(2**-24)
    x, y = scrambled(x, keys[0]), scrambled(y, keys[1])
    return real(np.int64(x >> EIGHT)) * unit, real(np.int64(y >> EIGHT)) * unit


@kernel
def draw_own(scene, place):
    """U₀ to U₃ of a sample: of its place in the pixel, and on the lens."""
    if SOBOL and (not ASK_SAMPLER or scene.sequenced):
        index = word(place[1])
        return point(scene, place[0], 0, PLACE, index) + point(scene, place[0], 0, ON_LENS, index)
    return draw(scene, place, 0, 0)


@kernel
def draw_for_feeler(scene, place, path, light, f):
    """U₀ and U₁ of feeler `f` to a light (SOF-2)."""
    if SOBOL and (not ASK_SAMPLER or scene.sequenced):
        purpose = scene.first_light + place[2] * scene.each_order + 2 * light
        if purpose < scene.matrices.shape[0]:
            return point(scene, place[0], path, purpose, word(place[1] * scene.feelers + f))
    u = draw(scene, place, path, 1 + light * scene.feelers + f)
    return u[0], u[1]


@kernel
def draw_for_lobe(scene, place, path, g):
    """U₀ and U₁ of glossy ray `g` (GLO-2)."""
    if SOBOL and (not ASK_SAMPLER or scene.sequenced):
        purpose = scene.first_light + place[2] * scene.each_order + scene.light_dimensions
        if purpose < scene.matrices.shape[0]:
            return point(scene, place[0], path, purpose, word(place[1] * scene.glossy_rays + g))
    u = draw(scene, place, path, GLOSSY + g)
    return u[0], u[1]


@kernel
def turn(u):
    """cos and sin of 2π u, for u from 0 to 1."""
    if ON_GPU:  # cosine and sine of a float32 take float64, were it for large angles only
        return libdevice.cospif(u + u), libdevice.sinpif(u + u)
    phi = type(u)(2 * math.pi) * u
    return math.cos(phi), math.sin(phi)
