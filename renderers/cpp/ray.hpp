// A ray, and the place where it ends.
#pragma once
#include "methods.hpp"
#include "vector.hpp"

template<typename Real>
struct Ray {
    Vec3<Real> origin, direction;  // the direction has unit length (HIT-1)
};

// Every shape has `distance(ray)`: the t of its first hit; anything not greater than 0, or NaN, is a miss (NUM-5).
// It also has `surface(ray, t)`, asked for only once a ray, after the nearest shape is known.
template<typename Real>
struct Surface {
    Vec3<Real> point, normal;
    Real size;  // of the shape, for OFF-1

    // OFF-1: where a ray starts that leaves on the side the normal points to (+1) or on the other (-1).
    Vec3<Real> leave(Real side, Real epsilon) const
    {
        if constexpr (methods::offset == Offset::none)
            return point;
        return point + side * distance(epsilon) * normal;
    }

    // ε of OFF-1
    Real distance(Real epsilon) const
    {
        if constexpr (methods::offset == Offset::none)
            return 0;
        else if constexpr (methods::offset == Offset::relative)
            return epsilon * std::max(largest(point), size);
        else if constexpr (methods::offset == Offset::fixed)
            return epsilon;
        else
            return epsilon * (size + (std::abs(normal.x * point.x) + std::abs(normal.y * point.y) +
                                      std::abs(normal.z * point.z)) / 8);
    }
};
