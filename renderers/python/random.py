"""Random numbers as a function of their purpose: Philox4x32-10 (RND-1 to RND-4)."""

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
    """The numbers of one job."""

    def __init__(self, seed, real):
        self.key = seed & WORD, 0
        self.real = real

    def numbers(self, pixel, sample, path, use):
        """Four numbers in [0, 1) (RND-2, RND-3)."""
        words = philox((pixel & WORD, sample & WORD, path & WORD, use & WORD), self.key)
        return [self.real((word >> 8) * 2.0**-24) for word in words]
