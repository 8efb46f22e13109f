// What this program is built for. The compiler is given -DNEED_SPHERE, -DNEED_SHADOWS, .. for what the job uses, and
// one of -DKIND_IMAGE, -DKIND_RAYS and of -DPRECISION_FLOAT64, -DPRECISION_FLOAT32; what is not named is not compiled.
// Without any of them everything is.
#pragma once
#include <type_traits>
#include <vector>

// Is the macro defined on the command line, that is, as 1? If not, its own name is its text.
#define MACRO_TEXT(macro) #macro
#define BUILT(macro) (MACRO_TEXT(macro)[0] == '1')

#define FOR_EACH_NEED(use)                                                                                             \
    use(sphere, SPHERE) use(box, BOX) use(polygon, POLYGON) use(ellipsoid, ELLIPSOID) use(mesh, MESH) use(csg, CSG)    \
    use(ambient, AMBIENT) use(diffuse, DIFFUSE) use(phong, PHONG) use(shadows, SHADOWS) use(soft, SOFT)                \
    use(reflection, REFLECTION) use(transmission, TRANSMISSION) use(attenuation, ATTENUATION) use(media, MEDIA)        \
    use(contact, CONTACT)                                                                                              \
    use(glossy, GLOSSY) use(supersampling, SUPERSAMPLING) use(sobol, SOBOL) use(adaptive, ADAPTIVE) use(lens, LENS)    \
    use(cutoff, CUTOFF)

namespace needs {

constexpr bool one_kind = BUILT(KIND_IMAGE) || BUILT(KIND_RAYS);
#define OR_NEED(name, NAME) || BUILT(NEED_##NAME)
constexpr bool chosen = one_kind FOR_EACH_NEED(OR_NEED);
#undef OR_NEED

#define NEED(name, NAME) constexpr bool name = !chosen || BUILT(NEED_##NAME);
FOR_EACH_NEED(NEED)
#undef NEED

constexpr bool image = !one_kind || BUILT(KIND_IMAGE);
constexpr bool rays = !one_kind || BUILT(KIND_RAYS);
constexpr bool float64 = BUILT(PRECISION_FLOAT64) || !BUILT(PRECISION_FLOAT32);
constexpr bool float32 = BUILT(PRECISION_FLOAT32) || !BUILT(PRECISION_FLOAT64);
constexpr bool touching = contact && media;  // MED-6
constexpr bool random = soft || glossy || supersampling || sobol || lens;

struct Need {
    const char *name, *macro;
    bool built;
};

#define ROW(name, NAME) {#name, "NEED_" #NAME, name},
constexpr Need all[] = {FOR_EACH_NEED(ROW)};
#undef ROW

}  // namespace needs

// A member of type T where it is needed, else nothing; with [[no_unique_address]] that takes no room.
// `name` tells the empty members of one class from each other, which may not share an address otherwise.
template<char name>
struct Nothing {
    constexpr Nothing() = default;
    template<typename Any> constexpr Nothing(const Any&) {}
};

template<bool needed, typename T, char name> using Only = std::conditional_t<needed, T, Nothing<name>>;
template<bool needed, typename T, char name> using List = Only<needed, std::vector<T>, name>;
