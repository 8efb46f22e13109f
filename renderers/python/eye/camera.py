"""The camera: from places in the picture to eye rays (CAM-1 to CAM-5, LEN-1)."""

from ..vector import add, normalise, scale


class Camera:
    """C, u, v, e as in CAM-1, and the size of the picture."""

    def __init__(self, centre, u, v, e, width, height, number):
        self.eye = add(centre, e)
        self.u, self.v, self.e = u, v, e
        self.width, self.height = width, height
        self.number = number
        self.sqrt = number.sqrt

    def screen(self, x, y):
        """From the eye to the place (x, y) of the screen, in pixels from the picture's top left (CAM-2)."""
        x = 2 * x / self.width - 1
        y = 1 - 2 * y / self.height
        (ux, uy, uz), (vx, vy, vz), (ex, ey, ez) = self.u, self.v, self.e
        return x * ux + y * vx - ex, x * uy + y * vy - ey, x * uz + y * vz - ez

    def ray(self, x, y):
        """Origin and direction of the eye ray through (x, y) (CAM-3)."""
        dx, dy, dz = self.screen(x, y)
        length = self.sqrt(dx * dx + dy * dy + dz * dz)
        return self.eye, (dx / length, dy / length, dz / length)


class Lens(Camera):
    """A camera with a thin lens instead of the pinhole."""

    def __init__(self, *parts, radius, focal_distance):
        super().__init__(*parts)
        ex, ey, ez = self.e
        self.stretch = focal_distance / self.sqrt(ex * ex + ey * ey + ez * ez)
        self.across = scale(normalise(self.u, self.sqrt), radius)
        self.up = scale(normalise(self.v, self.sqrt), radius)

    def ray(self, x, y, u2, u3):
        """The eye ray through (x, y) of the lens point that the random numbers u2 and u3 choose (LEN-1)."""
        number = self.number
        rho, phi = self.sqrt(u2), 2 * number.pi * u3
        h = add(scale(self.across, rho * number.cos(phi)), scale(self.up, rho * number.sin(phi)))
        dx, dy, dz = scale(self.screen(x, y), self.stretch)
        direction = normalise((dx - h[0], dy - h[1], dz - h[2]), self.sqrt)
        return add(self.eye, h), direction
