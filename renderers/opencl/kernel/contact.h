// Surfaces in one place, and the media that they part (MED-6 to MED-8).

#define TOUCHING (NEED_CONTACT && NEED_MEDIA && MERGES && !STREAMED)

#if TOUCHING

#define GRAZING R(0x1p-10)  // least |d·n| that the way back to a start is worked out with

// Where a ray ends: what is there of all the surfaces that it crosses there (MED-7).
typedef struct {
    Surface at;  // size: the largest of all
    int shape;
    Sides sides;
    bool none;  // there is no surface (MED-8)
} Place;

// The set of the solid alone that a shape bounds; empty if it has no rank.
DEVICE ulong solid_of(const Scene *scene, int shape)
{
    const int rank = scene->integers[scene->at.roles_at + ROLE * shape + RANK];
    return rank < 0 ? 0 : (ulong)1 << rank;
}

// Can light not tell one medium from the other?
DEVICE bool same_medium(const Scene *scene, int i, int t)
{
    SCENE const real *a = scene->numbers + scene->at.materials_at + MATERIAL * i;
    SCENE const real *b = scene->numbers + scene->at.materials_at + MATERIAL * t;
    return a[INDEX] == b[INDEX] && a[MU] == b[MU] && a[ATTENUATION] == b[ATTENUATION] &&
           a[ATTENUATION + 1] == b[ATTENUATION + 1] && a[ATTENUATION + 2] == b[ATTENUATION + 2];
}

DEVICE real reach_of(const Scene *scene, Surface at, real size)
{
    at.size = most(at.size, size);
    return shift_of(at, number(scene, EPSILON_OF_RAYS));
}

// Of a ray in the set `inside`: what there is of the solids that it enters and leaves.
typedef struct {
    ulong entered, left;
    real size;
} Changes;

DEVICE void cross_solid(const Scene *scene, real3 direction, int shape, const Surface *there, Changes *changes)
{
    if (dot3(direction, there->normal) > 0)
        changes->left |= solid_of(scene, shape);
    else
        changes->entered |= solid_of(scene, shape);
    changes->size = most(changes->size, there->size);
}

// MED-6: takes in shape `other` if it is in one place with the hit `at` on shape `first`.
CALLED void take_in(const Scene *scene, Desk *desk, real3 direction, int first, int other, const Surface *at,
                    Changes *changes, Place *place)
{
    SCENE const int *roles = scene->integers + scene->at.roles_at, *numbers = scene->integers + scene->at.precedence_at;
    if (roles[ROLE * other + OBJECT] == roles[ROLE * first + OBJECT])
        return;
    const real slope = fabs(dot3(direction, at->normal));
    const real reach = reach_of(scene, *at, number(scene, scene->at.extents_at + other));
    const real back = 8 * reach / most(slope, GRAZING);
    Ray ray;
    ray.origin = at->point - back * direction, ray.direction = direction;
    const Probe probe = probe_of(ray);
    Hit hit;
    hit.t = distance_to(scene, &probe, desk, other), hit.shape = other;
    if (!(hit.t > 0 && hit.t < 2 * back))
        return;
    const Surface there = surface_of(scene, ray, desk, hit);
    if (!(fabs(hit.t - back) * most(slope, fabs(dot3(direction, there.normal))) <= reach))
        return;
    cross_solid(scene, direction, other, &there, changes);
    if (numbers[other] > numbers[place->shape])
        place->at = there, place->shape = other;
}

// Of a ray in the set `inside` that hits `shape` at `at`.
CALLED Place touched_place(const Scene *scene, Desk *desk, ulong inside, real3 direction, int shape, Surface at)
{
    Place place;
    place.at = at, place.shape = shape;
    Changes changes;
    changes.entered = changes.left = 0, changes.size = at.size;
    cross_solid(scene, direction, shape, &at, &changes);
#if TREE
    for (int i = 0; i < scene->at.loose; i++)
        take_in(scene, desk, direction, shape, scene->integers[scene->at.loose_at + i], &at, &changes, &place);
    SCENE const real *boxes = scene->numbers + scene->at.tree_at;
    SCENE const int *links = scene->integers + scene->at.links_at, *items = scene->integers + scene->at.items_at;
    real reach = 8 * reach_of(scene, at, number(scene, scene->at.extents_at + scene->at.shapes)) /
                 most(fabs(dot3(direction, at.normal)), GRAZING);
    reach = reach + ROUNDING * EPSILON * (reach + largest(at.point));
    int waiting[TREE_DEPTH + 1], count = scene->at.in_tree > 0;
    waiting[0] = 0;
    while (count > 0) {
        const int node = waiting[--count], link = links[2 * node], leaf = links[2 * node + 1];
        bool near = true;
        for (int a = 0; a < 3; a++)
            near = near && boxes[NODE * node + a] <= component(at.point, a) + reach &&
                   component(at.point, a) - reach <= boxes[NODE * node + 3 + a];
        if (!near)
            continue;
        if (leaf == 0)
            waiting[count++] = link, waiting[count++] = link + 1;
        for (int i = link; i < link + leaf; i++)
            take_in(scene, desk, direction, shape, items[i], &at, &changes, &place);
    }
#else
    for (int other = 0; other < scene->at.shapes; other++)
        take_in(scene, desk, direction, shape, other, &at, &changes, &place);
#endif
    place.at.size = changes.size;
    SCENE const int *role = scene->integers + scene->at.roles_at + ROLE * place.shape;
    const ulong entered = changes.entered & ~changes.left, left = changes.left & ~changes.entered;
    place.sides.was = (inside | left) & ~entered, place.sides.beyond = (inside | entered) & ~left;
    place.sides.i = medium(scene, place.sides.was), place.sides.t = medium(scene, place.sides.beyond);
    place.none = false;
    if (role[RANK] >= 0)
        place.none = ((entered | left) & ~solid_of(scene, place.shape)) != 0 &&
                     same_medium(scene, place.sides.i, place.sides.t);
    else if (!role[FLAT] && dot3(direction, place.at.normal) > 0)
        place.sides.t = place.sides.i, place.sides.i = role[MATERIAL_ROW];
    else
        place.sides.t = role[MATERIAL_ROW];
    return place;
}

// The ray that goes on beyond a place.
DEVICE Ray onward_of(const Scene *scene, const Place *place, real3 direction)
{
    Ray ray;
    const real side = dot3(direction, place->at.normal) > 0 ? 1 : -1;
    ray.origin = leave(place->at, side, number(scene, EPSILON_OF_RAYS)), ray.direction = direction;
    return ray;
}

// Does a feeler that starts in the set `inside` and meets something pass through it all (MED-8)?
CALLED bool lets_by(const Scene *scene, Desk *desk, Ray feeler, real distance, ulong inside)
{
    while (inside != 0) {
        const Hit hit = search(scene, feeler, desk, distance, false, true);
        if (hit.shape < 0)
            return true;
        const Place place =
            touched_place(scene, desk, inside, feeler.direction, hit.shape, surface_of(scene, feeler, desk, hit));
        if (!place.none)
            return false;
        feeler = onward_of(scene, &place, feeler.direction);
        distance -= hit.t;
        inside = place.sides.beyond;
    }
    return search(scene, feeler, desk, distance, true, true).shape < 0;
}

#endif
