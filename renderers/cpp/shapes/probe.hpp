#pragma once
#include "mesh.hpp"

template<typename Real> struct Scratch;  // in csg.hpp

// Only Möller and Trumbore's triangles, and polygons beside them, go without the sheared frame (TRI-3, POL-4), but for
// parts of solids.
constexpr bool sheared = (needs::mesh && needs::csg) || ((needs::polygon || needs::mesh) &&
                                                          methods::triangle != TriangleForm::moller_trumbore);

// A ray, with what the search for its hit takes along: each kind of shape uses the base or the member that it needs.
template<typename Real>
struct Probe : Ray<Real>, Only<sheared, Shear<Real>, 's'> {
    [[no_unique_address]] Only<needs::csg, Scratch<Real>*, 'c'> scratch;

    Probe(const Ray<Real>& ray, Only<needs::csg, Scratch<Real>*, 'c'> scratch)
        : Ray<Real>(ray), Only<sheared, Shear<Real>, 's'>(ray), scratch(scratch)
    {
    }

    const Ray<Real>& ray() const { return *this; }
};
