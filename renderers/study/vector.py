"""Vectors as the study has them, NumPy arrays, each result a new one; or, with that alone changed, tuples.

The operations are written from scratch (2.1.1).
"""

from math import sqrt

import numpy as np


def define(jit, as_tuples):
    """Returns vector, add, subtract, scale, multiply, dot and unit, decorated by `jit`."""
    vector, add, subtract, scale, multiply = tuples(jit) if as_tuples else arrays(jit)

    @jit
    def dot(a, b):
        result = 0.0
        for i in range(3):
            result += a[i] * b[i]
        return result

    @jit
    def unit(a):
        return scale(a, 1.0 / sqrt(dot(a, a)))

    return vector, add, subtract, scale, multiply, dot, unit


def arrays(jit):
    """Returns the operations that make a new array each."""

    @jit
    def vector(x, y, z):
        result = np.zeros(3)
        result[0], result[1], result[2] = x, y, z
        return result

    @jit
    def add(a, b):
        result = np.zeros(3)
        for i in range(3):
            result[i] = a[i] + b[i]
        return result

    @jit
    def subtract(a, b):
        result = np.zeros(3)
        for i in range(3):
            result[i] = a[i] - b[i]
        return result

    @jit
    def scale(a, factor):
        result = np.zeros(3)
        for i in range(3):
            result[i] = a[i] * factor
        return result

    @jit
    def multiply(a, b):
        result = np.zeros(3)
        for i in range(3):
            result[i] = a[i] * b[i]
        return result

    return vector, add, subtract, scale, multiply


def tuples(jit):
    """Returns the same operations, of which each makes a tuple."""

    @jit
    def vector(x, y, z):
        return x, y, z

    @jit
    def add(a, b):
        return a[0] + b[0], a[1] + b[1], a[2] + b[2]

    @jit
    def subtract(a, b):
        return a[0] - b[0], a[1] - b[1], a[2] - b[2]

    @jit
    def scale(a, factor):
        return a[0] * factor, a[1] * factor, a[2] * factor

    @jit
    def multiply(a, b):
        return a[0] * b[0], a[1] * b[1], a[2] * b[2]

    return vector, add, subtract, scale, multiply
