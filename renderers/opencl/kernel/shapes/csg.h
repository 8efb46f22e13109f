// CSG solid: an expression in postfix over parts, met by the whole line of a ray in boundaries.

enum { PART_SPHERE, PART_BOX, PART_ELLIPSOID, PART_MESH, OR, AND, NOT };  // of the postfix

#define MOST_OF_MESH 64  // crossings of a line with one mesh (CSG-6)

// Where the line crosses a face of a part and, once it is kept, what CSG-4 asks of it.
typedef struct {
    real t, d_n, coordinate;  // |d·n|, and max(|o|∞, |o + t d|∞, size)
    int part, face;           // part: its place in the postfix
    bool leaves;              // the solid, with growing t
} Boundary;

// Where a thread works out the boundaries of a solid. The sizes are those of the largest solid.
typedef struct {
    Boundary boundaries[CROSSINGS];
    bool inside[PARTS], values[PARTS];  // inside: by part; values: of the postfix
    int count;
    bool overflow;  // a line crossed a mesh too often: the sample is not finite (CSG-6)
} Scratch;

// CSG-3: puts a crossing in its place. `part`s come in their order, faces of a mesh in any.
DEVICE void add_crossing(Scratch *scratch, real t, int part, int face)
{
    int place = scratch->count++;
    for (; place > 0; place--) {
        const Boundary before = scratch->boundaries[place - 1];
        if (!(t < before.t || (t == before.t && part == before.part && face < before.face)))
            break;
        scratch->boundaries[place] = before;
    }
    scratch->boundaries[place].t = t;
    scratch->boundaries[place].part = part;
    scratch->boundaries[place].face = face;
}

#if NEED_MESH
// Of one triangle; false if the mesh is crossed too often.
DEVICE bool cross_triangle(const Scene *scene, Scratch *scratch, const Shear *shear, int part, int triangle, int limit)
{
    real t = 0;
    if (!triangle_crossed(scene->numbers + scene->at.part_triangles_at + TRIANGLE * triangle, shear, &t))
        return true;
    if (scratch->count == limit)
        return false;
    add_crossing(scratch, t, part, triangle);
    return true;
}

// All crossings of a mesh; false if there are too many.
DEVICE bool cross_mesh(const Scene *scene, Scratch *scratch, Ray ray, int part, int mesh)
{
    SCENE const int *range = scene->integers + scene->at.part_meshes_at + 2 * mesh;
    const Shear shear = shear_of(ray);
    const int first = range[0], triangles = range[1];
    const int limit = scratch->count + (triangles < MOST_OF_MESH ? triangles : MOST_OF_MESH);
#if TREE
    SCENE const int *links = scene->integers + scene->at.links_at, *items = scene->integers + scene->at.items_at;
    const Slabs slabs = slabs_of(ray);
    int waiting[TREE_DEPTH], count = 1;
    waiting[0] = scene->integers[scene->at.roots_at + mesh];
    while (count > 0) {
        const int node = waiting[--count], link = links[2 * node], leaf = links[2 * node + 1];
        if (!(enter(scene->numbers + scene->at.tree_at + NODE * node, &slabs, -FAR, FAR) < FAR))
            continue;
        if (leaf == 0)
            waiting[count++] = link, waiting[count++] = link + 1;
        for (int i = link; i < link + leaf; i++)
            if (!cross_triangle(scene, scratch, &shear, part, items[i], limit))
                return false;
    }
#else
    for (int i = first; i < first + triangles; i++)
        if (!cross_triangle(scene, scratch, &shear, part, i, limit))
            return false;
#endif
    return true;
}
#endif

// CSG-1: the crossings of all parts, in order.
DEVICE void cross_parts(const Scene *scene, Scratch *scratch, Ray ray, SCENE const int *code, int length)
{
    scratch->count = 0;
    for (int p = 0; p < length; p++) {
        const int kind = code[2 * p], row = code[2 * p + 1];
        real in = 0, out = 0;
        int in_face = 0, out_face = 1;
        bool crossed = false;
        if (kind == PART_SPHERE)
            crossed = sphere_crossed(scene->numbers + scene->at.part_spheres_at + SPHERE * row, ray, &in, &out);
        else if (kind == PART_ELLIPSOID)
            crossed = ellipsoid_crossed(scene->numbers + scene->at.part_ellipsoids_at + ELLIPSOID * row, ray, &in, &out);
        else if (kind == PART_BOX) {
            SCENE const real *box = scene->numbers + scene->at.part_boxes_at + BOX * row;
            const Span span = box_span(SIDES_OF(box), ray);
            in = span.t0, out = span.t1, in_face = span.in, out_face = 8 + span.out;
            crossed = in <= out;
        }
#if NEED_MESH
        else if (kind == PART_MESH && !cross_mesh(scene, scratch, ray, p, row))
            scratch->overflow = true;
#endif
        if (crossed) {
            add_crossing(scratch, in, p, in_face);
            add_crossing(scratch, out, p, out_face);
        }
    }
}

// The value of the expression, from those of its parts.
DEVICE bool evaluate(Scratch *scratch, SCENE const int *code, int length)
{
    int top = 0;
    for (int p = 0; p < length; p++) {
        const int step = code[2 * p];
        if (step < OR)
            scratch->values[top++] = scratch->inside[p];
        else if (step == NOT)
            scratch->values[top - 1] = !scratch->values[top - 1];
        else {
            const bool a = scratch->values[top - 2], b = scratch->values[top - 1];
            scratch->values[--top - 1] = step == OR ? a || b : a && b;
        }
    }
    return scratch->values[0];
}

DEVICE Surface part_surface(const Scene *scene, SCENE const int *code, Ray ray, const Boundary *boundary)
{
    const int kind = code[2 * boundary->part], row = code[2 * boundary->part + 1];
    const real t = boundary->t;
    if (kind == PART_SPHERE)
        return sphere_surface(scene->numbers + scene->at.part_spheres_at + SPHERE * row, ray, t);
    if (kind == PART_ELLIPSOID)
        return ellipsoid_surface(scene->numbers + scene->at.part_ellipsoids_at + ELLIPSOID * row, ray, t);
#if NEED_MESH
    if (kind == PART_MESH)
        return triangle_surface(scene->numbers + scene->at.part_triangles_at + TRIANGLE * boundary->face, ray, t);
#endif
    return side_of_box(scene->numbers + scene->at.part_boxes_at + BOX * row, ray, t, boundary->face % 8);
}

// CSG-3, CSG-4: of all crossings those that are boundaries of the solid, in the same place; how many.
DEVICE int keep_boundaries(const Scene *scene, Scratch *scratch, Ray ray, SCENE const int *code, int length)
{
    int kept = 0;
    for (int p = 0; p < length; p++)
        scratch->inside[p] = false;
    bool value = scratch->count > 0 && evaluate(scratch, code, length);
    for (int i = 0; i < scratch->count; i++) {
        Boundary next = scratch->boundaries[i];
        scratch->inside[next.part] = !scratch->inside[next.part];
        if (evaluate(scratch, code, length) == value)
            continue;
        value = !value;
        next.leaves = !value;
#ifndef MERGE_NONE
        const Surface at = part_surface(scene, code, ray, &next);
        next.d_n = fabs(dot3(ray.direction, at.normal));
        next.coordinate = most(most(largest(ray.origin), largest(ray.origin + next.t * ray.direction)), at.size);
        if (kept > 0) {
            const Boundary last = scratch->boundaries[kept - 1];
            const real sliver = number(scene, SLIVER) * most(last.coordinate, at.size);
            if ((next.t - last.t) * least(last.d_n, next.d_n) <= sliver) {
                kept--;
                continue;
            }
        }
#endif
        scratch->boundaries[kept++] = next;
    }
    return kept;
}

// CSG-5: the first boundary kept with t > 0: its place in the scratch, or -1.
DEVICE int first_boundary(const Scene *scene, Scratch *scratch, Ray ray, int solid)
{
    SCENE const int *range = scene->integers + scene->at.solids_at + 2 * solid;
    SCENE const int *code = scene->integers + scene->at.code_at + 2 * range[0];
    cross_parts(scene, scratch, ray, code, range[1]);
    const int kept = keep_boundaries(scene, scratch, ray, code, range[1]);
    for (int i = 0; i < kept; i++)
        if (scratch->boundaries[i].t > 0)
            return i;
    return -1;
}

DEVICE real solid_distance(const Scene *scene, Scratch *scratch, Ray ray, int solid)
{
    const int hit = first_boundary(scene, scratch, ray, solid);
    return hit < 0 ? 0 : scratch->boundaries[hit].t;
}

DEVICE Surface solid_surface(const Scene *scene, Scratch *scratch, Ray ray, int solid)
{
    const int first = scene->integers[scene->at.solids_at + 2 * solid];
    const Boundary hit = scratch->boundaries[first_boundary(scene, scratch, ray, solid)];
    Surface at = part_surface(scene, scene->integers + scene->at.code_at + 2 * first, ray, &hit);
    if ((dot3(ray.direction, at.normal) > 0) != hit.leaves)
        at.normal = -at.normal;
    return at;
}
