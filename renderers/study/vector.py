"""Vectors as the study has them: NumPy arrays, each result a new one, the operations written from scratch (2.1.1)."""

from math import sqrt

import numpy as np


def define(jit):
    """Returns add, subtract, scale, multiply, dot and unit, decorated by `jit`."""

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

    @jit
    def dot(a, b):
        result = 0.0
        for i in range(3):
            result += a[i] * b[i]
        return result

    @jit
    def unit(a):
        return scale(a, 1.0 / sqrt(dot(a, a)))

    return add, subtract, scale, multiply, dot, unit
