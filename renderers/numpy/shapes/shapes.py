"""The common part of all kinds of shape: the search, one shape and all rays at a time (HIT-1, HIT-2, HIT-5)."""


class Shapes:
    """A kind of shape. It has `hits`, `surface` and a length."""

    def seen(self, origins, directions):
        """The rays as `hits` takes them: with what is worked out once for all shapes."""
        return origins, directions

    def nearest(self, first, origins, directions, t, shapes):
        """Where a ray hits one of these before `t` (N,), set `t` to that distance and `shapes` to `first` + number."""
        seen = self.seen(origins, directions)
        for shape in range(len(self)):
            rays, distances = self.hits(shape, *seen)
            closer = (distances > 0) & (distances < t[rays])
            rays = rays[closer]
            t[rays] = distances[closer]
            shapes[rays] = first + shape

    def block(self, origins, directions, limits, blocked):
        """Set `blocked` (N,) where one of these is hit with 0 < t < limit (N,)."""
        seen = self.seen(origins, directions)
        for shape in range(len(self)):
            rays, distances = self.hits(shape, *seen)
            blocked[rays[(distances > 0) & (distances < limits[rays])]] = True
