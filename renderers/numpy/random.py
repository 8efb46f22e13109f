"""Random numbers (RND) and points of a sequence (SOB): the same for a ray wherever and whenever it is traced."""

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
    """The numbers of some rays of an order: words (N,) or one word for all (1,), of their pixels, samples and paths."""

    def __init__(self, scene, order, pixels, samples, paths):
        self.scene, self.order = scene, order
        self.words = tuple(np.asarray(words).astype(np.uint64) & WORD for words in (pixels, samples, paths))

    def take(self, rays):
        words = (words if len(words) == 1 else words.take(rays) for words in self.words)
        return Streams(self.scene, self.order, *words)

    def own(self):
        """U₀ to U₃ (N,) of samples: of their places in the pixel and on the lens."""
        points = self.scene.points
        return [*points.at(self.words, PLACE), *points.at(self.words, LENS)] if points else self._random(0)

    def for_feeler(self, light, feeler):
        """U₀ and U₁ (N,) of a feeler to a light (SOF-2)."""
        points, feelers = self.scene.points, self.scene.feelers
        if points and (purpose := points.of_light(self.order, light)) < points.dimensions:
            return points.at(self.words, purpose, feelers, feeler)
        return self._random(1 + light * feelers + feeler)[:2]

    def for_lobes(self, rays):
        """U₀ and U₁ (N,) of glossy rays with these numbers (N,) (GLO-2)."""
        points = self.scene.points
        if points and (purpose := points.of_lobe(self.order)) < points.dimensions:
            return points.at(self.words, purpose, self.scene.glossy_rays, rays)
        return self._random(GLOSSY + rays)[:2]

    def _random(self, use):
        """U₀ to U₃ (N,) in [0, 1), for a use or a use for each ray (RND-2, RND-3)."""
        use = np.atleast_1d(np.asarray(use, np.uint64)) & WORD
        return [unit(word, self.scene.precision) for word in philox((*self.words, use), (self.scene.seed, 0))]


PLACE, LENS = 0, 2  # purposes: the first of two dimensions (SOB-1)


class Points:
    """The points of a job's sequence.

    matrices: sobol.npy. lights: how many have dimensions. lens, lobes: are there any?
    """

    def __init__(self, seed, precision, matrices, lens, lights, lobes):
        self.seed, self.precision, self.matrices = seed, precision, matrices
        self.dimensions = len(matrices)
        self.first, self.lobes = 4 if lens else 2, 2 * lights
        self.each = self.lobes + 2 * lobes  # dimensions of an order

    def of_light(self, order, light):
        return self.first + order * self.each + 2 * light

    def of_lobe(self, order):
        return self.first + order * self.each + self.lobes

    def at(self, words, purpose, count=1, number=0):
        """U₀ and U₁ (N,) of pixels, samples and paths: of point `number` of `count` of each sample."""
        pixels, samples, paths = words
        index = (samples * np.uint64(count) + np.asarray(number, np.uint64)).astype(np.uint32)
        keys = mixed(*(np.asarray(word).astype(np.uint32) for word in (pixels, paths, [purpose], [self.seed])))
        for row, key in zip(self.matrices[purpose : purpose + 2], keys, strict=True):
            digits = np.zeros_like(index)
            for bit in range(int(index.max(initial=0)).bit_length()):  # SOB-2
                digits ^= np.where(index >> np.uint32(bit) & ONE, row[bit], np.uint32(0))
            yield unit(backward(scrambled(digits, key)), self.precision)


def unit(words, precision):
    """Numbers in [0, 1) of words of 32 bits (RND-2)."""
    return (words >> words.dtype.type(8)).astype(precision) * 2.0**-24


ONE = np.uint32(1)


def mixed(v0, v1, v2, v3):
    """Two words (N,) from four, arrays of uint32: pcg4d (SOB-3)."""
    v0, v1, v2, v3 = (word * np.uint32(1664525) + np.uint32(1013904223) for word in (v0, v1, v2, v3))
    for last in (False, True):
        v0 = v0 + v1 * v3
        v1 = v1 + v2 * v0
        v2 = v2 + v0 * v1
        v3 = v3 + v1 * v2
        if not last:
            v0, v1, v2, v3 = (word ^ word >> np.uint32(16) for word in (v0, v1, v2, v3))
    return v0, v1


def scrambled(x, key):
    """Digits (N,), the first in the lowest bit, by keys (N,) (SOB-4)."""
    x = x ^ x * np.uint32(0x3D20ADEA)
    x = (x + key) * (key >> np.uint32(16) | ONE)
    x = x ^ x * np.uint32(0x05526C56)
    return x ^ x * np.uint32(0x53A22864)


def backward(x):
    """Words with their 32 bits in the other order."""
    for shift, mask in ((16, 0x0000FFFF), (8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
        shift, mask = np.uint32(shift), np.uint32(mask)
        x = (x >> shift & mask) | (x & mask) << shift
    return x


def child_path(path, child, branches):
    """Path of child number `child` of the rays of `path`; `branches` is B (RND-4)."""
    return (path * np.uint64(branches) + np.asarray(1 + child, np.uint64)) & WORD
