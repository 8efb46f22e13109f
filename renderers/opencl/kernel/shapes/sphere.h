// Sphere: centre, radius.

typedef struct {
    real value, error;
} Twofold;

// Knuth, The Art of Computer Programming 2, 4.2.2.
DEVICE Twofold twosum(real a, real b)
{
    Twofold sum;
    sum.value = a + b;
    const real z = sum.value - a;
    sum.error = (a - (sum.value - z)) + (b - z);
    return sum;
}

DEVICE Twofold twoproduct(real a, real b)
{
    Twofold product;
    product.value = a * b;
    product.error = fma(a, b, -product.value);
    return product;
}

// SPH-3: the roots of a t^2 + h t + k = 0 from their formula: the first that is > 0; anything not greater than 0 if none
// is.
DEVICE real first_root(real a, real h, real k)
{
    const real delta = h * h - 4 * a * k;
    if (delta < 0)
        return 0;
    const real root = sqrt(delta);
#ifdef SPHERE_TEXTBOOK  // the study's
    const real near = (-h - root) / (2 * a);
    return near > 0 ? near : (-h + root) / (2 * a);
#else  // of Numerical Recipes
    const real q = (h >= 0 ? h + root : h - root) / -2, t0 = q / a, t1 = k / q, near = least(t0, t1);
    return near > 0 ? near : most(t0, t1);
#endif
}

// SPH-1, the end of it.
DEVICE real nearest_of_sphere(real b, real k, real root)
{
    if (k > 0)
        return b > 0 ? k / (b + root) : 0;
    return b >= 0 ? b + root : k / (b - root);
}

DEVICE Twofold twofold_from_centre(Twofold f, real b, real d)
{
    const Twofold p = twoproduct(b, d), s = twosum(f.value, -p.value);
    Twofold m;
    m.value = s.value + (s.error - p.error + f.error), m.error = 0;
    return m;
}

// SPH-3: f, l and k in twice the digits, f and l of the other sign.
DEVICE real wide_sphere(TILE const real *sphere, Ray ray)
{
    const real3 c = LOAD3(sphere), o = ray.origin, d = ray.direction;
    const real radius = sphere[3], b = dot3(c - o, d);
    Twofold f[3];
    f[0] = twosum(c.x, -o.x), f[1] = twosum(c.y, -o.y), f[2] = twosum(c.z, -o.z);
    const real3 m = R3(twofold_from_centre(f[0], b, d.x).value, twofold_from_centre(f[1], b, d.y).value,
                       twofold_from_centre(f[2], b, d.z).value);
    const real3 l = m - dot3(m, d) * d;
    const real delta = radius * radius - dot3(l, l);
    if (!(delta >= 0))
        return 0;
    real k = 0, error = 0;
    for (int i = 0; i < 3; i++) {
        const Twofold h = twoproduct(f[i].value, f[i].value), s = twosum(k, h.value);
        k = s.value, error += s.error + h.error + 2 * f[i].value * f[i].error;
    }
    const Twofold h = twoproduct(radius, radius), s = twosum(k, -h.value);
    return nearest_of_sphere(b, s.value + (error + (s.error - h.error)), sqrt(delta));
}

// SPH-1. Of every shape, the t of the ray's first hit; anything not greater than 0, or NaN, is a miss (NUM-5).
DEVICE real sphere_distance(TILE const real *sphere, Ray ray)
{
#ifdef SPHERE_WIDE
    return wide_sphere(sphere, ray);
#else
    const real3 f = ray.origin - LOAD3(sphere);
    const real square = sphere[3] * sphere[3];
#if defined(SPHERE_TEXTBOOK) || defined(SPHERE_STABLE)
    return first_root(dot3(ray.direction, ray.direction), 2 * dot3(f, ray.direction), dot3(f, f) - square);
#else
    const real b = -dot3(f, ray.direction);
    const real3 l = f + b * ray.direction;
    const real delta = square - dot3(l, l);
    return delta < 0 ? 0 : nearest_of_sphere(b, dot3(f, f) - square, sqrt(delta));
#endif
#endif
}

// CSG-1: where the line goes in and out.
DEVICE bool sphere_crossed(SCENE const real *sphere, Ray ray, real *in, real *out)
{
    const real3 f = LOAD3(sphere) - ray.origin;
    const real square = sphere[3] * sphere[3], b = dot3(f, ray.direction);
    const real3 l = f - b * ray.direction;
    const real delta = square - dot3(l, l);
    if (!(delta >= 0))
        return false;
    const real k = dot3(f, f) - square, root = sqrt(delta);
    if (b >= 0)
        *out = b + root, *in = *out == 0 ? 0 : k / *out;
    else
        *in = b - root, *out = k / *in;
    return true;
}

// SPH-2
DEVICE Surface sphere_surface(SCENE const real *sphere, Ray ray, real t)
{
    const real3 centre = LOAD3(sphere), a = ray.origin + t * ray.direction - centre;
    const real radius = sphere[3];
#ifdef RENORMALISE_OFF  // NUM-4
    const real3 n = a / radius;
#else
    const real3 n = normalise3(a);
#endif
    return surface_at(centre + radius * n, n, radius);
}
