#pragma once
#include "mesh.hpp"
#include "needs.hpp"

template<typename Real> struct Scratch;  // in csg.hpp

// A ray, with what the search for its hit takes along: each kind of shape uses the base or the member that it needs.
template<typename Real>
struct Probe : Ray<Real>, Only<needs::mesh, Shear<Real>, 's'> {
    [[no_unique_address]] Only<needs::csg, Scratch<Real>*, 'c'> scratch;

    Probe(const Ray<Real>& ray, Only<needs::csg, Scratch<Real>*, 'c'> scratch)
        : Ray<Real>(ray), Only<needs::mesh, Shear<Real>, 's'>(ray), scratch(scratch)
    {
    }

    const Ray<Real>& ray() const { return *this; }
};
