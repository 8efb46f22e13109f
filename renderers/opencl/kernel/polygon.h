// Polygon: its normal and size; of each corner, the place and a vector inward, in the plane and at right angles to the
// edge that begins there.

// POL-1, POL-2. corners: of this polygon, as many as `count`.
DEVICE real polygon_distance(TILE const real *polygon, TILE const real *corners, int count, Ray ray)
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

// POL-3
DEVICE Surface polygon_surface(SCENE const real *polygon, SCENE const real *corners, Ray ray, real t)
{
    const real3 normal = LOAD3(polygon), p = ray.origin + t * ray.direction;
    return surface_at(p - dot3(p - LOAD3(corners), normal) * normal, dot3(ray.direction, normal) < 0 ? normal : -normal,
                      polygon[3]);
}
