// Polygon: its normal and size; of each corner, the place and a vector inward, in the plane and at right angles to the
// edge that begins there.

#define GRAZING ((real)1 / 1024)  // |w| of POL-1 below which rounding can move t past the polygon

#ifdef TRIANGLE_MOLLER_TRUMBORE

// POL-1, POL-4. corners: of this polygon, as many as `count`.
DEVICE real polygon_distance(TILE const real *polygon, TILE const real *corners, int count, Ray ray, const Shear *shear)
{
    const real3 normal = LOAD3(polygon);
    const real w = dot3(ray.direction, normal);
    if (w == 0)
        return 0;
    const real t = dot3(LOAD3(corners) - ray.origin, normal) / w;
    if (!(t > 0))
        return 0;
    const real3 p = ray.origin + t * ray.direction;
    for (int i = 0; i < count; i++)
        if (!(dot3(LOAD3(corners + CORNER * i + 3), p - LOAD3(corners + CORNER * i)) >= 0))
            return 0;
    return t;
}

#else

DEVICE real3 place_of(real3 vertex, const Shear *shear)
{
    const real along = vertex.z - shear->z;
    return R3(vertex.x - shear->x - shear->sx * along, vertex.y - shear->y - shear->sy * along, along);
}

DEVICE real edge_function(real3 a, real3 b)
{
#ifdef TRIANGLE_WATERTIGHT_KAHAN
    return difference_of_products(a.x, b.y, a.y, b.x);
#else
    return a.x * b.y - a.y * b.x;
#endif
}

// POL-2: does the line cross a triangle between the first vertex and an edge? If so, at t, by TRI-1.
DEVICE bool fan_crossed(TILE const real *corners, int count, const Shear *shear, real *t)
{
    const real3 a = place_of(VERTEX_OF(corners, shear), shear);
    real3 b = place_of(VERTEX_OF(corners + CORNER, shear), shear);
    real w = edge_function(a, b);
    for (int i = 2; i < count; i++) {
        const real3 c = place_of(VERTEX_OF(corners + CORNER * i, shear), shear);
        const real u = edge_function(b, c), v = edge_function(c, a);
        if (((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0)) && u + v + w != 0) {
            *t = (u * (shear->sz * a.z) + v * (shear->sz * b.z) + w * (shear->sz * c.z)) / (u + v + w);
            return true;
        }
        w = -v, b = c;
    }
    return false;
}

// POL-1, POL-2. corners: of this polygon, as many as `count`.
DEVICE real polygon_distance(TILE const real *polygon, TILE const real *corners, int count, Ray ray, const Shear *shear)
{
    const real3 normal = LOAD3(polygon);
    const real w = dot3(ray.direction, normal);
    if (w == 0)
        return 0;
    const real3 vertex = LOAD3(corners);
    const real height = dot3(vertex - ray.origin, normal), t = height / w;
    const bool grazes = fabs(w) < GRAZING;
    real crossing;
    if (!((grazes || t > 0) && fan_crossed(corners, count, shear, &crossing)))
        return 0;
    const real rounding = 4 * EPSILON *
                          (fabs(normal.x) * (fabs(vertex.x) + fabs(ray.origin.x)) +
                           fabs(normal.y) * (fabs(vertex.y) + fabs(ray.origin.y)) +
                           fabs(normal.z) * (fabs(vertex.z) + fabs(ray.origin.z)));
    return fabs(height) <= rounding ? 0 : grazes ? crossing : t;
}

#endif

// POL-3
DEVICE Surface polygon_surface(SCENE const real *polygon, SCENE const real *corners, Ray ray, real t)
{
    const real3 normal = LOAD3(polygon), p = ray.origin + t * ray.direction;
    return surface_at(p - dot3(p - LOAD3(corners), normal) * normal, dot3(ray.direction, normal) < 0 ? normal : -normal,
                      polygon[3]);
}
