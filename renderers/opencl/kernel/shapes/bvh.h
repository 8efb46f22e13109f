// A bounding-volume hierarchy (HIT-6): boxes along the axes, each with its first child, which the second follows, and 0;
// or, a leaf, the first of its items and their number. Built by the host (bvh.py).

#define ROUNDING 64      // what rounding can do to a hit, of EPSILON: boxes are padded by it at load, the ray's origin here
#define TREE_DEPTH 64    // nodes that can wait

// How a ray meets boxes: 1/d, which side it meets first, and its origin as measured from that side and from the other.
typedef struct {
    real inverse[3], near[3], far[3];
    int low[3];
} Slabs;

DEVICE Slabs slabs_of(Ray ray)
{
    const real pad = ROUNDING * EPSILON * largest(ray.origin);
    Slabs slabs;
    for (int a = 0; a < 3; a++) {
        const real inverse = 1 / component(ray.direction, a), origin = component(ray.origin, a);
        const real outward = inverse < 0 ? -pad : pad;
        slabs.inverse[a] = inverse, slabs.low[a] = inverse < 0 ? 3 : 0;
        slabs.near[a] = origin + outward, slabs.far[a] = origin - outward;
    }
    return slabs;
}

// Where the ray enters a box between `from` and `to`; FAR if it does not. 0 * infinity, on the plane of a side along the
// ray, is NaN and sets no bound.
DEVICE real enter(SCENE const real *box, const Slabs *slabs, real from, real to)
{
    for (int a = 0; a < 3; a++) {
        const real in = (box[slabs->low[a] + a] - slabs->near[a]) * slabs->inverse[a];
        const real out = (box[3 - slabs->low[a] + a] - slabs->far[a]) * slabs->inverse[a];
        from = in > from ? in : from;
        to = out < to ? out : to;
    }
    return from <= to ? from : FAR;
}
