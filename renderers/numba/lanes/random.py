"""Random numbers of a ray in each lane (RND)."""

from ..target import kernel
from .lanes import from_words, to_reals, to_words

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
