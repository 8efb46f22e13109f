"""Numbers as a function of their purpose: Philox4x32-10 (RND-1 to RND-4), and points of a sequence (SOB-1 to SOB-4)."""

WORD = 0xFFFFFFFF
MULTIPLIER_0, MULTIPLIER_1 = 0xD2511F53, 0xCD9E8D57
STEP_0, STEP_1 = 0x9E3779B9, 0xBB67AE85

GLOSSY = 2**31  # first `use` of reflected rays (GLO-2); 0 is the sample's own, lights begin at 1 (SOF-2)


def philox(counter, key):
    """Four words of 32 bits from four of counter and two of key (RND-1)."""
    c0, c1, c2, c3 = counter
    k0, k1 = key
    for _ in range(10):
        p0, p1 = MULTIPLIER_0 * c0, MULTIPLIER_1 * c2
        c0, c1, c2, c3 = (p1 >> 32) ^ c1 ^ k0, p1 & WORD, (p0 >> 32) ^ c3 ^ k1, p0 & WORD
        k0, k1 = (k0 + STEP_0) & WORD, (k1 + STEP_1) & WORD
    return c0, c1, c2, c3


class Random:
    """The numbers of one job. `of` is the pixel and the sample."""

    def __init__(self, seed, real, feelers):
        self.seed, self.real, self.feelers = seed, real, feelers

    def numbers(self, of, path, use):
        """Four numbers in [0, 1) (RND-2, RND-3)."""
        words = philox((of[0] & WORD, of[1] & WORD, path & WORD, use & WORD), (self.seed & WORD, 0))
        return [self.real((word >> 8) * 2.0**-24) for word in words]

    def place(self, *of):
        """U of the place in the pixel."""
        return self.numbers(of, 0, 0)[:2]

    def lens(self, *of):
        """U of the place on the lens."""
        return self.numbers(of, 0, 0)[2:]

    def feeler(self, of, _order, path, light, feeler):
        """U of a feeler to a light (SOF-2)."""
        return self.numbers(of, path, 1 + light * self.feelers + feeler)[:2]

    def lobe(self, of, _order, path, ray):
        """U of a glossy ray (GLO-2)."""
        return self.numbers(of, path, GLOSSY + ray)[:2]


PLACE, LENS = 0, 2  # purposes: the first of two dimensions (SOB-1)


def mixed(v0, v1, v2, v3):
    """Two words of 32 bits from four: pcg4d (SOB-3)."""
    v0, v1, v2, v3 = ((word * 1664525 + 1013904223) & WORD for word in (v0, v1, v2, v3))
    for last in (False, True):
        v0 = (v0 + v1 * v3) & WORD
        v1 = (v1 + v2 * v0) & WORD
        v2 = (v2 + v0 * v1) & WORD
        v3 = (v3 + v1 * v2) & WORD
        if not last:
            v0, v1, v2, v3 = v0 ^ v0 >> 16, v1 ^ v1 >> 16, v2 ^ v2 >> 16, v3 ^ v3 >> 16
    return v0, v1


def scrambled(x, key):
    """The digits x, the first in the lowest bit, in an order that depends on the key (SOB-4)."""
    x ^= x * 0x3D20ADEA & WORD
    x = (x + key) & WORD
    x = x * (key >> 16 | 1) & WORD
    x ^= x * 0x05526C56 & WORD
    return x ^ x * 0x53A22864 & WORD


class Sequence(Random):
    """The same of a job with the sampler `sobol` (SOB-1).

    matrices: sobol.npy. lens: is there one? lights: how many have dimensions. glossy_rays: G of GLO-1.
    """

    def __init__(self, seed, real, feelers, matrices, lens, lights, glossy_rays):
        super().__init__(seed, real, feelers)
        self.matrices, self.glossy_rays = matrices, glossy_rays
        self.first, self.lobes = 4 if lens else 2, 2 * lights
        self.each = self.lobes + (2 if glossy_rays else 0)  # dimensions of an order

    def place(self, pixel, sample):
        return self.point(pixel, 0, PLACE, sample)

    def lens(self, pixel, sample):
        return self.point(pixel, 0, LENS, sample)

    def feeler(self, of, order, path, light, feeler):
        purpose = self.first + order * self.each + 2 * light
        if purpose >= len(self.matrices):
            return super().feeler(of, order, path, light, feeler)
        return self.point(of[0], path, purpose, of[1] * self.feelers + feeler)

    def lobe(self, of, order, path, ray):
        purpose = self.first + order * self.each + self.lobes
        if purpose >= len(self.matrices):
            return super().lobe(of, order, path, ray)
        return self.point(of[0], path, purpose, of[1] * self.glossy_rays + ray)

    def point(self, pixel, path, purpose, index):
        """Point `index` (SOB-1 to SOB-4)."""
        index &= WORD
        x = y = bit = 0
        across, up = self.matrices[purpose : purpose + 2]
        while index >> bit:
            if index >> bit & 1:
                x, y = x ^ across[bit], y ^ up[bit]
            bit += 1
        keys = mixed(pixel & WORD, path & WORD, purpose, self.seed & WORD)
        words = scrambled(x, keys[0]), scrambled(y, keys[1])
        return [self.real(int(f"{word:032b}"[:-25:-1], 2) * 2.0**-24) for word in words]
