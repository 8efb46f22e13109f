// What a surface does with light: which media it parts, Phong's highlight, and how much of a ray it reflects and
// transmits, and to where.

// MED-3, MED-4: the two sides of a surface that a ray meets: where it is, and where it would get to. Media are rows of
// the materials.
typedef struct {
    int i, t;
    ulong was, beyond;  // MED-2: sets of clear solids, a bit for each rank
} Sides;

#if NEED_MEDIA
DEVICE int medium(const Scene *scene, ulong inside)
{
    return inside ? scene->integers[scene->at.media_at + HIGHEST_BIT(inside)] : scene->at.air;
}
#endif

DEVICE Sides sides_of(const Scene *scene, ulong inside, int material, int rank, bool enters)
{
    Sides sides;
    sides.was = sides.beyond = inside;
    int outer = scene->at.air, inner = material;
#if NEED_MEDIA
    outer = medium(scene, inside);
    if (rank >= 0) {
        const ulong solid = (ulong)1 << rank, without = inside & ~solid, with = inside | solid;
        outer = medium(scene, without), inner = medium(scene, with);
        sides.was = enters ? without : with, sides.beyond = enters ? with : without;
    }
#endif
    sides.i = enters ? outer : inner, sides.t = enters ? inner : outer;
    return sides;
}

// REF-1: N = n_i / n_t and M = mu_i / mu_t between the two sides of a surface.
typedef struct {
    real n, m;
    bool matched;  // the surface is not there
} Interface;

DEVICE Interface interface_of(const Scene *scene, Sides sides)
{
    SCENE const real *i = scene->numbers + scene->at.materials_at + MATERIAL * sides.i;
    SCENE const real *t = scene->numbers + scene->at.materials_at + MATERIAL * sides.t;
    Interface interface;
    interface.n = i[INDEX] / t[INDEX], interface.m = i[MU] / t[MU];
    interface.matched = i[INDEX] == t[INDEX] && i[MU] == t[MU];  // a fast quotient of equals need not be 1
    return interface;
}

// LOC-4: k_s cos^m, for a ray that arrives along `d` and a light that is seen along `l`.
DEVICE real highlight(SCENE const real *material, real3 d, real3 n, real3 l, real n_l)
{
    const real c = -dot3(2 * n_l * n - l, d);
#ifdef PHONG_UNCLAMPED
    return material[SPECULAR] * pow(c, material[EXPONENT]);
#else
    return c > 0 ? material[SPECULAR] * pow(least(c, 1), material[EXPONENT]) : 0;
#endif
}

typedef struct {
    real reflected, s;  // R, and the s of TRA-1, unless R is 1
} Fresnel;

// REF-2
DEVICE Fresnel fresnel(Interface side, real cosine)
{
    Fresnel part;
    part.reflected = 0, part.s = 0;
    if (side.matched)
        return part;
#ifdef FRESNEL_UNCLAMPED
    const real c = cosine, x = 1 - side.n * side.n * (1 - c * c);
#else
    const real c = least(1, cosine), x = 1 - side.n * side.n * (1 - c * c);
    if (x <= 0) {
        part.reflected = 1;
        return part;
    }
#endif
    part.s = sqrt(x);
    const real a = (side.n * c - side.m * part.s) / (side.n * c + side.m * part.s);
    const real b = (side.m * c - side.n * part.s) / (side.m * c + side.n * part.s);
    part.reflected = (a * a + b * b) / 2;
    return part;
}

// TRA-1, at a surface that bounds a solid.
DEVICE real3 transmit(Interface side, real s, real3 d, real3 n, real d_n)
{
    if (side.matched)
        return d;
    const real g = d_n <= 0 ? -s : s;
    return renormalise(side.n * d + (g - side.n * d_n) * n);
}

// SOF-2. Here and below angles are in half turns: for cos and sin of any float NVIDIA's compiler needs float64.
DEVICE real3 on_unit_sphere(Uniform draw)
{
    const real z = 1 - 2 * draw.u[0], w = sqrt(most(0, 1 - z * z)), turn = 2 * draw.u[1];
    return R3(w * cospi(turn), w * sinpi(turn), z);
}

// GLO-2: a direction around the mirrored one, and its z, the cosine of the angle between them.
typedef struct {
    real3 direction;
    real z;
} Lobe;

DEVICE Lobe glossy(real3 r, real3 n, real exponent, Uniform draw)
{
    const real sigma = r.z >= 0 ? R(1) : R(-1), a = -1 / (sigma + r.z), b = r.x * r.y * a;  // GLO-3
    const real3 p = R3(1 + sigma * r.x * r.x * a, sigma * b, -sigma * r.x);
    const real3 q = R3(b, sigma + r.y * r.y * a, -r.y);
    const real w = sqrt(-expm1(2 * log(1 - draw.u[0]) / (exponent + 1)));
    const real turn = 2 * draw.u[1], x = w * cospi(turn), y = w * sinpi(turn);
    Lobe lobe;
    lobe.z = pow(1 - draw.u[0], 1 / (exponent + 1));
    lobe.direction = renormalise(x * p + y * q + lobe.z * r);
    if ((dot3(lobe.direction, n) > 0) != (dot3(r, n) > 0))
        lobe.direction = renormalise(lobe.z * r - x * p - y * q);
    return lobe;
}
