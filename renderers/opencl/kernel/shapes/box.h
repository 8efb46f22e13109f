// Box: a corner, three edges at any angle, their reciprocal vectors, the normals of its sides, and its size.

enum { BOX_EDGE = 3, BOX_RECIPROCAL = 12, BOX_NORMAL = 21, BOX_SIZE = 30 };

// What a span needs of a box, in whatever address space it is.
#define SIDES_OF(box)                                                                                                  \
    LOAD3(box), LOAD3((box) + BOX_RECIPROCAL), LOAD3((box) + BOX_RECIPROCAL + 3), LOAD3((box) + BOX_RECIPROCAL + 6)

// What a line has in common with a box: from t0, through side `in`, to t1, through side `out`. Sides are 2 axis + high.
typedef struct {
    real t0, t1;
    int in, out;
} Span;

// BOX-1. A line that runs beside the box spans from infinity to -infinity, which is no span.
DEVICE Span box_span(real3 corner, real3 g0, real3 g1, real3 g2, Ray ray)
{
    const real3 f = ray.origin - corner, reciprocal[3] = {g0, g1, g2};
    Span span;
    span.t0 = -FAR, span.t1 = FAR, span.in = span.out = 0;
    for (int a = 0; a < 3; a++) {
        const real3 g = reciprocal[a];
        const real s = dot3(g, f), w = dot3(g, ray.direction);
        if (w == 0) {
            if (!(s >= 0 && s <= 1)) {
                span.t0 = FAR, span.t1 = -FAR;
                return span;
            }
            continue;
        }
        const int high = w < 0;  // the side it comes in through
        const real enter = (high - s) / w, leave = (1 - high - s) / w;
        if (enter > span.t0)
            span.t0 = enter, span.in = 2 * a + high;
        if (leave < span.t1)
            span.t1 = leave, span.out = 2 * a + 1 - high;
    }
    return span;
}

// BOX-3, as it is often written. 0 * infinity is NaN, which sets a bound or none by the order of the arguments.
DEVICE Span plain_box_span(real3 corner, real3 g0, real3 g1, real3 g2, Ray ray)
{
    const real3 f = ray.origin - corner, reciprocal[3] = {g0, g1, g2};
    Span span;
    span.t0 = -FAR, span.t1 = FAR, span.in = span.out = 0;
    for (int a = 0; a < 3; a++) {
        const real3 g = reciprocal[a];
        const real s = dot3(g, f), w = dot3(g, ray.direction), i = 1 / w, x = (0 - s) * i, y = (1 - s) * i;
        const real near = least(x, y), far = most(x, y);
        const int high = w < 0;
        if (span.t0 < near)
            span.t0 = near, span.in = 2 * a + high;
        if (far < span.t1)
            span.t1 = far, span.out = 2 * a + 1 - high;
    }
    return span;
}

// Parts of solids keep BOX-1 (BOX-3).
#ifdef SLAB_PLAIN
#define OWN_BOX_SPAN plain_box_span
#else
#define OWN_BOX_SPAN box_span
#endif

DEVICE real box_distance(TILE const real *box, Ray ray)
{
    const Span span = OWN_BOX_SPAN(SIDES_OF(box), ray);
    if (!(span.t0 <= span.t1))
        return 0;
    return span.t0 > 0 ? span.t0 : span.t1;
}

// BOX-2
DEVICE Surface side_of_box(SCENE const real *box, Ray ray, real t, int side)
{
    const int axis = side / 2, high = side % 2;
    const real3 corner = LOAD3(box), out = LOAD3(box + BOX_NORMAL + 3 * axis);
    const real3 n = high ? out : -out, q = high ? corner + LOAD3(box + BOX_EDGE + 3 * axis) : corner;
    const real3 p = ray.origin + t * ray.direction;
    return surface_at(p - dot3(p - q, n) * n, n, box[BOX_SIZE]);
}

DEVICE Surface box_surface(SCENE const real *box, Ray ray, real t)
{
    const Span span = OWN_BOX_SPAN(SIDES_OF(box), ray);
    return side_of_box(box, ray, t, span.t0 > 0 ? span.in : span.out);
}
