"""Vectors are tuples of three numbers. The hot paths write them out: a call costs more than the sum."""


def add(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def subtract(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scale(a, factor):
    return a[0] * factor, a[1] * factor, a[2] * factor


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def normalise(a, sqrt):
    x, y, z = a
    length = sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


def largest(a):
    """|a|∞, the largest absolute component."""
    return max(abs(a[0]), abs(a[1]), abs(a[2]))


def reciprocal(a, b, c):
    """The vectors g with g_i · e_j = 1 if i = j, else 0, for the three edges or axes a, b, c."""
    bc, ca, ab = cross(b, c), cross(c, a), cross(a, b)
    volume = dot(a, bc)
    return tuple((x / volume, y / volume, z / volume) for x, y, z in (bc, ca, ab))


def length(a, sqrt):
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def corners(points):
    """Smallest and largest corner of the box along the axes that holds all of `points`."""
    columns = list(zip(*points, strict=True))
    return tuple(map(min, columns)), tuple(map(max, columns))
