"""Computes the colour of a ray (REF-4 to REF-6)."""

import math
from functools import partial

from . import shade, walk
from .random import Random, Sequence
from .scene import first_hit
from .shade import WEIGHTS, gloss, spread, transmit
from .vector import dot, normalise


class Counts:
    """Rays traced in one frame (CNT-1), and samples that are not finite (CNT-2)."""

    def __init__(self):
        self.primary = self.reflected = self.transmitted = self.shadow = self.non_finite = 0


class Tracer:
    """Computes the colours of eye rays, with only the functions that this job needs.

    `colour(origin, direction, pixel, sample)` is (red, green, blue). `dropped` grows by the weights that it cuts.
    """

    def __init__(self, scene, job):
        self.scene, self.depth, self.shadows = scene, job.depth, job.shadows
        self.counts = Counts()
        self.lights = [(position, colour) for position, colour, _ in scene.lights]
        self.number = scene.number
        self.transmits = "transmission" in job.needs
        self.attenuates = "attenuation" in job.needs
        self.feelers = job.feelers if "soft" in job.needs else 0
        self.glossy_rays = job.glossy_rays if "glossy" in job.needs and scene.rough else 0  # G of GLO-1
        self.cuts = "cutoff" in job.needs
        self.cutoff = scene.number.real(job.cutoff if self.cuts else -1)  # no weight is so small
        self.dropped = 0
        self.local = shade.facing if job.variant == "python-flat-meshes" else shade.local
        self.weigh = WEIGHTS[job.glossy_weight]
        if job.fresnel == "clamped":
            self.fresnel, self.beyond = shade.fresnel, shade.beyond
        else:
            self.fresnel, self.beyond = shade.unclamped_fresnel, shade.unclamped_beyond
        if job.renormalise == "on":
            self.reflect, self.unit = shade.reflect, normalise
        else:
            self.reflect, self.unit = shade.unnormalised_reflect, shade.as_it_is
        self.random = Random(job.seed, scene.number.real, self.feelers)
        if job.sampler == "sobol":
            lights = len(scene.lights) if self.feelers and any(radius > 0 for _, _, radius in scene.lights) else 0
            points = scene.matrices, "lens" in job.needs, lights, self.glossy_rays
            self.random = Sequence(job.seed, scene.number.real, self.feelers, *points)
        # of RND-4; WLK-1 counts the transmitted child only where there is one
        self.children_of_path = max(self.glossy_rays, 1) + 1
        children = max(self.glossy_rays, 1) + self.transmits
        example = (scene.number.real(1) / 3,) * 3
        row = example, 0, (example, example, scene.media.eye, 0)
        self.walk = walk.Walk(job.walk, job.depth, children, row, self.cuts)
        special = self.transmits or self.attenuates or self.feelers or self.glossy_rays or "media" in job.needs
        self.colour = self.tree if special or self.walk.name != "chain" else self.mirrors

    def methods(self, job):
        """The methods chosen, for the event `used`."""
        chosen = {"sampler": job.sampler, "walk": self.walk.name}
        if self.walk.rows is not None:  # WLK-2
            chosen |= {"walk_rows": self.walk.rows, "walk_bytes": self.walk.bytes}
        if self.glossy_rays:
            chosen["glossy_weight"] = job.glossy_weight
        if self.cuts:
            chosen["cutoff"] = job.cutoff
        return chosen

    def mirrors(self, origin, direction, _pixel, _sample):
        """The colour of an eye ray if nothing transmits or attenuates: a loop along its chain of reflected rays."""
        scene, depth, shadows, counts, lights = self.scene, self.depth, self.shadows, self.counts, self.lights
        fresnel, reflect, local = self.fresnel, self.reflect, self.local
        red = green = blue = 0
        weight = 1
        for order in range(depth + 1):
            hit = first_hit(scene, origin, direction, math.inf)
            if hit is None:
                r, g, b = scene.background
                return red + weight * r, green + weight * g, blue + weight * b
            _, point, normal, shape = hit
            r, g, b = local(scene, lights, direction, point, normal, shape, shadows, counts)
            red, green, blue = red + weight * r, green + weight * g, blue + weight * b
            if order == depth:
                break
            material = shape.material
            d_dot_n = dot(direction, normal)
            side, (n, m) = (1, material.entering) if d_dot_n <= 0 else (-1, material.leaving)
            share = material.k_s * fresnel(n, m, d_dot_n, scene.number.sqrt)
            if share == 0:
                break
            weight *= share
            if weight <= self.cutoff:
                self.dropped += weight
                break
            counts.reflected += 1
            origin = scene.leave(point, normal, shape.size, side)
            direction = reflect(direction, normal, d_dot_n, scene.number.sqrt)
        return red, green, blue

    def tree(self, origin, direction, pixel, sample):
        """The colour of an eye ray: walks its tree by the job's method (WLK-1)."""
        self.sample = pixel, sample
        return self.walk.colour(self.visit, (origin, direction, self.scene.media.eye, 0))

    def visit(self, ray, order, weight=None):
        """Returns the ray's own colour and the rays that it spawns: pairs (weight by channel, ray) (REF-4).

        A ray is origin, direction, the set of solids that it is in, and its path (RND-4). `weight` is what it counts
        for in its sample, by channel; only a cut-off asks for it.
        """
        scene = self.scene
        origin, direction, inside, path = ray
        hit = first_hit(scene, origin, direction, math.inf)
        if scene.contact is not None:
            hit, dimmed = self.settle(hit, direction, inside)
        if hit is None:
            return scene.background, ()
        t, point, normal, shape = hit
        lights = self.lights
        if self.feelers:
            draw = partial(self.random.feeler, self.sample, order, path)
            lights = spread(scene.lights, self.feelers, draw, self.number)
        colour = self.local(scene, lights, direction, point, normal, shape, self.shadows, self.counts)
        last = order == self.depth
        if last and not self.attenuates:
            return colour, ()
        d_dot_n = dot(direction, normal)
        if shape.sets is None:
            here, beyond, i, o = scene.media.sides(inside, shape, d_dot_n <= 0)
        else:
            (here, beyond), i, o = shape.sets, shape.i, shape.o
        factor = None if i.attenuation is None else tuple(a**t for a in i.attenuation)  # ATT-1
        if scene.contact is not None:
            factor = dim(factor, dimmed)
        if factor is not None:
            ar, ag, ab = factor
            colour = colour[0] * ar, colour[1] * ag, colour[2] * ab
            if self.cuts:
                weight = weight[0] * ar, weight[1] * ag, weight[2] * ab
        if last:
            return colour, ()
        most = max(weight) if self.cuts else None
        children = self.children(ray, order, point, normal, d_dot_n, shape, here, beyond, i, o, most)
        if factor is not None:
            return colour, [((share * ar, share * ag, share * ab), child) for share, child in children]
        return colour, [((share, share, share), child) for share, child in children]

    def settle(self, hit, direction, inside):
        """The hit of a ray in the set `inside` with the Place that it is in (MED-7), beyond all that is no surface, and
        the factor of light on the way there, None where that is 1 (MED-8).
        """
        scene, dimmed = self.scene, None
        while hit is not None:
            t, point, normal, shape = hit
            point, normal, place = scene.contact.meet(inside, direction, point, normal, shape)
            if not place.none:
                return (t, point, normal, place), dimmed
            if place.i.attenuation is not None:
                dimmed = dim(dimmed, tuple(a**t for a in place.i.attenuation))
            start = scene.leave(point, normal, place.size, 1 if dot(direction, normal) > 0 else -1)
            inside = place.sets[1]
            hit = first_hit(scene, start, direction, math.inf)
        return None, None

    def children(self, ray, order, point, normal, d_dot_n, shape, here, beyond, i, o, weight):
        """The reflected and transmitted rays of a hit, as pairs (weight, ray) (REF-4, MED-5).

        The ray was in the set `here` and its medium `i`; on the other side are the set `beyond` and the medium `o`.
        `weight` is what the hit counts for in the sample, in the channel where that is most; None without a cut-off.
        """
        sqrt, counts = self.number.sqrt, self.counts
        material, leave = shape.material, self.scene.leave
        _, direction, _, path = ray
        n, m = i.n / o.n, i.mu_r / o.mu_r
        r = self.fresnel(n, m, d_dot_n, sqrt)
        side = 1 if d_dot_n <= 0 else -1
        first_child = path * self.children_of_path + 1
        children = []
        share = material.k_s * r
        rough = self.glossy_rays and material.rough
        if share != 0 and (rough or not self.cut(weight, share)):
            start = leave(point, normal, shape.size, side)
            mirrored = self.reflect(direction, normal, d_dot_n, sqrt)
            if rough:
                rays, draw = self.glossy_rays, partial(self.random.lobe, self.sample, order, path)
                shape_of_lobe = material.lobe, rays, self.weigh, draw, self.unit, self.number
                lobe = gloss(mirrored, normal, *shape_of_lobe)
                for child, (away, w) in enumerate(lobe):
                    part = share * w / rays
                    if part != 0 and not self.cut(weight, part):
                        children.append((part, (start, away, here, first_child + child)))
            else:
                children.append((share, (start, mirrored, here, first_child)))
            counts.reflected += len(children)
        if material.clear:
            share = material.k_s * (1 - r)
            if share != 0 and not self.cut(weight, share):
                counts.transmitted += 1
                start = leave(point, normal, shape.size, -side)
                onward = direction
                if not (shape.flat or (n == 1 and m == 1)):
                    s = self.beyond(n, d_dot_n, sqrt)
                    onward = transmit(direction, normal, d_dot_n, n, s, self.unit, sqrt)
                children.append((share, (start, onward, beyond, first_child + self.children_of_path - 1)))
        return children

    def cut(self, weight, share):
        """Whether to cut off a ray with this share of a hit of this weight; notes the weight if so (CUT-1, CUT-2)."""
        if not self.cuts or not weight * share <= self.cutoff:
            return False
        self.dropped += weight * share
        return True


def dim(factor, other):
    """The product of two factors of light, by channel, of which either may be None for 1."""
    if factor is None or other is None:
        return other if factor is None else factor
    return tuple(a * b for a, b in zip(factor, other, strict=True))
