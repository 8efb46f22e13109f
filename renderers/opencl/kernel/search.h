// The search for what a ray hits, among all shapes.

// What a thread has of its own while it works out a sample.
typedef struct {
    ulong reflected, transmitted, shadow, primary, non_finite;  // CNT-1, CNT-2
#if NEED_CSG
    Scratch scratch;
#endif
    Draws draws;
    real dropped;          // CUT-2: of this pixel's samples so far
    bool there;            // whether it has a pixel at all; without one it keeps step with its group, or waits
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
#if NEED_POLYGON || NEED_MESH
    Shear shear;
#endif
} Probe;

DEVICE Probe probe_of(Ray ray)
{
    Probe probe;
    probe.ray = ray;
#if NEED_POLYGON || NEED_MESH
    probe.shear = shear_of(ray);
#endif
    return probe;
}

#define RANGE(i) (scene->integers + scene->at.polygon_ranges_at + 2 * (i))
#define CORNERS(i) (scene->numbers + scene->at.corners_at + CORNER * RANGE(i)[0])
#define POLYGON_OF(i) (scene->numbers + scene->at.polygons_at + POLYGON * (i))

// The tests of one kind: of a shape of the scene, or of the tile that begins with shape `first` and has `count`.
#if STREAMED
#define TRIED(kind, WIDTH, i) (scene->tile + WIDTH * (i))
#define TRIED_CORNERS(i) (scene->tile + POLYGON * count + CORNER * (RANGE(first + (i))[0] - RANGE(first)[0]))
#define TRIED_RANGE(i) RANGE(first + (i))
#else
#define TRIED(kind, WIDTH, i) (scene->numbers + scene->at.kind##_at + WIDTH * (i))
#define TRIED_CORNERS(i) CORNERS(i)
#define TRIED_RANGE(i) RANGE(i)
#endif
#define SPHERE_T(i) sphere_distance(TRIED(spheres, SPHERE, i), probe->ray)
#define BOX_T(i) box_distance(TRIED(boxes, BOX, i), probe->ray)
#define POLYGON_T(i)                                                                                                    \
    polygon_distance(TRIED(polygons, POLYGON, i), TRIED_CORNERS(i), TRIED_RANGE(i)[1], probe->ray, &probe->shear)
#define ELLIPSOID_T(i) ellipsoid_distance(TRIED(ellipsoids, ELLIPSOID, i), probe->ray)
#define TRIANGLE_T(i) triangle_distance(TRIED(triangles, TRIANGLE, i), probe->ray, &probe->shear)
#define SOLID_T(i) solid_distance(scene, &desk->scratch, probe->ray, i)

#if TREE || (NEED_CONTACT && !STREAMED)

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

#endif

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
DEVICE Hit search(const Scene *scene, Ray ray, Desk *desk, real limit, bool any, bool asks)
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

// Shapes of a kind, in order, by a thread that asks.
#define TRY(shapes, T)                                                                                                 \
    for (int i = 0; asks && i < (shapes); i++) {                                                                       \
        const real t = T(i);                                                                                           \
        if (t > 0 && t < hit.t)                                                                                        \
            hit.t = t, hit.shape = before + i, asks = !any;                                                            \
    }

#if STREAMED

// A scene that is too large for local memory comes there tile by tile, brought by the threads of a group together. One
// barrier stands before a tile is overwritten, as others may still read it, another after, as they may not yet. All
// threads of a group must come to each barrier, so they keep step: as long as one of them has a ray or asks for a shadow,
// the others search along, though they ask for nothing. No barrier stands in a branch, and a loop with barriers is
// entered without a test and left by one condition alone, or PoCL 3.1 compiles what follows once for each way.

// Does it hold for any thread of the group?
DEVICE bool any_of_group(SHARED int *vote, bool mine)
{
    BARRIER();
    if (RANK_IN_GROUP == 0)
        *vote = 0;
    BARRIER();
    if (mine)
        RAISE(vote);
    BARRIER();
    return *vote != 0;
}

enum { SPHERES, BOXES, POLYGONS, ELLIPSOIDS, TRIANGLES };  // kinds of shapes, in the order of HIT-2

DEVICE int shapes_of(const Scene *scene, int kind)
{
    return kind == SPHERES      ? scene->at.spheres
           : kind == BOXES      ? scene->at.boxes
           : kind == POLYGONS   ? scene->at.polygons
           : kind == ELLIPSOIDS ? scene->at.ellipsoids
                                : scene->at.triangles;
}

// Copies numbers to a place in the tile, one after the other among the threads of the group.
DEVICE void copy(SHARED real *tile, SCENE const real *numbers, int count)
{
    for (int k = RANK_IN_GROUP; k < count; k += THREADS)
        tile[k] = numbers[k];
}

// Fills the tile with polygons from `first` on, and then their corners; how many.
DEVICE int bring_polygons(const Scene *scene, int first)
{
    int count = 0, corners = 0;
    for (; first + count < scene->at.polygons; count++) {
        const int more = corners + RANGE(first + count)[1];
        if (POLYGON * (count + 1) + CORNER * more > TILE_NUMBERS)
            break;
        corners = more;
    }
    copy(scene->tile, POLYGON_OF(first), POLYGON * count);
    copy(scene->tile + POLYGON * count, CORNERS(first), CORNER * corners);
    return count;
}

// Fills the tile with shapes of a kind from `first` on; how many.
DEVICE int bring(const Scene *scene, int kind, int first)
{
    if (kind == POLYGONS)
        return bring_polygons(scene, first);
    int width = TRIANGLE, at = scene->at.triangles_at;
    if (kind == SPHERES)
        width = SPHERE, at = scene->at.spheres_at;
    else if (kind == BOXES)
        width = BOX, at = scene->at.boxes_at;
    else if (kind == ELLIPSOIDS)
        width = ELLIPSOID, at = scene->at.ellipsoids_at;
    const int left = shapes_of(scene, kind) - first, most = TILE_NUMBERS / width, count = left < most ? left : most;
    copy(scene->tile, scene->numbers + at + width * first, width * count);
    return count;
}

#define IN_STEP(mine) any_of_group(scene->vote, mine)
#define TRY_KIND(THIS, shapes, T)                                                                                      \
    if (kind == THIS)                                                                                                  \
        TRY(count, T)

#else

#define TRY_KIND(THIS, shapes, T)                                                                                      \
    TRY(scene->at.shapes, T)                                                                                           \
    before += scene->at.shapes;

#endif

// The hit that is nearest, or any one, before `limit` (HIT-1, HIT-5); none of a thread that does not ask.
DEVICE Hit search(const Scene *scene, Ray ray, Desk *desk, real limit, bool any, bool asks)
{
    const Probe every = probe_of(ray), *probe = &every;
    int before = 0;
    Hit hit;
    hit.t = limit, hit.shape = -1;
#if STREAMED
    const int end = IN_STEP(asks) ? scene->at.shapes - scene->at.solids : 0;
    int kind = SPHERES, first = 0;
    do {
        while (first == shapes_of(scene, kind))
            kind++, first = 0;
        BARRIER();
        const int count = bring(scene, kind, first);
        BARRIER();
#endif
#if NEED_SPHERE
        TRY_KIND(SPHERES, spheres, SPHERE_T)
#endif
#if NEED_BOX
        TRY_KIND(BOXES, boxes, BOX_T)
#endif
#if NEED_POLYGON
        TRY_KIND(POLYGONS, polygons, POLYGON_T)
#endif
#if NEED_ELLIPSOID
        TRY_KIND(ELLIPSOIDS, ellipsoids, ELLIPSOID_T)
#endif
#if NEED_MESH
        TRY_KIND(TRIANGLES, triangles, TRIANGLE_T)
#endif
#if STREAMED
        first += count, before += count;
    } while (before < end);
#endif
#if NEED_CSG
    TRY(scene->at.solids, SOLID_T)
#endif
    return hit;
}

#endif

#ifndef IN_STEP  // each thread goes its own way
#define IN_STEP(mine) (mine)
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
