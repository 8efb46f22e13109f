// From a ray to its light, and to the rays that come after it.

// A ray of the tree (REF-4): with the set of solids that it is in, and its path, which draws need.
typedef struct {
    Ray ray;
    ulong inside;
    uint path;
} Branch;

#if NEED_ATTENUATION
typedef real3 Factor;  // ATT-1: of light, for each channel
#define UNDIMMED R3(1, 1, 1)
DEVICE real most_of(Factor factor) { return most(most(factor.x, factor.y), factor.z); }
#else
typedef real Factor;
#define UNDIMMED R(1)
DEVICE real most_of(Factor factor) { return factor; }
#endif

// What a ray brings back and where it goes on (REF-4): its colour is `attenuation` times the sum of `light` and of each
// child's colour times its share.
typedef struct {
    real3 light;
    Factor attenuation;
    real reflected, transmitted;  // shares of its children; 0: there is none
    Branch mirrored, through;
    real3 normal;
#if NEED_GLOSSY
    real lobe;  // GLO-2: the exponent of its glossy reflection; -1 of a perfect mirror
#endif
} Meeting;

DEVICE uint path_base(const Scene *scene) { return (uint)(scene->at.glossy_rays > 1 ? scene->at.glossy_rays : 1) + 1; }

DEVICE Factor attenuation_of(const Scene *scene, int medium, real t)
{
#if NEED_ATTENUATION
    SCENE const real *row = scene->numbers + scene->at.materials_at + MATERIAL * medium;
    if (row[ATTENUATES] != 0)
        return R3(pow(row[ATTENUATION], t), pow(row[ATTENUATION + 1], t), pow(row[ATTENUATION + 2], t));
#endif
    return UNDIMMED;
}

// LOC-2 to LOC-4: of a light at a place. lit: whether there are a light and a surface; else it keeps step (search.h).
// around: the set of clear solids that feelers start in (MED-8).
DEVICE real3 light_from(const Scene *scene, Desk *desk, real3 place, real3 colour, Ray ray, const Surface *at,
                        SCENE const real *material, bool lit, ulong around)
{
    real3 sum = R3(0, 0, 0);
    const real3 to_light = place - at->point;
    const real distance = length3(to_light);
    const real3 l = to_light / distance;
    const real n_l = dot3(at->normal, l);
    const bool faced = lit && n_l > 0;
    if (!STREAMED && !faced)
        return sum;
#if NEED_SHADOWS
    if (STREAMED || scene->at.shadows) {
        const bool asks = faced && scene->at.shadows;
        Ray feeler;
        feeler.origin = leave(*at, 1, number(scene, EPSILON_OF_RAYS)), feeler.direction = l;
        desk->shadow += asks;
        real reach = distance;
#if TOUCHING
        if (scene->at.touching)  // less far than what the light lies on
            reach = reach - 512 * room_at_light(number(scene, EPSILON_OF_RAYS),
                                                number(scene, scene->at.extents_at + scene->at.shapes), place);
#endif
        if (search(scene, feeler, desk, reach, true, asks).shape >= 0) {
#if TOUCHING
            if (!scene->at.touching || !around || !lets_by(scene, desk, feeler, reach, around))
#endif
                return sum;
        }
    }
#endif
    if (!faced)
        return sum;
#if NEED_DIFFUSE
    sum = sum + n_l * LOAD3(material + DIFFUSE) * colour;
#endif
#if NEED_PHONG
    if (material[SPECULAR] != 0)
        sum = sum + highlight(material, ray.direction, at->normal, l, n_l) * colour;
#endif
    return sum;
}

// LOC: the light that reaches the eye from a surface without a mirror. met: whether the ray met it.
DEVICE real3 light_at(const Scene *scene, Desk *desk, const Branch *branch, const Surface *at, SCENE const real *material,
                      bool met, ulong around)
{
    real3 sum = R3(0, 0, 0);
#if NEED_AMBIENT
    sum = LOAD3(material + DIFFUSE) * triple(scene, AMBIENT);  // LOC-1
#endif
#if NEED_DIFFUSE || NEED_PHONG || NEED_SHADOWS
    const bool lit = met && scene->at.lights > 0;
    int i = 0;
    do {
        SCENE const real *light = scene->numbers + scene->at.lights_at + LIGHT * i;
        const real3 place = LOAD3(light), colour = LOAD3(light + 3);
#if NEED_SOFT
        const bool soft = scene->at.shadows && scene->at.feelers > 0 && light[6] > 0;  // SOF-1
        const int feelers = soft ? scene->at.feelers : 1;
        real3 of_light = R3(0, 0, 0);
        int f = 0;
        do {
            real3 target = place;
            if (soft)
                target =
                    place +
                    light[6] * on_unit_sphere(draw_for_feeler(scene, desk->draws, branch->path, (uint)i, (uint)f));
            of_light = of_light + light_from(scene, desk, target, colour, branch->ray, at, material, lit, around);
        } while (++f < feelers);
        sum = sum + (soft ? of_light / (real)feelers : of_light);
#else
        sum = sum + light_from(scene, desk, place, colour, branch->ray, at, material, lit, around);
#endif
    } while (++i < scene->at.lights);
#endif
    return sum;
}

// busy: whether there is such a ray; else the thread keeps step (search.h), and what it gets means nothing.
DEVICE Meeting meet(const Scene *scene, Desk *desk, const Branch *branch, int order, bool busy)
{
    Meeting meeting;
    desk->draws.order = order;
    meeting.reflected = meeting.transmitted = 0;
    meeting.attenuation = UNDIMMED;
    meeting.light = triple(scene, BACKGROUND);  // REF-6
    const Ray ray = branch->ray;
    Hit hit = search(scene, ray, desk, FAR, false, busy);
    const bool met = hit.shape >= 0;
    if (!STREAMED && !met)
        return meeting;
    if (!met)
        hit.t = 1, hit.shape = 0;  // to keep step from: any place does, as nothing is asked there
    Surface at = surface_of(scene, ray, desk, hit);
    ulong around = 0;
#if TOUCHING
    Factor dimmed = UNDIMMED;
    Place place;
    if (scene->at.touching) {
        place = touched_place(scene, desk, branch->inside, ray.direction, hit.shape, at);
        while (place.none) {
            dimmed = dimmed * attenuation_of(scene, place.sides.i, hit.t);
            const Ray onward = onward_of(scene, &place, ray.direction);
            hit = search(scene, onward, desk, FAR, false, true);
            if (hit.shape < 0)
                return meeting;
            at = surface_of(scene, onward, desk, hit);
            place = touched_place(scene, desk, place.sides.beyond, ray.direction, hit.shape, at);
        }
        at = place.at, hit.shape = place.shape;
        around = dot3(ray.direction, at.normal) <= 0 ? place.sides.was : place.sides.beyond;
    }
#endif
    SCENE const int *role = scene->integers + scene->at.roles_at + ROLE * hit.shape;
    SCENE const real *material = scene->numbers + scene->at.materials_at + MATERIAL * role[MATERIAL_ROW];
    const real d_n = dot3(ray.direction, at.normal);
    const bool enters = d_n <= 0;
    Sides sides = sides_of(scene, branch->inside, role[MATERIAL_ROW], role[RANK], enters);
#if TOUCHING
    if (scene->at.touching)
        sides = place.sides;
#endif
    const real3 light = light_at(scene, desk, branch, &at, material, met, around);
    if (!met)
        return meeting;
    meeting.light = light;
    meeting.attenuation = attenuation_of(scene, sides.i, hit.t);
#if TOUCHING
    meeting.attenuation = meeting.attenuation * dimmed;
#endif
#if NEED_REFLECTION
    if (order == scene->at.depth || material[SPECULAR] == 0)  // REF-5
        return meeting;
    const Interface interface = interface_of(scene, sides);
    const Fresnel part = fresnel(interface, fabs(d_n));
    meeting.reflected = material[SPECULAR] * part.reflected;
    meeting.mirrored.ray.origin = leave(at, enters ? 1 : -1, number(scene, EPSILON_OF_RAYS));
    meeting.mirrored.ray.direction = renormalise(ray.direction - 2 * d_n * at.normal);  // REF-3
    meeting.mirrored.inside = sides.was;
    meeting.normal = at.normal;
#if NEED_GLOSSY
    meeting.lobe = material[LOBE];
#endif
#if NEED_TRANSMISSION
    if (material[CLEAR] != 0) {
        meeting.transmitted = material[SPECULAR] * (1 - part.reflected);
        meeting.through.ray.origin = leave(at, enters ? -1 : 1, number(scene, EPSILON_OF_RAYS));
        meeting.through.ray.direction =
            role[FLAT] ? ray.direction : transmit(interface, part.s, ray.direction, at.normal, d_n);
        meeting.through.inside = sides.beyond;
    }
#endif
#endif
    return meeting;
}

// CUT-1: is a ray of this weight left out? Then it is counted in the dropped weight.
DEVICE bool cut(const Scene *scene, Desk *desk, Factor weight)
{
#if NEED_CUTOFF
    const real largest_channel = most_of(weight);
    if (largest_channel <= number(scene, CUTOFF)) {
        desk->dropped += largest_channel;
        return true;
    }
#endif
    return false;
}

// Child `which` of a ray (RND-4) that counts for `weight`, its own A included: its share, or 0 if there is none.
DEVICE real child_of(const Scene *scene, Desk *desk, const Branch *branch, const Meeting *meeting, uint which,
                     Factor weight, Branch *child)
{
    const uint last = path_base(scene) - 1;
    real share = which == last ? meeting->transmitted : meeting->reflected;
    if (share == 0)
        return 0;
#if NEED_GLOSSY
    if (which > 0 && which != last && meeting->lobe < 0)
        return 0;
#endif
    *child = which == last ? meeting->through : meeting->mirrored;
    child->path = branch->path * path_base(scene) + 1 + which;
#if NEED_GLOSSY
    if (which != last && scene->at.glossy_rays > 0 && meeting->lobe >= 0) {  // GLO-1
        const Uniform numbers = draw_for_lobe(scene, desk->draws, branch->path, which);
        const Lobe lobe = glossy(child->ray.direction, meeting->normal, meeting->lobe, numbers);
        share = share * (scene->at.study_weight ? pow(lobe.z, meeting->lobe) : 1) / (real)scene->at.glossy_rays;
        child->ray.direction = lobe.direction;
        if (share == 0)
            return 0;
    }
#endif
    if (cut(scene, desk, share * weight))
        return 0;
    if (which == last)
        desk->transmitted++;
    else
        desk->reflected++;
    return share;
}
