"""Counter-based random numbers (RND-1 to RND-4): the same for a ray wherever and whenever it is traced."""

import numpy as np

WORD = np.uint64(2**32 - 1)  # 32-bit words are kept in uint64, where their products fit
SHIFT = np.uint64(32)
MULTIPLIERS = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
INCREMENTS = 0x9E3779B9, 0xBB67AE85
ROUNDS = 10
GLOSSY = 2**31  # use of the first glossy ray (GLO-2)


def philox(counter, key):
    """The four words out of four words of counter, arrays of uint64, and two of key, integers (RND-1)."""
    c0, c1, c2, c3 = counter
    k0, k1 = key
    for _ in range(ROUNDS):
        p0, p1 = MULTIPLIERS[0] * c0, MULTIPLIERS[1] * c2
        c0, c1, c2, c3 = (p1 >> SHIFT) ^ c1 ^ np.uint64(k0), p1 & WORD, (p0 >> SHIFT) ^ c3 ^ np.uint64(k1), p0 & WORD
        k0, k1 = (k0 + INCREMENTS[0]) % 2**32, (k1 + INCREMENTS[1]) % 2**32
    return c0, c1, c2, c3


class Streams:
    """The random numbers of some rays: words (N,) or one word for all (1,), of their pixels, samples and paths."""

    def __init__(self, seed, precision, pixels, samples, paths):
        self.seed, self.precision = seed, precision
        self.counter = tuple(np.asarray(words).astype(np.uint64) & WORD for words in (pixels, samples, paths))

    def take(self, rays):
        words = (words if len(words) == 1 else words.take(rays) for words in self.counter)
        return Streams(self.seed, self.precision, *words)

    def uniform(self, use):
        """U₀ to U₃ (N,) in [0, 1), for a use or a use for each ray (RND-2, RND-3)."""
        use = np.atleast_1d(np.asarray(use, np.uint64)) & WORD
        words = philox((*self.counter, use), (self.seed, 0))
        return [(word >> np.uint64(8)).astype(self.precision) * 2.0**-24 for word in words]


def child_path(path, child, branches):
    """Path of child number `child` of the rays of `path`; `branches` is B (RND-4)."""
    return (path * np.uint64(branches) + np.asarray(1 + child, np.uint64)) & WORD
