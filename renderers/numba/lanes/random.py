"""Random numbers of a ray in each lane (RND), and points of a sequence (SOB)."""

from ..needs import LENS, SOBOL
from ..target import kernel
from .lanes import from_words, spread, to_reals, to_words

M0, M1, W0, W1, LOW = 0xD2511F53, 0xCD9E8D57, 0x9E3779B9, 0xBB67AE85, 0xFFFFFFFF


@kernel
def philox(c0, c1, c2, c3, k0, k1):
    """Four random words from four words of counter and two of key (RND-1)."""
    for _ in range(10):
        p0, p1 = c0 * M0, c2 * M1
        c0, c1, c2, c3 = ((p1 >> 32) & LOW) ^ c1 ^ k0, p1 & LOW, ((p0 >> 32) & LOW) ^ c3 ^ k1, p0 & LOW
        k0, k1 = (k0 + W0) & LOW, (k1 + W1) & LOW
    return c0, c1, c2, c3


@kernel
def uniform(word):
    """U of a word (RND-2)."""
    return to_reals(from_words(word >> 8)) * 2.0**-24


@kernel
def draw(scene, pixel, sample, path, use):
    """U₀ to U₃ (RND-2, RND-3). pixel, path: lanes; sample, use: numbers."""
    c0, c2 = to_words(pixel), to_words(path)
    c1, c3 = (c0 & 0) + (sample & LOW), (c0 & 0) + (use & LOW)
    x = philox(c0, c1, c2, c3, scene.seed & LOW, 0)
    return uniform(x[0]), uniform(x[1]), uniform(x[2]), uniform(x[3])


PLACE, ON_LENS = 0, 2  # purposes: the first of two dimensions (SOB-1)
GLOSSY = 2**31  # of the use of a random number (GLO-2)
SWAPS = (16, 0x0000FFFF), (8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)


@kernel
def mixed(v0, v1, v2, v3):
    """Two words from four: pcg4d (SOB-3)."""
    v0, v1 = (v0 * 1664525 + 1013904223) & LOW, (v1 * 1664525 + 1013904223) & LOW
    v2, v3 = (v2 * 1664525 + 1013904223) & LOW, (v3 * 1664525 + 1013904223) & LOW
    v0 = (v0 + v1 * v3) & LOW
    v1 = (v1 + v2 * v0) & LOW
    v2 = (v2 + v0 * v1) & LOW
    v3 = (v3 + v1 * v2) & LOW
    v0, v1, v2, v3 = v0 ^ (v0 >> 16), v1 ^ (v1 >> 16), v2 ^ (v2 >> 16), v3 ^ (v3 >> 16)
    v0 = (v0 + v1 * v3) & LOW
    return v0, (v1 + v2 * v0) & LOW


@kernel
def scrambled(x, key):
    """The digits x, the first in the lowest bit, by keys; then all 32 in the other order (SOB-4)."""
    x = x ^ ((x * 0x3D20ADEA) & LOW)
    x = (((x + key) & LOW) * ((key >> 16) | 1)) & LOW
    x = x ^ ((x * 0x05526C56) & LOW)
    x = x ^ ((x * 0x53A22864) & LOW)
    for shift, mask in SWAPS:
        x = ((x >> shift) & mask) | ((x & mask) << shift)
    return x


@kernel
def point(scene, pixel, path, purpose, index):
    """U₀ and U₁ of point `index`, a number, of a purpose (SOB-1 to SOB-4)."""
    x = y = bit = 0
    index &= LOW
    while index != 0:
        if index & 1 != 0:
            x ^= int(scene.matrices[purpose, bit])
            y ^= int(scene.matrices[purpose + 1, bit])
        index >>= 1
        bit += 1
    pixels = to_words(pixel)
    nothing = pixels & 0
    keys = mixed(pixels, to_words(path), nothing + purpose, nothing + (scene.seed & LOW))
    return uniform(scrambled(nothing + x, keys[0])), uniform(scrambled(nothing + y, keys[1]))


@kernel
def draw_own(scene, pixel, sample):
    """U₀ to U₃ of a sample: of its places in pixels and on the lens."""
    if not SOBOL:
        return draw(scene, pixel, sample, pixel & 0, 0)
    place = point(scene, pixel, pixel & 0, PLACE, sample)
    lens = point(scene, pixel, pixel & 0, ON_LENS, sample) if LENS else (spread(0.0), spread(0.0))
    return place[0], place[1], lens[0], lens[1]


@kernel
def draw_for_feeler(scene, ray, light, f):
    """U₀ and U₁ of feeler `f` to a light (SOF-2). ray: pixels, sample, order, paths."""
    pixel, sample, order, path = ray
    if SOBOL:
        purpose = scene.first_light + order * scene.each_order + 2 * light
        if purpose < scene.matrices.shape[0]:
            return point(scene, pixel, path, purpose, sample * scene.feelers + f)
    u = draw(scene, pixel, sample, path, 1 + light * scene.feelers + f)
    return u[0], u[1]


@kernel
def draw_for_lobe(scene, ray, g):
    """U₀ and U₁ of glossy ray `g` (GLO-2). ray: pixels, sample, order, paths."""
    pixel, sample, order, path = ray
    if SOBOL:
        purpose = scene.first_light + order * scene.each_order + scene.light_dimensions
        if purpose < scene.matrices.shape[0]:
            return point(scene, pixel, path, purpose, sample * scene.glossy_rays + g)
    u = draw(scene, pixel, sample, path, GLOSSY + g)
    return u[0], u[1]
