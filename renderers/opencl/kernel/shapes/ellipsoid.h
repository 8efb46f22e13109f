// Ellipsoid: centre, three semi-axes at any angle, their reciprocal vectors, and its size. The unit sphere, mapped.

enum { ELLIPSOID_AXIS = 3, ELLIPSOID_RECIPROCAL = 12, ELLIPSOID_SIZE = 21 };

// An ellipsoid's reciprocal vectors, in whatever address space it is.
#define RECIPROCALS_OF(ellipsoid)                                                                                      \
    LOAD3((ellipsoid) + ELLIPSOID_RECIPROCAL), LOAD3((ellipsoid) + ELLIPSOID_RECIPROCAL + 3),                          \
        LOAD3((ellipsoid) + ELLIPSOID_RECIPROCAL + 6)

DEVICE real3 to_unit_sphere(real3 g0, real3 g1, real3 g2, real3 a) { return R3(dot3(g0, a), dot3(g1, a), dot3(g2, a)); }

// ELL-1, ELL-3
DEVICE real ellipsoid_distance(TILE const real *ellipsoid, Ray ray)
{
    const real3 f = to_unit_sphere(RECIPROCALS_OF(ellipsoid), ray.origin - LOAD3(ellipsoid));
    const real3 d = to_unit_sphere(RECIPROCALS_OF(ellipsoid), ray.direction);
#if defined(SPHERE_TEXTBOOK) || defined(SPHERE_STABLE)
    return first_root(dot3(d, d), 2 * dot3(f, d), dot3(f, f) - 1);
#else
    const real a = dot3(d, d), b = -dot3(f, d);
    const real3 l = f + (b / a) * d;
    const real delta = 1 - dot3(l, l);
    if (delta < 0)
        return 0;
    const real k = dot3(f, f) - 1, s = sqrt(a * delta);
    if (k > 0)
        return b > 0 ? k / (b + s) : 0;
    return b >= 0 ? (b + s) / a : k / (b - s);
#endif
}

// CSG-1: where the line goes in and out.
DEVICE bool ellipsoid_crossed(SCENE const real *ellipsoid, Ray ray, real *in, real *out)
{
    const real3 f = to_unit_sphere(RECIPROCALS_OF(ellipsoid), ray.origin - LOAD3(ellipsoid));
    const real3 d = to_unit_sphere(RECIPROCALS_OF(ellipsoid), ray.direction);
    const real a = dot3(d, d), b = -dot3(f, d);
    const real3 l = f + (b / a) * d;
    const real delta = 1 - dot3(l, l);
    if (!(delta >= 0))
        return false;
    const real k = dot3(f, f) - 1, s = sqrt(a * delta);
    if (b >= 0)
        *in = b + s == 0 ? 0 : k / (b + s), *out = (b + s) / a;
    else
        *in = (b - s) / a, *out = k / (b - s);
    return true;
}

// ELL-2
DEVICE Surface ellipsoid_surface(SCENE const real *ellipsoid, Ray ray, real t)
{
    SCENE const real *axis = ellipsoid + ELLIPSOID_AXIS, *g = ellipsoid + ELLIPSOID_RECIPROCAL;
    const real3 centre = LOAD3(ellipsoid), f = to_unit_sphere(RECIPROCALS_OF(ellipsoid), ray.origin - centre);
    const real3 m = normalise3(f + t * to_unit_sphere(RECIPROCALS_OF(ellipsoid), ray.direction));
    const real3 n = normalise3(m.x * LOAD3(g) + m.y * LOAD3(g + 3) + m.z * LOAD3(g + 6));
    const real3 p = centre + m.x * LOAD3(axis) + m.y * LOAD3(axis + 3) + m.z * LOAD3(axis + 6);
    return surface_at(p, n, ellipsoid[ELLIPSOID_SIZE]);
}
