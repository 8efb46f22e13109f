"""Proves of some objects, lights and depths that no picture can change without them: by the rules of SPEC.md alone.

Nothing is rendered, and all bounds err on the side of a ray that could be: what is not proved may still be so. Proofs
are of rays without rounding; MARGIN is far more than rounding does to a place.
"""

import numpy as np

from harness.renderer.parameters import Parameters
from harness.scene.bounds import bounds
from harness.scene.model import Box, Ellipsoid, Light, Object, Polygon, Scene, Sphere
from harness.scene.needs import BLACK, OPAQUE, needs

MARGIN = 1e-6  # of the largest coordinate, or of a solid's own extent
CORNERS = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, 8).T
CONVEX = Sphere | Box | Ellipsoid


class Proof:
    """What can be proved of a scene and its job. Each method returns the reason, or "" where there is no proof."""

    def __init__(self, scene: Scene, job: Parameters):
        self.scene, self.job = scene, job
        self.eye = np.add(scene.camera.centre, scene.camera.e)
        self.boxes = bounds(scene.objects)
        finite = np.abs(self.boxes[np.isfinite(self.boxes)])
        self.slack = MARGIN * max([*finite, *np.abs(self.eye)], default=0.0)
        self.seen = [place for place in range(len(scene.objects)) if self._may_be_seen(place)]
        used = needs(scene, job)
        self.bright = [place for place, thing in enumerate(scene.objects) if thing.material.k_s > 0]
        self.reflects = "reflection" in used
        # Only what an eye ray meets can send the first ray of a higher order (REF-4).
        self.direct = job.depth == 0 or all(scene.objects[place].material.k_s == 0 for place in self.seen)
        self.shadows = "shadows" in used

    def depth(self, depth: int) -> str:
        """Of a greater depth than this."""
        if not self.reflects:
            return "no surface has k_s > 0, so no ray is reflected or transmitted"
        if self.direct:
            return "nothing that an eye ray can meet has k_s > 0, so no ray is reflected or transmitted"
        if depth >= 1 and len(self.bright) == 1:
            (place,) = self.bright
            mirror = self.scene.objects[place]
            convex = isinstance(mirror, Polygon) or (isinstance(mirror, CONVEX) and self._outside(place))
            if convex and mirror.material.attenuation == OPAQUE:
                return "the one surface with k_s > 0 is convex and opaque, so no ray that leaves it meets it again"
        return ""

    def light(self, place: int) -> str:
        """Of the light at this place in the scene."""
        light = self.scene.lights[place]
        # A light less would give the feelers of those after it other numbers (SOF-2).
        if self.job.feelers > 0 and any(later.radius > 0 for later in self.scene.lights[place + 1 :]):
            return ""
        if light.colour == BLACK:
            return "its colour is black"
        if self.direct and self._behind_all(light):
            return "it is behind every surface that an eye ray can meet, and no ray is reflected (LOC-2)"
        if not self.shadows:
            return ""
        solid = self._enclosing(self._around(light), None)
        return f"it is inside the opaque solid {solid}, which lets no feeler in" if solid else ""

    def thing(self, place: int) -> str:
        """Of the object at this place in the scene."""
        solid = self._enclosing(self.boxes[place], place)
        if solid:
            return f"it is inside the opaque solid {solid}, which no ray enters"
        if not self.direct or place in self.seen:
            return ""
        if not self.shadows:
            return "it is outside of the view, no ray is reflected, and there are no shadows"
        feelers = np.array([*self.boxes[self.seen], *map(self._around, self.scene.lights)])
        low, high, box = feelers[:, 0].min(axis=0), feelers[:, 1].max(axis=0), self.boxes[place]
        if (box[0] > high + self.slack).any() or (box[1] < low - self.slack).any():
            return (
                "it is outside of the view and of the box around all that is seen and the lights; no ray is reflected"
            )
        return ""

    def _around(self, light: Light) -> np.ndarray:
        """The box (2, 3) around all that a feeler to a light can aim at (SOF-1)."""
        reach = light.radius if self.job.feelers > 0 else 0.0
        return np.array([np.subtract(light.position, reach), np.add(light.position, reach)])

    def _outside(self, place: int) -> bool:
        """Whether all eye rays start outside of the box of an object."""
        low, high = self.boxes[place] + [[-self.slack - self.job.lens_radius], [self.slack + self.job.lens_radius]]
        return bool(((self.eye < low) | (self.eye > high)).any())

    def _may_be_seen(self, place: int) -> bool:
        """Whether an eye ray could meet an object: with a pinhole, if its box is not all on one side of the view."""
        if self.job.lens_radius > 0 or not np.isfinite(self.boxes[place]).all():
            return True
        camera, wide = self.scene.camera, 1 + 2 / min(self.job.width, self.job.height)  # SAM-6 moves samples
        u, v, e = map(np.array, (camera.u, camera.v, camera.e))
        rays = [wide * (x * u + y * v) - e for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        ahead = np.cross(u, v)
        planes = [ahead, *(np.cross(rays[k - 1], rays[k]) for k in range(4))]
        corners = np.where(CORNERS, self.boxes[place][1], self.boxes[place][0]) - self.eye
        for plane in planes:
            inward = plane * -np.sign(plane @ e) / np.linalg.norm(plane)
            if (corners @ inward < -self.slack).all():
                return False
        return True

    def _behind_all(self, light: Light) -> bool:
        """Whether all that can be seen are polygons, with the eye on one side and a light on the other (HIT-3)."""
        if self.job.lens_radius > 0:
            return False
        reach = light.radius if self.job.feelers > 0 else 0.0
        for thing in (self.scene.objects[place] for place in self.seen):
            if not isinstance(thing, Polygon):
                return False
            points = np.array(thing.vertices, np.float64)
            normal = np.cross(points - points[0], np.roll(points, -1, axis=0) - points[0]).sum(axis=0)  # POL-1
            normal /= np.linalg.norm(normal)
            # Its vertices are in a plane to some digits only.
            heights = [
                np.array([normal @ (point - vertex) for vertex in points]) for point in (self.eye, light.position)
            ]
            far = self.slack + reach
            sides = [np.sign(h[0]) if (np.abs(h) > far).all() and np.ptp(np.sign(h)) == 0 else 0 for h in heights]
            if sides[0] * sides[1] >= 0:
                return False
        return True

    def _enclosing(self, box: np.ndarray, own: int | None) -> str:
        """Which opaque convex solid is around all of a box, with the eye outside of it; "" if none is."""
        if not np.isfinite(box).all():
            return ""
        corners = np.where(CORNERS, box[1], box[0])
        for place, solid in enumerate(self.scene.objects):
            if place == own or not isinstance(solid, CONVEX) or solid.material.attenuation != OPAQUE:
                continue
            if self._outside(place) and _within(solid, corners, MARGIN):
                return f"of line {solid.line}" if solid.line else f"{place + 1}"
        return ""


def _within(solid: Object, points: np.ndarray, margin: float) -> bool:
    """Whether all points (N, 3) are deeper in a sphere, box or ellipsoid than this share of its extent."""
    if isinstance(solid, Sphere):
        return bool((np.linalg.norm(points - solid.centre, axis=1) < (1 - margin) * solid.radius).all())
    frame = solid.edges if isinstance(solid, Box) else solid.axes
    origin = solid.corner if isinstance(solid, Box) else solid.centre
    places = np.linalg.solve(np.transpose(frame), (points - origin).T).T
    if isinstance(solid, Box):
        return bool(((places > margin) & (places < 1 - margin)).all())
    return bool((np.linalg.norm(places, axis=1) < 1 - margin).all())
