"""RND-1 to RND-3, SOB-1 to SOB-4, and what SOF and GLO make of the numbers, written a second time to test the first."""

import functools

import numpy as np
from scipy.stats import qmc


def philox(counter, key):
    """Four words out of four words of counter and two of key (RND-1)."""
    c, (k0, k1) = [int(word) for word in counter], (int(word) for word in key)
    for turn in range(10):
        first, second = 0xD2511F53 * c[0], 0xCD9E8D57 * c[2]
        a, b = (k0 + turn * 0x9E3779B9) % 2**32, (k1 + turn * 0xBB67AE85) % 2**32
        c = [second >> 32 ^ c[1] ^ a, second % 2**32, first >> 32 ^ c[3] ^ b, first % 2**32]
    return c


def uniforms(pixel, sample, path, use, seed):
    """U0 to U3 (RND-2, RND-3)."""
    words = philox([pixel % 2**32, sample, path % 2**32, use % 2**32], [seed, 0])
    return np.array([(word >> 8) * 2.0**-24 for word in words])


@functools.cache
def digits(index, dimension):
    """The 32 bits of a Sobol point that nobody has scrambled, the most significant first (SOB-2), by SciPy."""
    points = qmc.Sobol(64, scramble=False, bits=32)
    number = index  # SciPy's point `number` is the Sobol point of its Gray code
    for shift in (1, 2, 4, 8, 16):
        number ^= number >> shift
    if number:
        points.fast_forward(number)
    return f"{round(points.random(1)[0][dimension] * 2.0**32):032b}"


def scrambled(bits, key):
    """A word of bits, the most significant first, by Owen's scrambling with a key (SOB-4)."""
    x = np.uint32(int(bits[::-1], 2))
    with np.errstate(over="ignore"):
        key = np.uint32(key)
        x ^= x * np.uint32(0x3D20ADEA)
        x = (x + key) * (key >> np.uint32(16) | np.uint32(1))
        for factor in (0x05526C56, 0x53A22864):
            x ^= x * np.uint32(factor)
    return int(f"{int(x):032b}"[::-1], 2)


def mixed(words):
    """pcg4d (SOB-3)."""
    v = [(word * 1664525 + 1013904223) % 2**32 for word in words]
    for turn in range(2):
        for k, (a, b) in enumerate(((1, 3), (2, 0), (0, 1), (1, 2))):
            v[k] = (v[k] + v[a] * v[b]) % 2**32
        v = [word ^ word >> 16 for word in v] if turn == 0 else v
    return v


def sobol(pixel, path, purpose, index, seed):
    """U0 and U1 of a point of a purpose (SOB-1)."""
    keys = mixed([pixel % 2**32, path % 2**32, purpose, seed])
    words = [scrambled(digits(index % 2**32, purpose + k), keys[k]) for k in range(2)]
    return np.array([(word >> 8) * 2.0**-24 for word in words])


def on_sphere(u):
    """SOF-2"""
    z = 1 - 2 * u[0]
    w = np.sqrt(max(0.0, 1 - z * z))
    return np.array([w * np.cos(2 * np.pi * u[1]), w * np.sin(2 * np.pi * u[1]), z])


def lobe(r, normal, exponent, u):
    """Direction and cosine of GLO-2 round the mirrored direction r."""
    z = (1 - u[0]) ** (1 / (exponent + 1))
    w = np.sqrt(max(0.0, 1 - z * z))
    x, y = w * np.cos(2 * np.pi * u[1]), w * np.sin(2 * np.pi * u[1])
    sign = 1.0 if r[2] >= 0 else -1.0
    a = -1 / (sign + r[2])
    b = r[0] * r[1] * a
    p, q = np.array([1 + sign * r[0] ** 2 * a, sign * b, -sign * r[0]]), np.array([b, sign + r[1] ** 2 * a, -r[1]])
    out = x * p + y * q + z * r
    if (out @ normal) * (r @ normal) < 0:
        out = -x * p - y * q + z * r
    return out / np.linalg.norm(out), z
