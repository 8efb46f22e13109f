"""The pinhole camera: from pixels to eye rays (CAM-1 to CAM-5)."""

from .vector import add


class Camera:
    """C, u, v, e as in CAM-1, and the picture that it looks through."""

    def __init__(self, centre, u, v, e, width, height, sample, number):
        self.eye = add(centre, e)
        self.u, self.v, self.e = u, v, e
        self.width, self.height = width, height
        self.sample = number.real(sample[0]), number.real(sample[1])
        self.sqrt = number.sqrt

    def ray(self, i, j):
        """Origin and direction of the eye ray of pixel (i, j)."""
        sx, sy = self.sample
        x = 2 * (i + sx) / self.width - 1
        y = 1 - 2 * (j + sy) / self.height
        (ux, uy, uz), (vx, vy, vz), (ex, ey, ez) = self.u, self.v, self.e
        dx, dy, dz = x * ux + y * vx - ex, x * uy + y * vy - ey, x * uz + y * vz - ez
        length = self.sqrt(dx * dx + dy * dy + dz * dz)
        return self.eye, (dx / length, dy / length, dz / length)
