"""The pinhole camera: from pixels to eye rays (CAM-1 to CAM-5)."""

import numpy as np

from .vector import normalise


class Camera:
    """C, u, v and e as the rows of `rows` (CAM-1), and the region of the job's picture."""

    def __init__(self, rows, job, precision):
        centre, self.u, self.v, self.e = rows.astype(precision)[:, :, np.newaxis]
        self.eye = centre + self.e
        self.width, self.height = job.width, job.height
        self.sample_x, self.sample_y = job.sample
        self.x0, self.y0, x1, y1 = job.region
        self.columns, self.rows = x1 - self.x0, y1 - self.y0

    def rays(self, pixels):
        """Eye rays of `pixels` (N,), numbered row by row in the region: origin (3, 1) and directions (3, N)."""
        row, column = np.divmod(pixels, self.columns)
        i = (self.x0 + column).astype(self.eye.dtype)
        j = (self.y0 + row).astype(self.eye.dtype)
        x = 2 * (i + self.sample_x) / self.width - 1
        y = 1 - 2 * (j + self.sample_y) / self.height
        return self.eye, normalise(x * self.u + y * self.v - self.e)
