"""The camera: from places on the screen to eye rays (CAM-1 to CAM-5), through a lens if it has one (LEN-1)."""

import numpy as np

from .vector import dot, normalise


class Camera:
    """C, u, v and e as the rows of `rows` (CAM-1), and the lens."""

    def __init__(self, rows, job, precision):
        centre, self.u, self.v, self.e = rows.astype(precision)[:, :, np.newaxis]
        self.eye = centre + self.e
        self.width, self.height = job.width, job.height
        self.lens_radius, self.focal_distance = job.lens_radius, job.focal_distance

    def rays(self, x, y, numbers):
        """Eye rays through the places `x`, `y` (N,), in pixels from the left and from the top.

        Origins (3, 1) and directions (3, N); through a lens origins (3, N), with the random numbers U₀ to U₃ of the
        samples that numbers() gives.
        """
        x, y = 2 * x / self.width - 1, 1 - 2 * y / self.height
        to_screen = x * self.u + y * self.v - self.e
        if not self.lens_radius:
            return self.eye, normalise(to_screen)
        *_, u2, u3 = numbers()
        radius, angle = self.lens_radius * np.sqrt(u2), 2 * np.pi * u3
        on_lens = radius * np.cos(angle) * normalise(self.u) + radius * np.sin(angle) * normalise(self.v)
        focus = self.focal_distance / np.sqrt(dot(self.e, self.e))
        return self.eye + on_lens, normalise(focus * to_screen - on_lens)
