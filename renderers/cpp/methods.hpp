// The methods that this program is built for: of each the first of its values, unless the compiler was given the word
// of another, such as -DSPHERE_TEXTBOOK (renderer.toml has them all).
#pragma once
#include "needs.hpp"

enum class SphereForm { robust, textbook, stable, wide };                   // SPH-3, ELL-3
enum class FloatingPoint { strict, contract, fast };                        // NUM-3
enum class Offset { bounded, relative, fixed, none };                       // OFF-1
enum class TriangleForm { watertight, moller_trumbore, watertight_kahan };  // TRI-3
enum class Vector { off, on, automatic };                                   // VEC-1, VEC-4

#if defined(VECTOR_ON) || defined(VECTOR_AUTO)
#define HAS_LANES
#endif

namespace methods {

constexpr SphereForm sphere = BUILT(SPHERE_TEXTBOOK) ? SphereForm::textbook
                              : BUILT(SPHERE_STABLE) ? SphereForm::stable
                              : BUILT(SPHERE_WIDE)   ? SphereForm::wide
                                                     : SphereForm::robust;
constexpr FloatingPoint floating_point = BUILT(FLOATING_POINT_FAST)       ? FloatingPoint::fast
                                         : BUILT(FLOATING_POINT_CONTRACT) ? FloatingPoint::contract
                                                                          : FloatingPoint::strict;
constexpr Offset offset = BUILT(OFFSET_RELATIVE) ? Offset::relative
                          : BUILT(OFFSET_FIXED)  ? Offset::fixed
                          : BUILT(OFFSET_NONE)   ? Offset::none
                                                 : Offset::bounded;
constexpr TriangleForm triangle = BUILT(TRIANGLE_MOLLER_TRUMBORE)    ? TriangleForm::moller_trumbore
                                  : BUILT(TRIANGLE_WATERTIGHT_KAHAN) ? TriangleForm::watertight_kahan
                                                                     : TriangleForm::watertight;
constexpr bool plain_slabs = BUILT(SLAB_PLAIN);             // BOX-3
constexpr bool steps = BUILT(CSG_STEPPING);                 // CSG-7
constexpr bool merges = !BUILT(MERGE_NONE);                 // CSG-4
constexpr bool clamps_fresnel = !BUILT(FRESNEL_UNCLAMPED);  // REF-2
constexpr bool clamps_phong = !BUILT(PHONG_UNCLAMPED);      // LOC-4
constexpr bool renormalises = !BUILT(RENORMALISE_OFF);      // NUM-4
constexpr Vector vector = BUILT(VECTOR_ON) ? Vector::on : BUILT(VECTOR_AUTO) ? Vector::automatic : Vector::off;

struct Method {
    const char* key;
    std::vector<const char*> values;
    int built;

    const char* value() const { return values[std::size_t(built)]; }
};

inline const Method all[] = {
    {"sphere", {"robust", "textbook", "stable", "wide"}, int(sphere)},
    {"floating_point", {"strict", "contract", "fast"}, int(floating_point)},
    {"offset", {"bounded", "relative", "fixed", "none"}, int(offset)},
    {"triangle", {"watertight", "moller-trumbore", "watertight-kahan"}, int(triangle)},
    {"slab", {"branch", "plain"}, plain_slabs},
    {"csg", {"intervals", "stepping"}, steps},
    {"merge", {"tolerant", "none"}, !merges},
    {"fresnel", {"clamped", "unclamped"}, !clamps_fresnel},
    {"phong", {"clamped", "unclamped"}, !clamps_phong},
    {"renormalise", {"on", "off"}, !renormalises},
    {"vector", {"off", "on", "auto"}, int(vector)},
};

}  // namespace methods
