// The search for what a ray hits, among all shapes.

// What a thread has of its own while it works out a sample.
typedef struct {
    ulong reflected, transmitted, shadow, primary, non_finite;  // CNT-1, CNT-2
#if NEED_CSG
    Scratch scratch;
#endif
    Draws draws;
    real dropped;          // CUT-2: of this pixel's samples so far
    GLOBAL uchar *memory;  // of this thread, for walks that have rows, and for the lattice of `adaptive`
} Desk;

// Shapes are numbered through all kinds in the order of HIT-2; -1 is none.
typedef struct {
    real t;
    int shape;
} Hit;

// A ray with what its tests take along.
typedef struct {
    Ray ray;
#if NEED_MESH
    Shear shear;
#endif
} Probe;

DEVICE Probe probe_of(Ray ray)
{
    Probe probe;
    probe.ray = ray;
#if NEED_MESH
    probe.shear = shear_of(ray);
#endif
    return probe;
}

// The tests of one kind, for the loop over it and for a shape by its number.
#define SPHERE_T(i) sphere_distance(scene->numbers + scene->at.spheres_at + SPHERE * (i), probe->ray)
#define BOX_T(i) box_distance(scene->numbers + scene->at.boxes_at + BOX * (i), probe->ray)
#define RANGE(i) (scene->integers + scene->at.polygon_ranges_at + 2 * (i))
#define CORNERS(i) (scene->numbers + scene->at.corners_at + CORNER * RANGE(i)[0])
#define POLYGON_OF(i) (scene->numbers + scene->at.polygons_at + POLYGON * (i))
#define POLYGON_T(i) polygon_distance(POLYGON_OF(i), CORNERS(i), RANGE(i)[1], probe->ray)
#define ELLIPSOID_T(i) ellipsoid_distance(scene->numbers + scene->at.ellipsoids_at + ELLIPSOID * (i), probe->ray)
#define TRIANGLE_T(i) triangle_distance(scene->numbers + scene->at.triangles_at + TRIANGLE * (i), probe->ray, &probe->shear)
#define SOLID_T(i) solid_distance(scene, &desk->scratch, probe->ray, i)

DEVICE real distance_to(const Scene *scene, const Probe *probe, Desk *desk, int shape)
{
#if NEED_SPHERE
    if (shape < scene->at.spheres)
        return SPHERE_T(shape);
    shape -= scene->at.spheres;
#endif
#if NEED_BOX
    if (shape < scene->at.boxes)
        return BOX_T(shape);
    shape -= scene->at.boxes;
#endif
#if NEED_POLYGON
    if (shape < scene->at.polygons)
        return POLYGON_T(shape);
    shape -= scene->at.polygons;
#endif
#if NEED_ELLIPSOID
    if (shape < scene->at.ellipsoids)
        return ELLIPSOID_T(shape);
    shape -= scene->at.ellipsoids;
#endif
#if NEED_MESH
    if (shape < scene->at.triangles)
        return TRIANGLE_T(shape);
    shape -= scene->at.triangles;
#endif
#if NEED_CSG
    return SOLID_T(shape);
#else
    return 0;
#endif
}

#if TREE

// HIT-6: of equal t the first in the order of HIT-2, in whatever order they come. True if the search can end.
DEVICE bool look_at(const Scene *scene, const Probe *probe, Desk *desk, int shape, bool any, Hit *hit)
{
    const real t = distance_to(scene, probe, desk, shape);
    if (!(t > 0 && (t < hit->t || (t == hit->t && !any && shape < hit->shape))))
        return false;
    hit->t = t, hit->shape = shape;
    return any;
}

// The hit that is nearest, or any one, before `limit` (HIT-1, HIT-5).
DEVICE Hit search(const Scene *scene, Ray ray, Desk *desk, real limit, bool any)
{
    SCENE const real *boxes = scene->numbers + scene->at.tree_at;
    SCENE const int *links = scene->integers + scene->at.links_at, *items = scene->integers + scene->at.items_at;
    const Probe probe = probe_of(ray);
    const Slabs slabs = slabs_of(ray);
    Hit hit;
    hit.t = limit, hit.shape = -1;
    for (int i = 0; i < scene->at.loose; i++)
        if (look_at(scene, &probe, desk, scene->integers[scene->at.loose_at + i], any, &hit))
            return hit;
    int waiting[TREE_DEPTH], count = 0, node = 0;
    real entries[TREE_DEPTH];
    if (scene->at.in_tree == 0 || !(enter(boxes, &slabs, 0, hit.t) < FAR))
        return hit;
    for (;;) {
        const int link = links[2 * node], leaf = links[2 * node + 1];
        if (leaf == 0) {
            int near = link, far = link + 1;
            real t_near = enter(boxes + NODE * near, &slabs, 0, hit.t), t_far = enter(boxes + NODE * far, &slabs, 0, hit.t);
            if (t_far < t_near) {
                const real t = t_near;
                t_near = t_far, t_far = t, near = link + 1, far = link;
            }
            if (t_far < FAR)
                entries[count] = t_far, waiting[count++] = far;
            if (t_near < FAR) {
                node = near;
                continue;
            }
        }
        for (int i = link; i < link + leaf; i++)
            if (look_at(scene, &probe, desk, items[i], any, &hit))
                return hit;
        do {
            if (count == 0)
                return hit;
            count--;
        } while (!(entries[count] <= hit.t));
        node = waiting[count];
    }
}

#else

// Every shape of a kind, in order.
#define TRY_ALL(shapes, T)                                                                                             \
    for (int i = 0; i < scene->at.shapes; i++) {                                                                       \
        const real t = T(i);                                                                                           \
        if (t > 0 && t < hit.t) {                                                                                      \
            hit.t = t, hit.shape = before + i;                                                                         \
            if (any)                                                                                                   \
                return hit;                                                                                            \
        }                                                                                                              \
    }                                                                                                                  \
    before += scene->at.shapes;

// The hit that is nearest, or any one, before `limit` (HIT-1, HIT-5).
DEVICE Hit search(const Scene *scene, Ray ray, Desk *desk, real limit, bool any)
{
    const Probe every = probe_of(ray), *probe = &every;
    int before = 0;
    Hit hit;
    hit.t = limit, hit.shape = -1;
#if NEED_SPHERE
    TRY_ALL(spheres, SPHERE_T)
#endif
#if NEED_BOX
    TRY_ALL(boxes, BOX_T)
#endif
#if NEED_POLYGON
    TRY_ALL(polygons, POLYGON_T)
#endif
#if NEED_ELLIPSOID
    TRY_ALL(ellipsoids, ELLIPSOID_T)
#endif
#if NEED_MESH
    TRY_ALL(triangles, TRIANGLE_T)
#endif
#if NEED_CSG
    TRY_ALL(solids, SOLID_T)
#endif
    return hit;
}

#endif

DEVICE Surface surface_of(const Scene *scene, Ray ray, Desk *desk, Hit hit)
{
    int shape = hit.shape;
#if NEED_SPHERE
    if (shape < scene->at.spheres)
        return sphere_surface(scene->numbers + scene->at.spheres_at + SPHERE * shape, ray, hit.t);
    shape -= scene->at.spheres;
#endif
#if NEED_BOX
    if (shape < scene->at.boxes)
        return box_surface(scene->numbers + scene->at.boxes_at + BOX * shape, ray, hit.t);
    shape -= scene->at.boxes;
#endif
#if NEED_POLYGON
    if (shape < scene->at.polygons)
        return polygon_surface(POLYGON_OF(shape), CORNERS(shape), ray, hit.t);
    shape -= scene->at.polygons;
#endif
#if NEED_ELLIPSOID
    if (shape < scene->at.ellipsoids)
        return ellipsoid_surface(scene->numbers + scene->at.ellipsoids_at + ELLIPSOID * shape, ray, hit.t);
    shape -= scene->at.ellipsoids;
#endif
#if NEED_MESH
    if (shape < scene->at.triangles)
        return triangle_surface(scene->numbers + scene->at.triangles_at + TRIANGLE * shape, ray, hit.t);
    shape -= scene->at.triangles;
#endif
#if NEED_CSG
    return solid_surface(scene, &desk->scratch, ray, shape);
#else
    return surface_at(ray.origin, ray.direction, 0);  // no shape has this number
#endif
}
