// Triangle of a mesh: three vertices, its normal and size, and 1 if the mesh is closed.

enum { TRIANGLE_NORMAL = 9, TRIANGLE_SIZE = 12, TRIANGLE_CLOSED = 13 };

// TRI-1: the frame in which a ray starts at the origin and runs along z. The same for all triangles.
typedef struct {
    int kx, ky, kz;
    real x, y, z;     // of the ray's origin, along those axes
    real sx, sy, sz;
} Shear;

DEVICE real component(real3 a, int axis) { return axis == 0 ? a.x : axis == 1 ? a.y : a.z; }

DEVICE Shear shear_of(Ray ray)
{
    const real3 d = ray.direction;
    Shear shear;
    shear.kz = fabs(d.y) > fabs(d.x) ? 1 : 0;
    if (fabs(d.z) > fabs(component(d, shear.kz)))
        shear.kz = 2;
    const real along = component(d, shear.kz);
    const int first = (shear.kz + 1) % 3, second = (shear.kz + 2) % 3;
    shear.kx = along < 0 ? second : first;
    shear.ky = along < 0 ? first : second;
    shear.x = component(ray.origin, shear.kx), shear.y = component(ray.origin, shear.ky);
    shear.z = component(ray.origin, shear.kz);
    shear.sx = component(d, shear.kx) / along, shear.sy = component(d, shear.ky) / along, shear.sz = 1 / along;
    return shear;
}

// What the ray's line has to do with a triangle, in the sheared frame.
typedef struct {
    real x[3], y[3], z[3], u, v, w;
} Sheared;

// The vertices of a triangle along the axes of that frame, in whatever address space it is.
#define VERTEX_OF(vertex, shear) R3((vertex)[(shear)->kx], (vertex)[(shear)->ky], (vertex)[(shear)->kz])
#define VERTICES_OF(triangle, shear)                                                                                   \
    VERTEX_OF(triangle, shear), VERTEX_OF((triangle) + 3, shear), VERTEX_OF((triangle) + 6, shear)

DEVICE Sheared sheared(real3 v0, real3 v1, real3 v2, const Shear *shear)
{
    const real3 vertices[3] = {v0, v1, v2};
    Sheared s;
    for (int i = 0; i < 3; i++) {
        const real along = vertices[i].z - shear->z;
        s.x[i] = vertices[i].x - shear->x - shear->sx * along;
        s.y[i] = vertices[i].y - shear->y - shear->sy * along;
        s.z[i] = along;
    }
    s.u = s.x[2] * s.y[1] - s.y[2] * s.x[1];
    s.v = s.x[0] * s.y[2] - s.y[0] * s.x[2];
    s.w = s.x[1] * s.y[0] - s.y[1] * s.x[0];
    return s;
}

// a b - c d after Kahan: its sign is always right, whatever the compiler fuses.
DEVICE real difference_of_products(real a, real b, real c, real d)
{
    const real w = c * d;
    return fma(a, b, -w) + fma(-c, d, w);
}

DEVICE real sheared_t(const Sheared *s, const Shear *shear)
{
    return (s->u * (shear->sz * s->z[0]) + s->v * (shear->sz * s->z[1]) + s->w * (shear->sz * s->z[2])) /
           (s->u + s->v + s->w);
}

DEVICE real moller_trumbore(TILE const real *triangle, Ray ray)
{
    const real3 v0 = LOAD3(triangle), e = LOAD3(triangle + 3) - v0, f = LOAD3(triangle + 6) - v0;
    const real3 p = cross3(ray.direction, f);
    const real det = dot3(e, p);
    if (det == 0)
        return 0;
    const real3 s = ray.origin - v0;
    const real u = dot3(s, p) / det;
    if (!(u >= 0))
        return 0;
    const real3 q = cross3(s, e);
    const real v = dot3(ray.direction, q) / det;
    if (!(v >= 0 && u + v <= 1))
        return 0;
    return dot3(f, q) / det;
}

// TRI-1, TRI-3
DEVICE real triangle_distance(TILE const real *triangle, Ray ray, const Shear *shear)
{
#ifdef TRIANGLE_MOLLER_TRUMBORE
    return moller_trumbore(triangle, ray);
#else
    Sheared s = sheared(VERTICES_OF(triangle, shear), shear);
#ifdef TRIANGLE_WATERTIGHT_KAHAN
    s.u = difference_of_products(s.x[2], s.y[1], s.y[2], s.x[1]);
    s.v = difference_of_products(s.x[0], s.y[2], s.y[0], s.x[2]);
    s.w = difference_of_products(s.x[1], s.y[0], s.y[1], s.x[0]);
#endif
    if (!((s.u >= 0 && s.v >= 0 && s.w >= 0) || (s.u <= 0 && s.v <= 0 && s.w <= 0)) || s.u + s.v + s.w == 0)
        return 0;
    return sheared_t(&s, shear);
#endif
}

// CSG-2: an area counts as positive, or, if it is 0, by the direction of its edge.
DEVICE bool counts_as_positive(const Sheared *s, real area, int from, int to)
{
    const real x = s->x[to] - s->x[from], y = s->y[to] - s->y[from];
    return area != 0 ? area > 0 : y > 0 || (y == 0 && x > 0);
}

// CSG-2: does the line cross? If so, at t. Of two triangles with an edge that it meets, exactly one is crossed.
DEVICE bool triangle_crossed(SCENE const real *triangle, const Shear *shear, real *t)
{
    const Sheared s = sheared(VERTICES_OF(triangle, shear), shear);
    const bool side = counts_as_positive(&s, s.u, 1, 2);
    if (counts_as_positive(&s, s.v, 2, 0) != side || counts_as_positive(&s, s.w, 0, 1) != side)
        return false;
    if (!(fabs(s.u + s.v + s.w) > 0))  // NUM-5: a NaN is no crossing
        return false;
    *t = sheared_t(&s, shear);
    return true;
}

// TRI-2
DEVICE Surface triangle_surface(SCENE const real *triangle, Ray ray, real t)
{
    const real3 normal = LOAD3(triangle + TRIANGLE_NORMAL), p = ray.origin + t * ray.direction;
    const bool turn = triangle[TRIANGLE_CLOSED] == 0 && !(dot3(ray.direction, normal) < 0);
    return surface_at(p - dot3(p - LOAD3(triangle), normal) * normal, turn ? -normal : normal, triangle[TRIANGLE_SIZE]);
}
